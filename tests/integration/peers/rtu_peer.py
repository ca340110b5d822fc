#!/usr/bin/env python3
"""pymodbus and mbpoll as masters of a serial line (a pair of pseudo terminals of socat), with noise, half frames,
other units, broadcasts, a stopped daemon and a lost device. After each of these a clean cycle must follow."""
import argparse
import contextlib
import logging
import os
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from block import BUSY, MEASURE, SKIPPED, VALID, Block, command
from wire import running, until

try:
    from pymodbus.client import ModbusSerialClient
except ImportError as missing:
    print(f"skipped: pymodbus is not here ({missing}); apt-get install python3-pymodbus python3-serial-asyncio")
    sys.exit(SKIPPED)

from modbus_peer import Peer, refusals, whole_handshake

UNIT, BAUD = 17, 19200
EXPECTED = argparse.Namespace(job=1, correction=[12345, -6789, 1, 302500, -5678, 1234], within=[0, 0], server=None)


def frame(unit, pdu):
    crc = 0xFFFF
    for byte in bytes([unit]) + pdu:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return bytes([unit]) + pdu + struct.pack("<H", crc)


def write_pdu(address, registers):
    return struct.pack(">BHHB", 16, address, len(registers), 2 * len(registers)) + struct.pack(
        f">{len(registers)}H", *registers)


class Line:
    """The daemon's end A and the masters' end B."""

    def __init__(self, directory):
        self.a, self.b = os.path.join(directory, "A"), os.path.join(directory, "B")
        self.plug_in()

    def plug_in(self):
        self.socat = subprocess.Popen(["socat", f"pty,rawer,link={self.a}", f"pty,rawer,link={self.b}"])
        until(lambda: os.path.exists(self.a) and os.path.exists(self.b), "socat")

    def unplug(self):
        self.socat.terminate()
        self.socat.wait()
        until(lambda: not os.path.exists(self.a), "the device is gone")


class SerialPeer(Peer):
    def __init__(self, device):
        self.client = ModbusSerialClient(device, baudrate=BAUD, parity="N", timeout=1, retries=0)
        assert self.client.connect(), f"cannot open {device}"
        self.unit = UNIT
        self.next_id = random.randrange(1, 1 << 31)
        self.checks = 0

    def raw(self, *parts, wait_s=0.05):
        """Sends each part after a silence, and what comes back within a time in which an answer would have come."""
        serial = self.client.socket
        serial.reset_input_buffer()
        for part in parts:
            serial.write(part)
            time.sleep(wait_s)
        return serial.read(serial.in_waiting)

    def measure_frame(self, unit=UNIT):
        self.next_id += 1
        return frame(unit, write_pdu(1000, command(self.next_id, MEASURE, job=1)))


def expect_ignored(peer, what, *parts):
    before = peer.block()
    assert peer.raw(*parts) == b"", what
    after = peer.block()
    assert vars(after) == vars(before), what
    peer.checks += 1


def disturbances(peer):
    for cut in (1, 3, 8, 20, 28):
        half = peer.measure_frame()
        expect_ignored(peer, f"half a frame ({cut} bytes)", half[:cut])
        expect_ignored(peer, f"half a frame and its late rest ({cut} bytes)", half[:cut], half[cut:])
    whole_handshake(peer, EXPECTED)
    good = peer.measure_frame()
    expect_ignored(peer, "noise right before", b"\x00\xff" + good)
    expect_ignored(peer, "noise right after", good + b"\x55")
    expect_ignored(peer, "noise within", good[:9] + b"\x55" + good[9:])
    expect_ignored(peer, "wrong CRC", good[:-1] + bytes([good[-1] ^ 1]))
    expect_ignored(peer, "two frames without a silence", good + good)
    expect_ignored(peer, "300 bytes", bytes(range(256)) + bytes(44))
    whole_handshake(peer, EXPECTED)
    for unit in (1, 16, 18, 247, 0):
        expect_ignored(peer, f"unit {unit}", peer.measure_frame(unit))
    expect_ignored(peer, "another unit's answer", frame(3, b"\x04\x02\x00\x01"))
    expect_ignored(peer, "an exception with our unit", frame(UNIT, b"\x84\x02"))
    whole_handshake(peer, EXPECTED)
    noise = random.Random(5)
    for _ in range(50):
        expect_ignored(peer, "random noise", noise.randbytes(noise.randrange(1, 60)))
    whole_handshake(peer, EXPECTED)


