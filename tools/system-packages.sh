#!/bin/sh
# What KiKS needs of the system: Python's venv module, and a C compiler for the test that drives a robot from C.
# As root on Debian this installs what is missing; otherwise it names it.
set -eu

python="${PYTHON:-python3}"
missing=""
command -v "$python" >/dev/null 2>&1 || missing="$missing python3"
"$python" -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 || missing="$missing python3-venv"
command -v gcc >/dev/null 2>&1 || missing="$missing gcc libc6-dev"
[ -z "$missing" ] && exit 0

if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "Installing:$missing"
    apt-get update -qq
    # shellcheck disable=SC2086  # a list of words on purpose
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
else
    echo "KiKS needs these system packages: $missing"
    echo "On Debian or Ubuntu: sudo apt-get install$missing"
    case "$missing" in *python3*) exit 1 ;; esac  # without a compiler one test is skipped, no more
fi
