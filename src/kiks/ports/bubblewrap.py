"""bubblewrap (`bwrap`): the command line that runs a process in namespaces of its own, and what it complains of."""

from __future__ import annotations

import contextlib
import os
import shutil
import site
import sys
from collections.abc import Sequence
from pathlib import Path

import kiks
from kiks.errors import KiksError
from kiks.model.package import shipped

_SYSTEM_FOLDERS = ("/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")
_SYSTEM_FILES = ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime")
_AS_SUPERUSER = """
for each in /dev/null /dev/zero /dev/full /dev/random /dev/urandom /dev/tty; do
    mount --bind $each $each && mount -o remount,bind,ro $each || exit
done
exec "$@"
"""
"""Script that makes the rights of the devices read-only before bubblewrap takes them: they belong to the superuser, and
a program could change them for the whole computer. Where bubblewrap does that itself, devices cannot be used."""

WRITABLE = ("/tmp", "/dev/shm")
"""Folders in memory into which a program may write."""


def bubblewrap_line(files: Sequence[str], size: int) -> list[str]:
    """Return the beginning of a command line that runs the rest of it in namespaces of its own.

    Args:
        files: Files and folders that it may read.
        size: Largest sum of the files that it writes [bytes].

    Raises:
        KiksError: If there is no bubblewrap.
    """
    bwrap = shutil.which("bwrap")
    if bwrap is None:
        raise KiksError(
            "a program of somebody else must run in a sandbox, but bubblewrap (bwrap) is not installed. Install it "
            "(Debian: sudo apt-get install bubblewrap), or say --trusted if you have read the programs."
        )
    words = ["unshare", "-r", "-m", "sh", "-c", _AS_SUPERUSER, "sh"] if os.geteuid() == 0 else []
    words += [bwrap, "--unshare-all", "--unshare-user", "--die-with-parent", "--new-session", "--as-pid-1"]
    words += ["--cap-drop", "ALL", "--ro-bind", "/usr", "/usr"]
    for folder in _SYSTEM_FOLDERS:
        if os.path.islink(folder):
            words += ["--symlink", os.readlink(folder), folder]
        elif os.path.isdir(folder):
            words += ["--ro-bind", folder, folder]
    for file in _SYSTEM_FILES:
        words += ["--ro-bind-try", file, file]
    # No zeros that processes map together: such memory would be none's. What is read from /dev/full is zeros, too.
    words += ["--proc", "/proc", "--dev", "/dev", "--dev-bind", "/dev/full", "/dev/zero"]
    # No terminals: their number is that of the whole computer.
    words += ["--tmpfs", "/dev/pts", "--remount-ro", "/dev/pts"]
    if os.geteuid() == 0:
        # What the kernel tells the superuser alone, such as /proc/timer_list, is not for a program of the superuser.
        for entry in os.scandir("/proc"):
            if entry.is_file() and not entry.stat().st_mode & 0o004:
                words += ["--ro-bind", "/dev/null", entry.path]
    for folder in WRITABLE:
        words += ["--size", str(size), "--tmpfs", folder]
    for file in files:
        words += ["--ro-bind", file, file]
    # The settings of the kernel in /proc belong to the superuser, who may be this user. What bubblewrap itself makes in
    # memory has no limit.
    return [*words, "--remount-ro", "/proc", "--remount-ro", "/dev", "--remount-ro", "/", "--chdir", "/tmp"]


def python_folders() -> list[Path]:
    """Return the folders that this Python and KiKS need, none of which may hold the home folder."""
    names = {sys.prefix, sys.exec_prefix, sys.base_prefix, sys.base_exec_prefix, *kiks.__path__}
    names.add(str(shipped("matlab")))
    names |= {*site.getsitepackages(), *([site.getusersitepackages()] if site.ENABLE_USER_SITE else [])}
    folders = {Path(name).resolve() for name in names} | {Path(name) for name in names}
    home = Path.home()
    return sorted(
        each for each in folders if each.is_dir() and not home.is_relative_to(each) and not each.is_relative_to("/usr")
    )


def start_failure(errors: int, *, is_trusted: bool) -> str:
    """Return why there is no sandbox, from what bubblewrap or Python has said."""
    os.set_blocking(errors, False)
    said = ""
    with contextlib.suppress(OSError):
        said = os.read(errors, 1 << 12).decode(errors="replace").strip()
    last = said.splitlines()[-1][:200] if said else "nothing"
    if is_trusted:
        return f"Cannot start a process for programs: it said {last!r}. End other programs."
    return (
        f"a program of somebody else must run in a sandbox, but bubblewrap could not make one and said: {last!r}. "
        "Allow it namespaces (kernel.unprivileged_userns_clone=1 on Debian, an AppArmor profile for bwrap on Ubuntu), "
        "or say --trusted if you have read the programs."
    )
