"""What a program must find as it is without KiKS; a module that has been imported before the program runs."""

import asyncio
import concurrent.futures
import datetime
import io
import multiprocessing
import os
import pickle
import queue
import random
import select
import selectors
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
import time
import uuid

import numpy as np
import serial

# From 3.13 on, code in C keeps its values out of reach.
_LOCAL = " local" if sys.version_info < (3, 13) else ""

BEFORE = {
    f"{name}.{attribute}": getattr(module, attribute)
    for name, module, attributes in (
        ("asyncio", asyncio, "Event Future Lock Queue Task get_event_loop run sleep"),
        ("concurrent.futures", concurrent.futures, "Future ThreadPoolExecutor"),
        ("datetime", datetime, "date datetime time timedelta timezone"),
        ("io", io, "BufferedReader FileIO StringIO TextIOWrapper open"),
        ("multiprocessing", multiprocessing, "Process"),
        ("numpy", np, "datetime64 ndarray"),
        ("os", os, "getpid kill listdir pipe read scandir stat times urandom utime write"),
        ("queue", queue, "Empty Queue SimpleQueue"),
        ("random", random, "Random SystemRandom"),
        ("select", select, "epoll select poll"),
        ("selectors", selectors, "DefaultSelector EpollSelector"),
        ("serial", serial, "Serial SerialException serial_for_url"),
        ("signal", signal, "alarm pause setitimer signal sigwait"),
        ("socket", socket, "create_connection socket socketpair"),
        ("sqlite3", sqlite3, "Connection connect"),
        ("subprocess", subprocess, "Popen TimeoutExpired run"),
        ("threading", threading, "Condition Event Lock RLock Thread Timer get_ident" + _LOCAL),
        ("time", time, "ctime gmtime localtime monotonic perf_counter sleep strftime time time_ns"),
        ("uuid", uuid, "UUID uuid1 uuid4"),
    )
    for attribute in attributes.split()
}
"""Functions and classes, by their names."""

_IS_IMMUTABLE = 1 << 8
"""Py_TPFLAGS_IMMUTABLETYPE (object.h); other flags tell what Python has noted of a class."""

KINDS = {kind.__qualname__: kind for kind in map(type, (threading.Lock(), threading.RLock(), select.poll(), time.time))}
"""Classes that have no name in a module."""


def look() -> dict[str, tuple[object, ...]]:
    """Return what identifies each of them to programs, pickles and code in C."""
    return {
        name: (
            id(each),
            type(each),
            each.__module__,
            each.__qualname__,
            each.__doc__,
            isinstance(each, type) and (each.__basicsize__, each.__mro__, each.__flags__ & _IS_IMMUTABLE),
            pickled(each),
        )
        for name, each in (*BEFORE.items(), *KINDS.items())
    }


def pickled(each: object) -> bytes | str:
    try:
        data = pickle.dumps(each)
    except Exception as error:
        return str(error)
    assert pickle.loads(data) is each
    return data


def inside() -> dict[str, dict[str, int]]:
    """Return what each class has, by the identity of its attributes."""
    classes = {name: each for name, each in (*BEFORE.items(), *KINDS.items()) if isinstance(each, type)}
    return {name: {key: id(value) for key, value in vars(each).items()} for name, each in classes.items()}
