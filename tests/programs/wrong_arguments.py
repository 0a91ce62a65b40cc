"""Calls that are wrong, and what each of them says."""

import _thread
import datetime
import fcntl
import os
import queue
import random
import re
import resource
import select
import signal
import socket
import threading
import time

lock, rlock, simple = threading.Lock(), threading.RLock(), queue.SimpleQueue()
modules = (datetime, fcntl, os, random, resource, select, signal, socket, time, _thread)

CALLS = """
time.sleep()  time.sleep('1')  time.sleep(None)  time.sleep(0.1, 2)  time.sleep(-1)  time.sleep(float('nan'))
time.sleep(float('inf'))  time.sleep(1e20)  time.sleep(secs=1)  time.time(1)  time.time_ns(1)  time.monotonic(1)
time.perf_counter(x=1)  time.process_time(1)  time.clock_gettime()  time.clock_gettime('x')  time.clock_gettime(99)
time.clock_gettime_ns(None)  time.localtime('x')  time.gmtime(1, 2)  time.ctime('x')  time.asctime(1)  time.strftime()
time.strftime(1)  time.strftime('%Y', 1)  lock.acquire(timeout='x')  lock.acquire(False, 1)  lock.acquire(True, -2)
lock.acquire(True, 1e20)  lock.acquire(True, None)  lock.release()  lock.__enter__(1)  rlock.acquire(1, 2, 3)
rlock.acquire(False, 1)  rlock.acquire(timeout='x')  rlock.release()  rlock.release(1)  threading.Lock(1)
simple.get(timeout=-1)  simple.get(False)  select.select(1)  select.select([], [], [], 'x')
select.select([], [], [], -1)  select.select(1, [], [])  select.select(['x'], [], [])  select.poll().poll('x')
select.poll().poll(1, 2)  select.epoll().poll('x')  select.epoll().poll(1, -2)  os.read('x', 1)  os.read(0)
os.read(0, -1)  os.write(1, 'x')  os.write(1)  os.pipe(1)  os.urandom('x')  os.getrandom('x')  os.times(1)  os.stat()
os.stat(1.5)  os.stat('/nowhere')  os.listdir(1.5)  os.listdir('/nowhere')  os.scandir(1.5)  os.access('/')  os.utime()
os.utime('/nowhere')  os.utime('/tmp', 1)  os.utime('/tmp', (1, 2), ns=(1, 2))  signal.signal(1)
signal.signal(99, signal.SIG_IGN)  signal.signal('x', signal.SIG_IGN)  signal.signal(2, 1.5)  signal.getsignal('x')
signal.getsignal(99)  signal.alarm('x')  signal.alarm()  signal.setitimer(signal.ITIMER_REAL)  signal.setitimer(99, 1)
signal.setitimer(signal.ITIMER_REAL, 'x')  signal.setitimer(signal.ITIMER_REAL, -1)  signal.getitimer('x')
signal.pause(1)  signal.sigwait(1)  signal.sigtimedwait([1], -1)  signal.sigtimedwait([1], 'x')
signal.pthread_sigmask(99, [])  _thread.start_new_thread(1)  _thread.start_new_thread(1, ())
_thread.start_new_thread(print, 1)  _thread.start_new_thread(print, (), 1)  _thread.get_ident(1)
datetime.datetime.now('x')  datetime.datetime.now(1, 2)  datetime.datetime.now(zone=1)  datetime.datetime.utcnow(1)
random.Random().seed([])  random.seed([])  random.Random([])  resource.getrusage()  resource.getrusage('x')
resource.getrusage(99)  fcntl.ioctl()  fcntl.ioctl('x', 1)  fcntl.ioctl(99, 1)  socket.socketpair(99)
socket.socket().recv()  socket.socket().recv(-1)
"""

for call in re.split(r"\s{2,}|\n", CALLS.strip()):
    try:
        print(call, "->", type(eval(call)).__name__)
    except Exception as error:
        print(call, "->", type(error).__name__, error)
