"""The system calls that programs in a sandbox may not make: a filter for bubblewrap, as Linux takes it (seccomp).

They would keep memory outside of any process, look into other processes, or reach parts of the kernel in which holes
are found; programs for a robot need none of them. On another processor than those below there is no filter.
"""

from __future__ import annotations

import platform
import struct

_LOAD, _JUMP_EQUAL, _JUMP_FROM, _JUMP_SET, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT = 0, 4, 16  # struct seccomp_data
_ALLOW, _KILL, _NOT_PERMITTED, _NOT_KNOWN = 0x7FFF0000, 0x80000000, 0x00050000 | 1, 0x00050000 | 38
_NEW_USERS = 0x10000000  # CLONE_NEWUSER
_OTHER_ABI = 0x40000000  # x32

_MACHINES = {
    # AUDIT_ARCH_X86_64 and AUDIT_ARCH_AARCH64: clone, and what is refused
    "x86_64": (
        0xC000003E,
        56,
        {
            "memory": (319, 447, 29, 240, 68),  # memfd_create, memfd_secret, shmget, mq_open, msgget
            "processes": (
                101,
                310,
                311,
                438,
                272,
                308,
            ),  # ptrace, process_vm_readv, _writev, pidfd_getfd, unshare, setns
            "kernel": (
                321,
                298,
                323,
                425,
                248,
                249,
                250,
                165,
            ),  # bpf, perf_event_open, userfaultfd, io_uring, keys, mount
        },
    ),
    "aarch64": (
        0xC00000B7,
        220,
        {
            "memory": (279, 447, 194, 180, 186),
            "processes": (117, 270, 271, 438, 97, 268),
            "kernel": (280, 241, 282, 425, 217, 218, 219, 40),
        },
    ),
}
_CLONE3 = 435


def system_call_filter() -> bytes:
    """Return the filter; empty on a processor that is not known."""
    if platform.machine() not in _MACHINES:
        return b""
    architecture, clone, groups = _MACHINES[platform.machine()]
    refused = [number for group in groups.values() for number in group]
    steps: list[tuple[int, int, int, int]] = [
        (_LOAD, 0, 0, _ARCHITECTURE),
        (_JUMP_EQUAL, 1, 0, architecture),
        (_RETURN, 0, 0, _KILL),
        (_LOAD, 0, 0, _NUMBER),
        # To the refusal at the end; the numbers of the steps that are skipped.
        (_JUMP_FROM, len(refused) + 6, 0, _OTHER_ABI),
        *((_JUMP_EQUAL, len(refused) + 5 - place, 0, number) for place, number in enumerate(refused)),
        # Its argument lies in memory, where no filter sees it; without it the library takes `clone`.
        (_JUMP_EQUAL, 0, 1, _CLONE3),
        (_RETURN, 0, 0, _NOT_KNOWN),
        (_JUMP_EQUAL, 0, 2, clone),
        (_LOAD, 0, 0, _FIRST_ARGUMENT),
        (_JUMP_SET, 1, 0, _NEW_USERS),
        (_RETURN, 0, 0, _ALLOW),
        (_RETURN, 0, 0, _NOT_PERMITTED),
    ]
    return b"".join(struct.pack("=HBBI", *step) for step in steps)
