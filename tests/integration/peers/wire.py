"""Runs the program modbus_test_wire: a robot's endpoint on a wire, under a recorder."""
import contextlib
import subprocess
import time


@contextlib.contextmanager
def running(program, *arguments):
    """Yields the process. It must end well: its recorder has then seen no wrong valid result."""
    with subprocess.Popen([program, *map(str, arguments)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as wire:
        try:
            assert wire.stdout.readline() == "ready\n", "the wire did not start"
            yield wire
        finally:
            wire.stdin.close()
            wire.wait(timeout=10)
    assert wire.returncode == 0, f"the wire ended with {wire.returncode}"


def until(condition, what, patience_s=10):
    deadline = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline, f"never: {what}"
        time.sleep(0.002)
