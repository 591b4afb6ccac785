#!/bin/sh
# Installs Debian packages that tests need and that are missing: tools/debian.sh PROGRAM=PACKAGE...
# Only as root where there is apt-get; elsewhere it says so, and the tests are skipped.
set -eu
missing=
for pair in "$@"; do
    command -v "${pair%%=*}" >/dev/null || missing="$missing ${pair#*=}"
done
[ -n "$missing" ] || exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "debian: installing$missing" >&2
    # shellcheck disable=SC2086 # one word for each package
    if apt-get -qq update && DEBIAN_FRONTEND=noninteractive \
        apt-get -qq install --yes --no-install-recommends $missing >/dev/null; then
        exit 0
    fi
fi
echo "debian: not installed:$missing: the tests that need it are skipped" >&2
