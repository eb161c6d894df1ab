#!/bin/sh
# Builds .venv from nothing and, last of all, touches .venv/stamp, so that a stamp means a whole
# installation. `make venv` calls it; by hand: [PYTHON=/path/to/python3.12] sh .ci/venv.sh
set -eu
cd "$(dirname "$0")/.."

say() { printf '%s\n' "$*"; }
refuse() { printf '%s\n' "$*" >&2; exit 1; }

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
trap 'exit 130' INT TERM
if [ -z "${HOME:-}" ]; then
    HOME=$scratch
    export HOME
fi

# 1. A Python that taichi has wheels for. It is asked, not looked up by name: a version manager
#    may offer a name that does not run.
usable() {
    "$1" -c 'import sys; v = sys.version_info[:2]
sys.exit(not ((3, 11) <= v <= (3, 13) and sys.implementation.name == "cpython"))' >/dev/null 2>&1
}

find_python() {
    for name in python3 python3.13 python3.12 python3.11 python; do
        if usable "$name"; then
            say "$name"
            return
        fi
    done
}

if [ -n "${PYTHON:-}" ]; then
    python=$PYTHON
    usable "$python" || refuse "PYTHON=$python does not run or is not CPython 3.11 to 3.13."
else
    python=$(find_python)
    [ -n "$python" ] || refuse "No CPython 3.11 to 3.13 found (taichi 1.7.4 has wheels for these" \
        "only): install one, or name one with make venv PYTHON=/path/to/python3.12."
fi
version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
say "Taking Python $version ($(command -v "$python"))."

# 2. What Python and taichi need from the system.
has_venv() { "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; }
has_x11() {
    [ "$(uname -s)" != Linux ] ||
        "$python" -c 'import ctypes; ctypes.CDLL("libX11.so.6")' >/dev/null 2>&1
}
missing() {
    has_venv || say "python$version-venv"
    has_x11 || say libx11-6
}

apt_install() {
    export DEBIAN_FRONTEND=noninteractive
    {
        apt-get update && apt-get install -y --no-install-recommends "$@"
    } >"$scratch/apt.log" 2>&1 || {
        cat "$scratch/apt.log" >&2
        refuse "apt-get could not install $* (see above)."
    }
}

packages=$(missing | tr '\n' ' ')
if [ -n "$packages" ]; then
    if ! command -v apt-get >/dev/null 2>&1; then
        refuse "Install with your package manager what is missing here, in Debian's names: $packages"
    elif [ "$(id -u)" != 0 ]; then
        refuse "Missing here; type: sudo apt-get install $packages"
    fi
    say "Installing with apt-get what is missing: $packages"
    # shellcheck disable=SC2086 # several words on purpose
    apt_install $packages
    packages=$(missing | tr '\n' ' ')
    [ -z "$packages" ] || refuse "Still missing for $python after apt-get: $packages"
fi

# 3. The environment. What a link leads to may be in use elsewhere, and --clear would empty it.
if [ -L .venv ]; then
    refuse ".venv is a link to $(readlink .venv) and older than requirements.txt: remove the link, or" \
        "bring what it leads to up to date and type touch .venv/stamp"
fi
say "Setting up .venv: about 140 MB to download, usually less than a minute."
"$python" -m venv --clear .venv
bin=.venv/bin
[ -d "$bin" ] || bin=.venv/Scripts
"$bin/python" -m pip install --quiet --disable-pip-version-check -r requirements.txt ||
    refuse "pip could not install requirements.txt (see above). taichi 1.7.4 has wheels for Linux" \
        "on x86-64, macOS on arm64 and Windows on x86-64. Run make venv again once this is mended."
mkdir -p "$HOME"
ENABLE_TAICHI_HEADER_PRINT=0 "$bin/python" -c 'import taichi' ||
    refuse "taichi is installed but does not start (see above); on Linux it needs glibc 2.34 or newer."
touch .venv/stamp
say ".venv is ready."
