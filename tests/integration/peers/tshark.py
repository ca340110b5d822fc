"""tshark as a decoder that knows nothing of this house: what is common to its tests."""
import os
import shutil
import subprocess
import sys

from block import SKIPPED


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(SKIPPED)


def need(*programs):
    for program in programs:
        if not shutil.which(program):
            skip(f"{program} is not here; apt-get install tshark")


def tshark(path, *options):
    """What it prints about a capture file, whatever the user's own preferences. Raises CalledProcessError when it
    cannot read it.
    """
    without_preferences = {**os.environ, "WIRESHARK_CONFIG_DIR": "/nonexistent"}
    return subprocess.run(["tshark", "-n", "-r", path, *options], check=True, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, env=without_preferences).stdout


def compare(seen, golden_path, update):
    """Raises AssertionError at the first line that differs; with update the file is written anew instead."""
    if update:
        with open(golden_path, "w") as golden:
            golden.write("\n".join(seen) + "\n")
        return
    with open(golden_path) as golden:
        expected = golden.read().splitlines()
    for number, (line, wanted) in enumerate(zip(seen, expected), 1):
        assert line == wanted, f"{golden_path}:{number}\nexpected {wanted}\nseen     {line}"
    assert len(seen) == len(expected), f"{golden_path} has {len(expected)} lines, seen were {len(seen)}"
