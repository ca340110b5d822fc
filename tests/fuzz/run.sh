#!/bin/sh
# Lets one fuzzer run and says how many executions there were: run.sh SECONDS FUZZER. What it finds goes beside the
# build; the output of a fuzzer that failed is shown.
set -eu
seconds=$1 fuzzer=$2
name=$(basename "$fuzzer")
found=$(dirname "$fuzzer")/../found/$name
corpus=$(dirname "$0")/corpus/${name#fuzz_}
mkdir -p "$found"
if "$fuzzer" -max_total_time="$seconds" -print_final_stats=1 -artifact_prefix="$found/" "$found" "$corpus" >"$found.log" 2>&1; then
  echo "$name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$found.log") executions, nothing found"
else
  tail -n 60 "$found.log"
  echo "$name failed; what it failed on is in $found"
  exit 1
fi
