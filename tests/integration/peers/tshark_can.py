#!/usr/bin/env python3
"""The CAN session as Wireshark's CANopen decoder names it.

The frames are those of the session's golden file, which the node is held to on a real kernel (tests/guest), so no bus
is needed here. The bytes that differ in each session (X there: CRC and epoch) are zeros here.
"""
import argparse
import os
import tempfile

from tshark import compare, need, tshark


def candump_log(session_path):
    """As `candump -L` writes it; the times are made up."""
    with open(session_path) as session:
        frames = session.read().replace("X", "0").split()
    return "".join(f"({1700000000 + i // 100}.{i % 100:02}0000) can0 {frame}\n" for i, frame in enumerate(frames))


def decoded(log_path):
    """One line for each frame: its identifier, then the decoder's words without the single bits."""
    lines = []
    for line in tshark(log_path, "-d", "can.subdissector,canopen", "-V").splitlines():
        text = line.strip()
        if text.startswith("Controller Area Network"):
            lines.append(text.split("(")[1].split(")")[0])
            inside = False
        elif text == "CANopen":
            inside = True
        elif not text or line.startswith("Frame "):
            inside = False
        elif lines and inside and " = " not in text and not text.startswith("COB-ID"):
            lines[-1] += "; " + text
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--session", required=True, help="the frames that candump saw")
    parser.add_argument("--golden", required=True)
    parser.add_argument("--update", action="store_true", help="write the golden file anew")
    options = parser.parse_args()
    need("tshark")
    log = candump_log(options.session)
    with tempfile.TemporaryDirectory() as directory:
        path = os.path.join(directory, "session.log")
        with open(path, "w") as file:
            file.write(log)
        seen = decoded(path)
        damaged = tshark(path, "-d", "can.subdissector,canopen", "-Y", "_ws.malformed or not canopen")
    assert not damaged, f"not CANopen for the decoder:\n{damaged}"
    assert len(seen) == len(log.splitlines()), "a frame is missing"
    compare(seen, options.golden, options.update)
    print(f"tshark: {len(seen)} frames decoded as expected")


if __name__ == "__main__":
    main()
