#!/usr/bin/env python3
"""A Modbus TCP session on a loopback of its own, captured, and decoded by tshark alone: reads, a measurement, its
acknowledgement, and what is refused. Compared with a golden file; what differs in every session (sequence, epoch, age,
CRC of the block) is masked there.
"""
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

from block import ACKNOWLEDGE, BUSY, EXPOSED, MEASURE, NOT_OK, VALID, Block, command
from server import arguments, running
from tshark import compare, need, skip, tshark

PATIENCE_S = 20
UNIT, READ_HOLDING, READ_INPUT, WRITE_ONE, WRITE = 1, 3, 4, 6, 16
MASKED = {2: "sequence", 3: "epoch", 4: "epoch", 32: "age", 58: "crc", 59: "crc", 60: "sequence"}
PROBE = ("127.0.0.1", 9)  # the capture has begun, and has all, when it has what was sent here
FIELDS = ["tcp.dstport", "mbtcp.trans_id", "mbtcp.prot_id", "mbtcp.len", "mbtcp.unit_id", "modbus.func_code",
          "modbus.reference_num", "modbus.word_cnt", "modbus.byte_cnt", "modbus.exception_code", "modbus.regnum16",
          "modbus.regval_uint16"]


def enter_private_network():
    """Starts this program again in a network namespace of its own, unless it is there."""
    if os.environ.get("PRIVATE_NETWORK"):
        return
    enter = ["unshare", "--net"] + ([] if os.geteuid() == 0 else ["--user", "--map-root-user"])
    if not shutil.which("ip") or subprocess.run([*enter, "ip", "link", "set", "lo", "up"], check=False).returncode:
        skip("no private network: `unshare --net ip link set lo up` fails")
    os.environ["PRIVATE_NETWORK"] = "1"
    os.execvp("unshare", [*enter, "sh", "-c", 'ip link set lo up && exec "$@"', "sh", sys.executable, *sys.argv])


class Capture:
    def __init__(self, path, port):
        self.path = path
        self.process = subprocess.Popen(["dumpcap", "-q", "-i", "lo", "-f", f"tcp port {port} or udp port {PROBE[1]}",
                                         "-w", path], stderr=subprocess.PIPE, text=True)
        self.wait_for_probe(b"the capture begins")

    def wait_for_probe(self, text):
        until = time.monotonic() + PATIENCE_S
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            while not (os.path.exists(self.path) and text in open(self.path, "rb").read()):
                assert self.process.poll() is None, f"dumpcap has ended: {self.process.stderr.read()}"
                assert time.monotonic() < until, "dumpcap captures nothing"
                probe.sendto(text, PROBE)
                time.sleep(0.05)

    def finish(self):
        self.wait_for_probe(b"the capture ends")
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=PATIENCE_S)


class Robot:
    """All requests of one step have the step's number as their transaction."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        self.step = 0x0100

    def close(self):
        self.socket.close()

    def receive(self, size):
        data = b""
        while len(data) < size:
            part = self.socket.recv(size - len(data))
            assert part, "the server has closed"
            data += part
        return data

    def ask(self, function, *words, data=b""):
        """The answer's function code and what follows it."""
        pdu = struct.pack(f">B{len(words)}H", function, *words) + data
        self.socket.sendall(struct.pack(">HHHB", self.step, 0, len(pdu) + 1, UNIT) + pdu)
        step, _, length, _ = struct.unpack(">HHHB", self.receive(7))
        assert step == self.step, step
        answer = self.receive(length - 1)
        return answer[0], answer[1:]

    def next(self):
        self.step += 1

    def refused(self, code, function, *words, data=b""):
        self.next()
        assert self.ask(function, *words, data=data) == (function | 0x80, bytes([code]))

    def block(self, function=READ_INPUT):
        answered, body = self.ask(function, 0, 61)
        assert answered == function
        block = Block(struct.unpack(">61H", body[1:]))
        block.check_form()
        return block

    def read(self, function=READ_INPUT):
        self.next()
        return self.block(function)

    def wait_for(self, status):
        """A step of its own: reads until the status has all these bits."""
        self.next()
        until = time.monotonic() + PATIENCE_S
        while not self.block().has(status):
            assert time.monotonic() < until, "no answer"

    def write(self, registers):
        self.next()
        assert self.ask(*written(registers)[:3], data=written(registers)[3])[0] == WRITE


