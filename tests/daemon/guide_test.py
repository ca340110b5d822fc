#!/usr/bin/env python3
"""Runs every command of a guide, in its order, against the simulated cell: the shell blocks of the page are one script.
Usage: guide_test.py BIN_DIR SOURCE_DIR PAGE; exit status 77 where no private network can be made."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ADDRESSES = [f"127.0.0.{last}" for last in (11, 12, 13, 14)]
TIME_S = 420


def enter_private_network():
    """Begins this program anew inside a network of its own, where the cameras' addresses are free."""
    if os.environ.get("ZEROPOSE_PRIVATE_NETWORK"):
        return
    command = ["unshare", "--net"] if os.geteuid() == 0 else ["unshare", "--net", "--map-root-user"]
    if subprocess.run(command + ["true"], check=False).returncode != 0:
        print("skipped: no private network can be made here")
        sys.exit(77)
    os.environ["ZEROPOSE_PRIVATE_NETWORK"] = "1"
    os.execvp(command[0], command + [sys.executable] + sys.argv)


def script_of(page):
    blocks = re.findall(r"^```sh\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 5, "the guide has lost its commands"
    # Bash does not end at a command that begins with "!": here it must have failed.
    lines = re.sub(r"^! ((?:[^\n]*\\\n)*[^\n]*)", r"if \1; then echo 'must have failed'; exit 1; fi", "".join(blocks), flags=re.MULTILINE)
    return "set -eux -o pipefail\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n" + lines


def main():
    bin_dir, source, page = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    enter_private_network()
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    for address in ADDRESSES:
        subprocess.run(["ip", "addr", "add", address + "/8", "dev", "lo"], check=True)
    with tempfile.TemporaryDirectory() as folder:
        for file in (source / "config/cells").glob("car-body*"):
            shutil.copy(file, folder)
        environment = dict(os.environ, PATH=f"{bin_dir}:{os.environ['PATH']}")
        done = subprocess.run(["bash", "-c", script_of(page.read_text())], cwd=folder, env=environment, timeout=TIME_S, check=False)
    sys.exit(done.returncode)


main()
