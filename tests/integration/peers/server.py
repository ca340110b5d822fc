"""Starts the test server of tests/protocol, or takes one that runs already."""
import argparse
import contextlib
import subprocess


def arguments(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--server", help="start this program; it prints 'port N' and ends with its input")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=1502)
    parser.add_argument("--unit", type=int, default=1)
    return parser


@contextlib.contextmanager
def running(options):
    """Yields the port."""
    if not options.server:
        yield options.port
        return
    with subprocess.Popen([options.server], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield int(server.stdout.readline().split()[1])
        finally:
            server.stdin.close()
            server.wait(timeout=10)
    assert server.returncode == 0, f"the server ended with {server.returncode}"
