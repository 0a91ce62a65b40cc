"""Runs commands on a Debian that is made from nothing in a folder, as root on Debian with debootstrap.

    python tools/debian_tree.py trixie make demo
    python tools/debian_tree.py trixie make test
    python tools/debian_tree.py --packages python3.15-venv,python3.15-dev,gcc,libc6-dev forky make interpreters

They start in a copy of the last commit. The packages come from where this system's come from. A new system takes about
two minutes, 0.4 GB for itself and 1 to 4 GB for what KiKS needs. It is deleted at the end, unless it has been given a
folder by `--keep`: there, a second command takes it as it is. Options stand before the suite.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEEDED = "ca-certificates,make,python3,python3-venv"
"""What a person must have to type README's first command; the command itself asks for the rest."""
SCRIPT = "/usr/share/debootstrap/scripts/sid"
"""How each Debian is made; debootstrap does not know the names of later ones."""
CERTIFICATES = "/etc/ssl/certs/ca-certificates.crt"
NETWORK = ("/etc/resolv.conf", "/etc/hosts", CERTIFICATES, "/etc/pip.conf", "/etc/xdg/pip")
"""How this system reaches the network and Python's packages."""
MOUNTS = (
    "mount --make-rprivate / && mount -t proc proc {tree}/proc && mount --rbind /dev {tree}/dev && "
    'exec chroot {tree} sh -c "cd /kiks && exec \\"\\$@\\"" sh "$@"'
)
"""Run in a name space of its own, these mounts end with the command, however it ends."""


def mirror() -> str:
    """Return the address that apt has for this Debian."""
    codename = platform.freedesktop_os_release()["VERSION_CODENAME"]
    words = ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages", f"Codename: {codename}"]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()[0]


def make_tree(tree: Path, suite: str, packages: str) -> None:
    """Install a Debian into an empty folder, with this commit in `/kiks`."""
    include = f"--include={','.join(filter(None, (NEEDED, packages)))}"
    made = subprocess.run(
        ["debootstrap", "--variant=minbase", include, suite, tree, mirror(), SCRIPT], capture_output=True, text=True
    )
    if made.returncode:
        sys.exit(f"debootstrap must install {suite} into {tree}, but said: {made.stdout[-500:]}{made.stderr[-500:]}")
    for name in filter(os.path.exists, NETWORK):
        copy = shutil.copytree if os.path.isdir(name) else shutil.copyfile
        target = tree / name.lstrip("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        copy(name, target)
    tree.chmod(0o755)  # other users, such as that of apt, must reach what is in it
    (tree / "kiks").mkdir()
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", tree / "kiks"], input=archive, check=True)


def run(tree: Path, command: list[str]) -> int:
    """Run a command in the tree's copy of KiKS; return its exit status."""
    environment = {"HOME": "/root", "LANG": "C.UTF-8", "PATH": "/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"}
    # uv trusts the system's certificates only if it is given them.
    environment["SSL_CERT_FILE"] = CERTIFICATES
    words = ["unshare", "--mount", "sh", "-c", MOUNTS.format(tree=tree), "sh", *command]
    return subprocess.run(words, env=environment, check=False).returncode


def main() -> None:
    """Make the tree, run the command, and say how long it took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("suite", help="name of a Debian, such as trixie")
    parser.add_argument("--packages", default="", help="what is installed beside Python and make, with commas")
    parser.add_argument("--keep", type=Path, help="the folder of the system, which stays")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="what is run, such as make demo")
    given = parser.parse_args()
    if os.geteuid() or not shutil.which("debootstrap"):
        sys.exit("A Debian must be made by root with debootstrap. Install that: apt-get install debootstrap.")
    tree = (given.keep or Path(tempfile.mkdtemp(prefix="kiks-debian-"))).absolute()
    try:
        if not (tree / "kiks").exists():
            make_tree(tree, given.suite, given.packages)
        began_s = time.monotonic()
        code = run(tree, given.command)
        print(f"{given.suite}: {' '.join(given.command)}: exit status {code} after {time.monotonic() - began_s:.0f} s")
    finally:
        if given.keep is None:
            shutil.rmtree(tree)
    sys.exit(code)


if __name__ == "__main__":
    main()
