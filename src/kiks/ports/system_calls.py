"""The system calls that programs in a sandbox may not make: a filter for bubblewrap, as Linux takes it (seccomp).

They would keep memory outside of any process, look into other processes, or reach parts of the kernel in which holes
are found; programs for a robot need none of them. On another processor than those below there is no filter.
"""

from __future__ import annotations

import platform
import struct
from collections.abc import Iterable

_LOAD, _JUMP_EQUAL, _JUMP_FROM, _JUMP_SET, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT = 0, 4, 16  # struct seccomp_data; the low half of an argument comes first
_ALLOW, _KILL, _ERROR = 0x7FFF0000, 0x80000000, 0x00050000
_NOT_PERMITTED, _NOT_KNOWN, _NO_PROTOCOL, _NO_FAMILY = _ERROR | 1, _ERROR | 38, _ERROR | 93, _ERROR | 97
_NEW_USERS = 0x10000000  # CLONE_NEWUSER

_MACHINES: dict[str, tuple[int, dict[str, tuple[int, ...]], dict[str, int]]] = {
    # AUDIT_ARCH_X86_64 and AUDIT_ARCH_AARCH64; what is refused; what is refused with some arguments, see below
    "x86_64": (
        0xC000003E,
        {
            # memfd_create, shmget, mq_open, msgget, semget, vmsplice, inotify_init, _init1, io_setup, mbind, seccomp;
            # epoll_create, _create1: libraries take poll instead
            "memory": (319, 29, 240, 68, 64, 278, 253, 294, 206, 237, 317, 213, 291),
            # ptrace, process_vm_readv, _writev, unshare, setns; setpriority, sched_setparam, _setscheduler, _setattr:
            # a process that stands back for all others would neither compute nor wait
            "processes": (101, 310, 311, 272, 308, 141, 142, 144, 314),
            # bpf, perf_event_open, userfaultfd, keys, mount, syslog, fanotify_init
            "kernel": (321, 298, 323, 248, 249, 250, 165, 103, 300),
        },
        {"clone": 56, "mmap": 9, "socket": 41, "socketpair": 53, "setsockopt": 54, "fcntl": 72, "prlimit64": 302},
    ),
    "aarch64": (
        0xC00000B7,
        {
            "memory": (279, 194, 180, 186, 190, 75, 26, 0, 235, 277, 20),
            "processes": (117, 270, 271, 97, 268, 140, 118, 119, 274),
            "kernel": (280, 241, 282, 217, 218, 219, 40, 116, 262),
        },
        {"clone": 220, "mmap": 222, "socket": 198, "socketpair": 199, "setsockopt": 208, "fcntl": 25, "prlimit64": 261},
    ),
}
_NEWER = 424
"""The first system call that is newer than Linux 5.0. None of these is known here, such as io_uring, mounts by
descriptors and Landlock: libraries go on without. They take `clone`, whose flags a filter sees, instead of `clone3`."""
_SHARED, _OF_NO_FILE = 0x01, 0x20  # MAP_SHARED, MAP_ANONYMOUS
_FAMILIES = (1, 2, 10)
"""AF_UNIX, AF_INET and AF_INET6. Namespaces do not separate all others: AF_VSOCK leads out of a virtual machine."""
_PROTOCOLS = (0, 6, 17)
"""The usual one, TCP and UDP."""
_SOCKET_OPTIONS = (7, 8, 32, 33, 60)
"""SO_SNDBUF, SO_RCVBUF, the same by force, and SO_ZEROCOPY: what sockets keep is counted by their number."""
_FILE_CONTROLS = (36, 37, 38, 1031)
"""F_OFD_GETLK and so on: these locks belong to no process, so nothing tells whose they are; and F_SETPIPE_SZ."""

_Step = tuple[int, int, int, int]


def system_call_filter() -> bytes:
    """Return the filter; empty on a processor that is not known."""
    if platform.machine() not in _MACHINES:
        return b""
    architecture, groups, numbers = _MACHINES[platform.machine()]
    steps: list[_Step] = [
        (_LOAD, 0, 0, _ARCHITECTURE),
        (_JUMP_EQUAL, 1, 0, architecture),
        (_RETURN, 0, 0, _KILL),
        (_LOAD, 0, 0, _NUMBER),
        (_JUMP_FROM, 0, 1, _NEWER),
        (_RETURN, 0, 0, _NOT_KNOWN),
    ]
    for number in (number for group in groups.values() for number in group):
        steps += _of(number, [(_RETURN, 0, 0, _NOT_PERMITTED)])
    steps += _of(numbers["clone"], [_argument(0), (_JUMP_SET, 1, 0, _NEW_USERS), *_end(_NOT_PERMITTED)])
    # Such memory outlives its pages in processes. Shared memory is a file in /dev/shm.
    both = [(_JUMP_SET, 0, 1, _SHARED), (_JUMP_SET, 1, 0, _OF_NO_FILE)]
    steps += _of(numbers["mmap"], [_argument(3), *both, *_end(_NOT_PERMITTED)])
    are_known = [_argument(0), *_any(_FAMILIES), (_RETURN, 0, 0, _NO_FAMILY)]
    are_known += [_argument(2), *_any(_PROTOCOLS), (_RETURN, 0, 0, _NO_PROTOCOL), (_RETURN, 0, 0, _ALLOW)]
    for name in ("socket", "socketpair"):
        steps += _of(numbers[name], are_known)
    # Its own limits (process 0), not those of the nursery.
    steps += _of(numbers["prlimit64"], [_argument(0), (_JUMP_EQUAL, 0, 1, 0), *_end(_NOT_PERMITTED)])
    steps += _of(numbers["setsockopt"], [_argument(2), *_any(_SOCKET_OPTIONS), *_end(_NOT_PERMITTED)])
    steps += _of(numbers["fcntl"], [_argument(1), *_any(_FILE_CONTROLS), *_end(_NOT_PERMITTED)])
    return b"".join(struct.pack("=HBBI", *step) for step in [*steps, (_RETURN, 0, 0, _ALLOW)])


def _of(number: int, steps: list[_Step]) -> list[_Step]:
    """Return the steps for one system call, which end with a return."""
    return [(_JUMP_EQUAL, 0, len(steps), number), *steps]


def _argument(place: int) -> _Step:
    return _LOAD, 0, 0, _FIRST_ARGUMENT + 8 * place


def _any(values: tuple[int, ...]) -> Iterable[_Step]:
    """Return steps that jump over the one that follows if what was loaded is one of some values."""
    return ((_JUMP_EQUAL, len(values) - place, 0, value) for place, value in enumerate(values))


def _end(error: int) -> list[_Step]:
    """Return the end: allowed, or, after a jump over that, the error."""
    return [(_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, error)]