def late_answer(peer, wire):
    """The daemon stands still for longer than its answer may take; the request waits in the line meanwhile."""
    os.kill(wire.pid, signal.SIGSTOP)
    until(lambda: stopped(wire.pid), "the daemon stands still")
    serial = peer.client.socket
    serial.write(frame(UNIT, struct.pack(">BHH", 4, 0, 61)))
    time.sleep(0.8)
    os.kill(wire.pid, signal.SIGCONT)
    time.sleep(0.3)
    assert serial.in_waiting == 0, "a late answer"
    whole_handshake(peer, EXPECTED)


def stopped(pid):
    """All threads of a process stand still."""
    states = [Path(f"/proc/{pid}/task/{task}/stat").read_text().rsplit(")", 1)[1].split()[0]
              for task in os.listdir(f"/proc/{pid}/task")]
    return all(state in "Tt" for state in states)


def lost_device(line, wire_peer):
    request_id, refused = wire_peer.send(MEASURE, job=1)
    assert refused == 0
    before, _ = wire_peer.wait(request_id)
    assert before.has(VALID)
    wire_peer.client.close()
    line.unplug()
    line.plug_in()
    peer = SerialPeer(line.b)

    def answers():
        reply = peer.client.read_input_registers(0, 61, slave=UNIT)
        return not reply.isError() and Block(reply.registers).epoch != before.epoch

    until(answers, "the device is opened again, with a new epoch")
    assert not peer.block().has(VALID)
    whole_handshake(peer, EXPECTED)
    return peer


def mbpoll(line, *more):
    call = ["mbpoll", "-m", "rtu", "-b", str(BAUD), "-P", "none", "-a", str(UNIT), "-0", "-1"]
    return subprocess.run([*call, *more], capture_output=True, text=True, timeout=20, check=False)


def mbpoll_reads_and_writes(line):
    def read(kind):
        answer = mbpoll(line, "-r", "0", "-c", "61", "-t", kind, line.b)
        assert answer.returncode == 0, answer.stdout + answer.stderr
        values = re.findall(r"^\[\d+\]:\s+(\d+)", answer.stdout, re.MULTILINE)
        return Block([int(value) & 0xFFFF for value in values])

    assert read("3").epoch == read("4").epoch != 0
    partial = mbpoll(line, "-r", "14", "-c", "16", "-t", "3", line.b)
    assert "Illegal data address" in partial.stdout + partial.stderr, partial
    coils = mbpoll(line, "-r", "0", "-c", "8", "-t", "0", line.b)
    assert "Illegal function" in coils.stdout + coils.stderr, coils
    values = [str(value) for value in command(4711, MEASURE, job=1)]
    written = mbpoll(line, "-r", "1000", "-t", "4", line.b, "--", *values)
    assert "Written 10 references" in written.stdout, written
    until(lambda: not read("3").has(BUSY), "an answer")
    assert read("3").request_id in (4711, 0)  # 0: it took longer than the validity


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wire", required=True, help="the program modbus_test_wire")
    options = parser.parse_args()
    for tool in ("socat", "mbpoll"):
        if not shutil.which(tool):
            print(f"skipped: {tool} is not here; apt-get install {tool}")
            sys.exit(SKIPPED)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    random.seed(11)
    with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
        line = Line(directory)
        stack.callback(lambda: line.socat.poll() is None and line.socat.terminate())
        wire = stack.enter_context(running(options.wire, "rtu", line.a, UNIT))
        peer = SerialPeer(line.b)
        whole_handshake(peer, EXPECTED)
        refusals(peer, 1)
        disturbances(peer)
        late_answer(peer, wire)
        checks = peer.checks
        peer = lost_device(line, peer)
        peer.client.close()
        mbpoll_reads_and_writes(line)
        peer = SerialPeer(line.b)
        whole_handshake(peer, EXPECTED)
        print(f"pymodbus and mbpoll on a serial line: {checks + peer.checks} blocks and answers checked")
        peer.client.close()


if __name__ == "__main__":
    main()
