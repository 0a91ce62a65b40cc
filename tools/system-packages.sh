#!/bin/sh
# What KiKS needs of the system: Python's venv module, and for the tests a C compiler (a robot is driven from C),
# bubblewrap (programs of others), Chromium and Firefox (the desk is used in real browsers), Octave (the toolbox) and a virtual screen (programs with
# windows): system-packages.sh [tests].
# As root on Debian this installs what is missing; otherwise it names it.
set -eu

python="${PYTHON:-python3}"
missing=""
if [ "${1:-}" = tests ]; then
    command -v gcc >/dev/null 2>&1 || missing="$missing gcc libc6-dev"
    command -v bwrap >/dev/null 2>&1 || missing="$missing bubblewrap"
    command -v chromium >/dev/null 2>&1 || missing="$missing chromium fonts-dejavu-core"
    command -v firefox-esr >/dev/null 2>&1 || command -v firefox >/dev/null 2>&1 || missing="$missing firefox-esr"
    command -v Xvfb >/dev/null 2>&1 || missing="$missing xvfb"
    "$python" -c 'import tkinter' >/dev/null 2>&1 || missing="$missing python3-tk"
    command -v octave-cli >/dev/null 2>&1 || missing="$missing octave"
    # The package lies in a folder that names Octave's programming interface: ask Debian.
    dpkg-query -W octave-instrument-control >/dev/null 2>&1 || missing="$missing octave-instrument-control"
else
    command -v "$python" >/dev/null 2>&1 || missing="$missing python3"
    "$python" -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 || missing="$missing python3-venv"
fi
[ -z "$missing" ] && exit 0

if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "Installing:$missing"
    apt-get update -qq
    # shellcheck disable=SC2086  # a list of words on purpose
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
else
    echo "KiKS needs these system packages: $missing"
    echo "On Debian or Ubuntu: sudo apt-get install$missing"
    [ "${1:-}" = tests ] || exit 1  # without them some tests are skipped, no more
fi
