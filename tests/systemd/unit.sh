#!/usr/bin/env bash
# The unit is valid without a word on stderr, and its sandbox scores 2.0 or better.
set -eu
unit=$(mktemp -d)/zeroposed.service
trap 'rm -r "$(dirname "$unit")"' EXIT
# verify wants the program to exist: stand in for the installed one.
sed 's#^ExecStart=/usr/bin/zeroposed#ExecStart=/bin/true#' "$1" > "$unit"
complaints=$(systemd-analyze verify --man=no "$unit" 2>&1 >/dev/null)
[ -z "$complaints" ] || { echo "systemd-analyze verify says: $complaints"; exit 1; }
systemd-analyze security --offline=true --no-pager --threshold=20 "$unit" | tail -1