def written(registers):
    """Function, address, count and bytes of the command block."""
    return WRITE, 1000, len(registers), struct.pack(f">B{len(registers)}H", 2 * len(registers), *registers)


def play(port):
    robot = Robot(port)
    assert robot.read().request_id == 0
    robot.read(READ_HOLDING)
    robot.write(command(0x00010001, MEASURE, job=1, part=0x01020304, argument=-5))
    second = written(command(0x00010002, MEASURE, job=1))
    robot.refused(6, *second[:3], data=second[3])
    robot.wait_for(BUSY)
    robot.wait_for(BUSY | EXPOSED)
    robot.wait_for(VALID)
    robot.write(command(0x00010001, ACKNOWLEDGE))
    assert not robot.read().has(VALID)
    robot.refused(1, WRITE_ONE, 1000, 1)
    robot.refused(2, READ_INPUT, 14, 16)
    wrong = command(0x00010003, MEASURE, job=1)
    wrong[9] ^= 1
    robot.refused(3, *written(wrong)[:3], data=written(wrong)[3])
    robot.write(command(0x00010004, MEASURE, job=2))
    robot.wait_for(NOT_OK)
    robot.write(command(0x00010004, ACKNOWLEDGE))
    robot.read()
    robot.close()


def registers_text(numbers, values, answers_read):
    """The registers as hexadecimal words, by the numbers that the decoder gives them."""
    pairs = zip(numbers.split(","), values.split(","))
    return " ".join(f"{n}={MASKED[int(n)]}" if answers_read and int(n) in MASKED else f"{n}={int(v):04X}"
                    for n, v in pairs)


def decoded(path, port):
    """Two lines for each step: the last request and the last answer, since how often a robot polls is up to chance."""
    fields = [option for field in FIELDS for option in ("-e", field)]
    text = tshark(path, "-o", f"mbtcp.tcp.port:{port}", "-Y", "mbtcp", "-T", "fields", "-E", "occurrence=a", "-E",
                  "aggregator=,", *fields)
    steps = {}
    for line in text.splitlines():
        to, step, protocol, length, unit, function, first, words, size, exception, numbers, values = line.split("\t")
        asked = to == str(port)
        parts = [f"transaction {int(step):#06x} protocol {protocol} length {length} unit {unit} function {function}"]
        parts += [f"{name} {value}" for name, value in
                  (("reference", first), ("words", words), ("bytes", size), ("exception", exception)) if value]
        if numbers:
            parts.append(registers_text(numbers, values, not asked and function in ("3", "4")))
        steps.setdefault(int(step), {})["asked" if asked else "answered"] = " ".join(parts)
    return [f"{way:8} {steps[step][way]}" for step in sorted(steps) for way in ("asked", "answered")]


def main():
    parser = arguments(__doc__)
    parser.add_argument("--golden", required=True)
    parser.add_argument("--update", action="store_true", help="write the golden file anew")
    options = parser.parse_args()
    need("tshark", "dumpcap")
    enter_private_network()
    with tempfile.TemporaryDirectory() as directory, running(options) as port:
        path = os.path.join(directory, "session.pcapng")
        capture = Capture(path, port)
        play(port)
        capture.finish()
        seen = decoded(path, port)
        damaged = tshark(path, "-o", f"mbtcp.tcp.port:{port}", "-Y", "_ws.malformed or (tcp.len > 0 and not modbus)")
    assert not damaged, f"not Modbus for the decoder:\n{damaged}"
    compare(seen, options.golden, options.update)
    print(f"tshark: {len(seen)} requests and answers decoded as expected")


if __name__ == "__main__":
    main()
