#!/usr/bin/env python3
"""mbpoll reads the block, and writes a command: another Modbus implementation on the other side."""
import re
import shutil
import subprocess
import sys
import time

from block import BUSY, MEASURE, NOT_OK, SKIPPED, VALID, Block, command
from server import arguments, running


def mbpoll(options, port, *more):
    # By default it waits for an answer for 1 s, which a busy machine may need.
    call = ["mbpoll", "-m", "tcp", "-p", str(port), "-a", str(options.unit), "-o", "8", "-0", "-1", *more]
    return subprocess.run(call, capture_output=True, text=True, timeout=20, check=False)


def read_block(options, port, kind):
    answer = mbpoll(options, port, "-r", "0", "-c", "61", "-t", kind, options.host)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    pairs = re.findall(r"^\[(\d+)\]:\s+(\d+)", answer.stdout, re.MULTILINE)
    assert [int(at) for at, _ in pairs] == list(range(61)), answer.stdout
    block = Block([int(value) & 0xFFFF for _, value in pairs])
    block.check_form()
    return block


def mirrors_hold(options, port):
    """Holding registers mirror input registers. A camera that is lost for a moment changes the block in between."""
    for _ in range(5):
        first, mirror, last = (vars(read_block(options, port, kind)) for kind in "343")
        if first == last:
            assert mirror == first, (mirror, first)
            return
    raise AssertionError("the block did not stay as it is for two reads")


def main():
    options = arguments(__doc__).parse_args()
    if not shutil.which("mbpoll"):
        print("skipped: mbpoll is not here; apt-get install mbpoll")
        sys.exit(SKIPPED)
    with running(options) as port:
        before = read_block(options, port, "3")
        assert before.epoch != 0 and not before.status & (VALID | NOT_OK | BUSY)
        mirrors_hold(options, port)
        partial = mbpoll(options, port, "-r", "14", "-c", "16", "-t", "3", options.host)
        assert "Illegal data address" in partial.stdout + partial.stderr, partial
        registers = [str(value) for value in command(4711, MEASURE, job=1)]
        written = mbpoll(options, port, "-r", "1000", "-t", "4", options.host, "--", *registers)
        assert "Written 10 references" in written.stdout, written
        # mbpoll closed its connection, and so gave up the result.
        until = time.monotonic() + 5
        while read_block(options, port, "3").has(BUSY):
            assert time.monotonic() < until
        after = read_block(options, port, "3")
        assert after.epoch != before.epoch and after.request_id == 0 and not after.has(VALID)
        print(f"mbpoll: block of epoch {after.epoch:#x} read and checked")


if __name__ == "__main__":
    main()
