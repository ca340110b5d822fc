#!/usr/bin/env python3
"""A robot on a CAN bus made of python-can alone: unpacks every frame and the CRC itself, plays the handshake, and does
what must not count. Needs a bus: tests/guest runs it with the kernel's vcan. With --golden the first session's frames,
as candump saw them, are compared with that file.
"""
import argparse
import os
import re
import struct
import subprocess
import sys
import time

from block import ACKNOWLEDGE, MEASURE, RESET, SKIPPED, ZERO, crc32_autosar

try:
    import can
except ImportError as missing:
    print(f"skipped: python-can is not here ({missing}); apt-get install python3-can")
    sys.exit(SKIPPED)

NODE = 5
VALID, NOT_OK, BUSY, ERROR, SIMULATED, ATTENTION = (1 << i for i in range(6))
INVALID = -0x8000
PATIENCE_S = 20  # an emulated computer is slow
# The server's correction in KUKA's order, in steps of 10 um and 0.001 deg.
STEPS = [1235, -679, 0, 30250, -568, 123]


class Server:
    def __init__(self, program, interface, *options):
        self.process = subprocess.Popen([program, interface, *options], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def counters(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        words = self.process.stdout.readline().split()
        return {name: int(number) for name, number in zip(words[::2], words[1::2])}

    def wait_for(self, name, least):
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            counters = self.counters()
            if counters[name] >= least:
                return counters
            time.sleep(0.05)
        raise AssertionError(f"{name} stays below {least}: {counters}")

    def stop(self):
        self.process.stdin.close()
        assert self.process.wait(timeout=PATIENCE_S) == 0, "the server saw a wrong result, or ended badly"


class Robot:
    def __init__(self, interface, fd=False):
        self.interface = interface
        self.bus = can.Bus(interface="socketcan", channel=interface, fd=fd)
        self.parts = {}
        self.epoch = None
        self.last_id = 0

    def close(self):
        self.bus.shutdown()

    def send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def frames(self, patience_s=PATIENCE_S):
        until = time.monotonic() + patience_s
        while (rest := until - time.monotonic()) > 0:
            message = self.bus.recv(rest)
            if message is not None and not message.is_error_frame:
                yield message

    def drain(self):
        """What others sent has filled our socket's buffer: a full one would lose the next answer."""
        while self.bus.recv(0.2) is not None:
            pass
        self.parts = {}

    def wait_frame(self, identifier, fits=lambda data: True):
        for message in self.frames():
            if message.arbitration_id == identifier and fits(bytes(message.data)):
                return bytes(message.data)
        raise AssertionError(f"no frame {identifier:03X} of that kind")

    def sdo(self, request):
        self.send(0x600 + NODE, request)
        answer = self.wait_frame(0x580 + NODE, lambda data: data[1:4] == request[1:4])
        assert len(answer) == 8
        return answer

    def read(self, index, sub=0):
        answer = self.sdo(struct.pack("<BHBI", 0x40, index, sub, 0))
        size = {0x4F: 1, 0x4B: 2, 0x43: 4}[answer[0]]
        return int.from_bytes(answer[4:4 + size], "little")

    def aborted(self, request):
        answer = self.sdo(request)
        assert answer[0] == 0x80, answer.hex()
        return int.from_bytes(answer[4:], "little")

    def command(self, kind, request_id, job=1, part=77):
        self.send(0x200 + NODE, struct.pack("<HBBI", request_id, kind, job, part))

    def commit(self, message, epoch):
        """(request id, status, code, values) when this frame ends three that belong together."""
        base = message.arbitration_id - NODE
        if base not in (0x180, 0x280, 0x380) or message.is_extended_id or message.is_remote_frame:
            return None
        data = bytes(message.data)
        if base != 0x380:
            self.parts[base] = (data, message.timestamp)
            return None
        if len(self.parts) < 2:
            return None
        first, at = self.parts[0x180]
        second, _ = self.parts[0x280]
        self.parts = {}
        if len({first[:2], second[:2], data[:2]}) != 1 or message.timestamp - at > 0.05:
            return None
        covered = struct.pack("<H", 0x5A50) + first + second + data[:4] + struct.pack("<I", epoch)
        if crc32_autosar(covered) != int.from_bytes(data[4:], "little"):
            return None
        request_id, word = struct.unpack("<HH", data[:4])
        return request_id, word >> 10, word & 0x3FF, list(struct.unpack("<3h", first[2:]) +
                                                          struct.unpack("<3h", second[2:]))

    def wait_commit(self, request_id, fits=lambda status: not status & BUSY):
        for message in self.frames():
            answer = self.commit(message, self.epoch)
            if answer and answer[0] == request_id and fits(answer[1]):
                if not answer[1] & VALID:
                    assert answer[3] == [INVALID] * 6, answer
                return answer
        raise AssertionError(f"no answer to {request_id}")

    def next_id(self):
        self.last_id += 1
        return self.last_id

    def measure(self, job=1):
        self.epoch = self.read(0x2001, 1)
        request_id = self.next_id()
        self.command(MEASURE, request_id, job)
        return request_id

    def acknowledge(self, request_id):
        self.command(ACKNOWLEDGE, request_id, 0, 0)
        assert self.wait_commit(0)[1:3] == (SIMULATED, 0)

    def clean_cycle(self):
        request_id = self.measure()
        answer = self.wait_commit(request_id)
        assert answer == (request_id, VALID | SIMULATED, 0, STEPS), answer
        self.acknowledge(request_id)

    def emergency(self, error):
        return self.wait_frame(0x080 + NODE, lambda data: data[:2] == struct.pack("<H", error))


def run(*command):
    subprocess.run(command, check=True)


def session(robot):
    """What the golden file shows: nothing in it is left to chance but the epoch."""
    assert robot.sdo(struct.pack("<BHBHH", 0x2B, 0x1017, 0, 0, 0))[0] == 0x60  # no heartbeat in between
    assert robot.read(0x1000) == 0
    assert robot.read(0x1018, 2) == 0x5A50
    assert robot.read(0x2000, 1) == 10000
    assert robot.read(0x2003, 1) == 0x01020304
    assert robot.aborted(struct.pack("<BHBI", 0x40, 0x2FFF, 0, 0)) == 0x06020000
    assert robot.aborted(struct.pack("<BHBI", 0x23, 0x1000, 0, 1)) == 0x06010002
    robot.clean_cycle()
    request_id = robot.measure(job=2)
    assert robot.wait_commit(request_id)[1:3] == (NOT_OK | SIMULATED, 301)
    assert robot.emergency(0xFF01) == struct.pack("<HBHHB", 0xFF01, 0, 301, request_id, 0)
    robot.acknowledge(request_id)
    request_id = robot.measure(job=4)
    assert robot.wait_commit(request_id)[1:3] == (NOT_OK | SIMULATED, 507)
    robot.emergency(0xFF01)
    robot.acknowledge(request_id)
    request_id = robot.next_id()
    robot.command(ZERO, request_id, 1, 0x5A45524F)
    assert robot.wait_commit(request_id)[1:3] == (SIMULATED, 0)
    robot.clean_cycle()


def check_heartbeat(robot):
    assert robot.sdo(struct.pack("<BHBHH", 0x2B, 0x1017, 0, 100, 0))[0] == 0x60
    for _ in range(5):
        assert robot.wait_frame(0x700 + NODE) == b"\x05"
    assert robot.read(0x1017) == 100


def check_refusals(robot, server):
    before = server.counters()
    request_id = robot.measure()
    robot.wait_commit(request_id, lambda status: status & BUSY)
    robot.command(MEASURE, request_id + 1)
    assert robot.emergency(0xFF03)[5:] == struct.pack("<HB", request_id + 1, 1)
    assert robot.wait_commit(request_id)[3] == STEPS
    robot.command(MEASURE, request_id)
    assert robot.emergency(0xFF03)[5:] == struct.pack("<HB", request_id, 2)
    robot.acknowledge(request_id)
    assert server.counters()["refused"] == before["refused"] + 2
    silent = robot.measure(job=3)
    assert robot.wait_commit(silent)[1:3] == (NOT_OK | SIMULATED, 205)
    robot.clean_cycle()


def check_nmt(robot):
    epoch = robot.read(0x2001, 1)
    robot.send(0, bytes([2, NODE]))
    assert robot.wait_frame(0x700 + NODE, lambda data: data == b"\x04")
    robot.send(0, bytes([128, 0]))
    assert robot.wait_frame(0x700 + NODE, lambda data: data == b"\x7f")
    assert robot.read(0x2001, 1) != epoch, "the owner had lost its link"
    robot.send(0, bytes([1, NODE]))
    robot.clean_cycle()
    robot.send(0, bytes([129, NODE]))
    assert robot.wait_frame(0x700 + NODE, lambda data: data == b"\x00")
    robot.clean_cycle()


def check_fault(robot, frame, error, fault):
    """A fault is latched, no correction passes, and Reset ends it."""
    run("cansend", robot.interface, frame)
    robot.emergency(error)
    assert robot.read(0x2004, 1) == fault
    request_id = robot.measure()
    assert robot.wait_commit(request_id)[1:3] == (NOT_OK | ERROR | SIMULATED, 103)
    assert robot.read(0x2002, 1) == 0x80000000
    robot.command(RESET, robot.next_id(), 0, 0)
    robot.emergency(0x0000)
    assert robot.read(0x2004, 1) == 0
    robot.clean_cycle()


def check_garbage(robot, server):
    before = server.counters()
    for options in (["-I", "205", "-L", "7"], ["-I", "205", "-L", "0"], ["-I", "205", "-R", "-L", "8"],
                    ["-e", "-I", "205", "-L", "8"], ["-I", "605", "-L", "3"], ["-I", "000", "-L", "2", "-D", "0206"],
                    ["-I", "206", "-L", "8"]):
        run("cangen", robot.interface, "-g", "1", "-n", "200", *options)
    after = server.wait_for("wrong_size", before["wrong_size"] + 600)
    assert after["wrong_size"] == before["wrong_size"] + 600
    assert after["remote"] == before["remote"] + 200
    assert after["extended"] == before["extended"] + 200
    for name in ("commands", "accepted", "refused", "fault", "foreign"):
        assert after[name] == before[name], name
    robot.drain()
    robot.clean_cycle()


def check_full_load(robot, server):
    """A cycle is clean on a full bus. Under a flood that the node has to look at nothing of it counts, and afterwards a
    cycle is clean."""
    robot.bus.set_filters([{"can_id": base + NODE, "can_mask": 0x7FF} for base in (0x080, 0x180, 0x280, 0x380, 0x580)])
    with subprocess.Popen(["cangen", robot.interface, "-g", "0", "-i", "-I", "111", "-L", "8"]) as flood:
        for _ in range(3):
            robot.clean_cycle()
        assert flood.poll() is None, "the flood ended before the cycles"
        flood.terminate()
    robot.bus.set_filters(None)
    before = server.counters()
    with subprocess.Popen(["cangen", robot.interface, "-g", "0", "-i", "-I", "605", "-L", "5"]) as flood:
        time.sleep(3)
        flood.terminate()
    after = server.counters()
    assert after["wrong_size"] > before["wrong_size"] + 1000, (before, after)
    for name in ("commands", "accepted", "refused", "fault"):
        assert after[name] == before[name], name
    print(f"flood: {after['wrong_size'] - before['wrong_size']} frames refused")
    robot.drain()
    robot.clean_cycle()


def check_interface(robot, server, down, up):
    """The interface goes in mid-request: the request's answer is never seen, and the next cycle is clean."""
    lost = server.counters()["links_lost"]
    opened = server.counters()["opened"]
    request_id = robot.measure()
    epoch = robot.epoch
    robot.wait_commit(request_id, lambda status: status & BUSY)
    robot.close()
    for command in down:
        run(*command)
    server.wait_for("links_lost", lost + 1)
    for command in up:
        run(*command)
    again = Robot(robot.interface)
    again.last_id = robot.last_id
    server.wait_for("opened", opened + 1)
    for message in again.frames(1):
        answer = again.commit(message, epoch)
        assert not answer or answer[0] != request_id, "an old result was sent"
    assert again.read(0x2001, 1) != epoch
    assert again.read(0x2004, 1) == 0
    again.clean_cycle()
    return again


def check_fd(program, interface):
    server = Server(program, interface, "fd")
    robot = Robot(interface, fd=True)
    epoch = robot.read(0x2001, 1)
    robot.command(MEASURE, 7, job=4)
    data = robot.wait_frame(0x480 + NODE, lambda data: data[:2] == b"\x07\x00" and data[10] & 2 == 0)
    assert len(data) == 48
    assert int.from_bytes(data[44:], "little") == crc32_autosar(struct.pack("<H", 0x5A50) + data[:44])
    fields = struct.unpack("<IIHH6iHHBBH", data[:44])
    assert fields[:4] == (7, epoch, 0, 1 | 4 | 8 | 64), fields
    assert fields[4:10] == (400000, -6789, 1, 302500, -5678, 1234), fields
    assert fields[10] < 1000 and fields[11:] == (20000, 11, 4, 0), fields
    assert robot.read(0x1800, 1) == 0x80000180 + NODE
    robot.command(ACKNOWLEDGE, 7, 0, 0)
    data = robot.wait_frame(0x480 + NODE, lambda data: data[:4] == b"\0\0\0\0")
    assert struct.unpack("<6i", data[12:36]) == (-0x80000000,) * 6
    robot.close()
    server.stop()


def masked(log):
    """candump's lines from the first request on, without time and interface; CRC and epoch, which differ each time, as X."""
    lines = []
    for line in log.splitlines():
        frame = line.split()[2]
        frame = re.sub(r"^(385#.{8}).{8}$", r"\1XXXXXXXX", frame)
        frame = re.sub(r"^(585#43012001).{8}$", r"\1XXXXXXXX", frame)
        if frame != "705#05":
            lines.append(frame)
    first = next(i for i, line in enumerate(lines) if line.startswith("605#"))
    return "\n".join(lines[first:]) + "\n"


def check_golden(log_path, golden_path):
    with open(log_path) as log, open(golden_path) as golden:
        seen, expected = masked(log.read()), golden.read()
    if seen != expected:
        print(seen)
    assert seen == expected, f"the session differs from {golden_path}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", required=True)
    parser.add_argument("--interface", default="vcan0")
    parser.add_argument("--golden")
    options = parser.parse_args()
    interface = options.interface
    up = ["ip", "link", "set", interface, "up"]

    # The server first, without an interface: it waits for it. All on one processor: on several, candump may see an
    # answer before its question.
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(processors)})
    server = Server(options.server, interface)
    assert server.counters()["opened"] == 0
    add = [["ip", "link", "add", "dev", interface, "type", "vcan"], ["ip", "link", "set", interface, "mtu", "72"], up]
    for command in add[:2]:
        run(*command)
    with open("/tmp/candump.log", "w") as log:
        run(*up)
        dump = subprocess.Popen(["candump", "-L", interface], stdout=log)
        robot = Robot(interface)
        robot.wait_frame(0x700 + NODE, lambda data: data == b"\x05")  # the first frames of all are out by then
        session(robot)
        server.wait_for("results_confirmed", 1)
        dump.terminate()
        dump.wait()
    if options.golden:
        check_golden("/tmp/candump.log", options.golden)
    print("session as it should be")
    server.stop()
    os.sched_setaffinity(0, processors)
    robot.drain()
    server = Server(options.server, interface)
    server.wait_for("opened", 1)
    for check in (lambda: check_heartbeat(robot), lambda: check_refusals(robot, server), lambda: check_nmt(robot),
                  lambda: check_fault(robot, "185#0100000000000000", 0x8150, 1),
                  lambda: check_fault(robot, "20000040#0000000000000000", 0x8140, 2),
                  lambda: check_garbage(robot, server), lambda: check_full_load(robot, server)):
        check()
        print("checked", flush=True)
    down = [["ip", "link", "set", interface, "down"]]
    robot = check_interface(robot, server, down, [up])
    robot = check_interface(robot, server, [["ip", "link", "del", interface]], add)
    print(server.counters())
    robot.close()
    server.stop()
    check_fd(options.server, interface)
    print("all checked")


if __name__ == "__main__":
    main()
