#!/usr/bin/env bash
# The unit is valid without a word on stderr, and its sandbox scores 2.0 or better; so it does with the drop-in for
# devices.
set -eu
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
judge() {
  complaints=$(systemd-analyze verify --man=no "$folder/zeroposed.service" 2>&1 >/dev/null)
  [ -z "$complaints" ] || { echo "systemd-analyze verify says: $complaints"; exit 1; }
  systemd-analyze security --offline=true --no-pager --threshold=20 "$folder/zeroposed.service" | tail -1
}
# verify wants the program to exist: stand in for the installed one.
sed 's#^ExecStart=/usr/bin/zeroposed#ExecStart=/bin/true#' "$1" > "$folder/zeroposed.service"
judge
sed 's/^PrivateDevices=yes$//' "$folder/zeroposed.service" > "$folder/with-devices"
sed '1,/^\[Service\]$/d' "$(dirname "$1")/devices.conf" > "$folder/added"
awk -v added="$folder/added" '/^\[Install\]$/ { while ((getline line < added) > 0) print line } { print }' \
  "$folder/with-devices" > "$folder/zeroposed.service"
judge
