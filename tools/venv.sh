#!/bin/sh
# Sets up .venv in the checkout, with the console command `ghst`. Run by `make .venv`.
set -eu
cd "$(dirname "$0")/.."

fail() {
    echo "venv: $*" >&2
    exit 1
}

python=
for name in ${PYTHON:-python3.11 python3.12 python3.13 python3}; do
    if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
        python=$name
        break
    fi
done
[ -n "$python" ] || fail "Python 3.11 or later is needed: install it, or name it with PYTHON=..."

# Debian splits the part of Python that makes virtual environments into a package of its own.
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "venv: installing $package" >&2
        apt-get -qq update && DEBIAN_FRONTEND=noninteractive \
            apt-get -qq install --yes --no-install-recommends "$package" >/dev/null ||
            fail "apt-get could not install $package"
    else
        fail "$python cannot make virtual environments: install the package $package"
    fi
fi

# The scripts inside name their interpreter by its full path: a checkout that moved starts afresh.
stamp=.venv/.complete
if [ "$(cat .venv/.made-in 2>/dev/null)" != "$PWD" ] || ! .venv/bin/python -c '' 2>/dev/null; then
    echo "venv: making .venv with $("$python" --version)" >&2
    "$python" -m venv --clear .venv || fail "$python -m venv failed"
    echo "$PWD" > .venv/.made-in
fi
echo "venv: installing the packages of tools/constraints.txt" >&2
.venv/bin/python -m pip install --quiet --disable-pip-version-check \
    -c tools/constraints.txt -e '.[board,test]' || fail "pip could not install the packages"
.venv/bin/python tools/compile_emulator.py
touch "$stamp"
