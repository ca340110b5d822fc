#!/usr/bin/env python3
"""zeropose robot monitor and test through the real program: against the link's test server, and against sockets of this
file that speak for a simulated cell, a daemon and a device that is none.
Usage: robot_verbs_test.py ZEROPOSE MODBUS_TEST_SERVER SOURCE_DIR"""
import contextlib
import json
import os
import pathlib
import socket
import struct
import subprocess
import sys
import threading
import unittest

from program import PROGRAM, Case, run, run_json

SERVER, SOURCE = sys.argv[2], pathlib.Path(sys.argv[3])
CELL = SOURCE / "config/cells/car-body.json"
sys.path.insert(0, str(SOURCE / "tests/integration/peers"))
from block import ACKNOWLEDGE, MEASURE, command, crc32_autosar  # noqa: E402
from server import arguments, running  # noqa: E402

SHIFTS = [[0, 0, 0, 0, 0, 0], [30, 0, 0, 0, 0, 0], [0, 40, 0, 0, 0, 0], [0, 0, 50, 0, 0, 0], [0, 0, 0, 15, 0, 0],
          [0, 0, 0, 0, 20, 0], [0, 0, 0, 0, 0, 25], [20, -30, 40, 20, -25, 30]]


def link():
    return running(arguments("").parse_args(["--server", SERVER]))


def send(connection, registers):
    """FC16 of the command block; the function code of the answer."""
    body = struct.pack(">BBHHB10H", 1, 16, 1000, 10, 20, *registers)
    connection.sendall(struct.pack(">HHH", 7, 0, len(body)) + body)
    return connection.recv(256)[7]


def block_with(**changes):
    """A block without a result as this file packs it; then changes by register."""
    registers = [0x5A50, 1, 3, 0, 9, 0, 0, 1, 1, 0, 0, 2, 1, 0] + 8 * [0x8000, 0] + [1, 1, 0xFFFF, 2000, 0, 0, 0xFFFF,
                                                                                     0xFFFF] + 20 * [0]
    for place, value in changes.items():
        registers[int(place[1:])] = value
    crc = crc32_autosar(struct.pack(">59H", 0x5A50, *registers))
    return registers + [crc >> 16, crc & 0xFFFF, 3]


@contextlib.contextmanager
def device(registers):
    """Answers every read with these registers, on a port that it yields; to one client after the other."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            with client:
                while request := client.recv(256):
                    body = struct.pack(f">BBB{len(registers)}H", request[6], 4, 2 * len(registers), *registers)
                    client.sendall(request[:4] + struct.pack(">H", len(body)) + body)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(10)


@contextlib.contextmanager
def line_socket(path, answer):
    """A Unix socket that answers each line, one client after the other."""
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(path))
    listener.listen()

    def serve():
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            with client, client.makefile("rw") as lines:
                for line in lines:
                    lines.write(json.dumps(answer(json.loads(line))) + "\n")
                    lines.flush()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(10)


class Monitor(Case):
    def monitor(self, port, *more):
        return run("robot", "monitor", "--port", port, "--count", 1, "--json", *more)

    def one(self, port, *more):
        status, out, err = self.monitor(port, *more)
        self.assertEqual(out.count("\n"), 1, err)
        return status, json.loads(out)

    def test_a_cell_at_rest(self):
        with link() as port:
            status, line = self.one(port)
        block = line["block"]
        self.assertEqual((status, line["status"], line["reason"]), (0, "ok", ""))
        self.assertEqual((block["state"], block["status"], block["code"], block["code_name"]),
                         ("Ready", ["ready", "simulated"], 0, "ok"))
        self.assertEqual((block["robot_index"], block["convention"], block["frame"]), (2, "kuka", "robot-base shift"))
        self.assertEqual((block["config_hash"], block["calibration_hash"], block["zero_id"]),
                         ("01020304", "05060708", "09090909"))
        self.assertIsNone(block["correction"])
        self.assertEqual((block["age_ms"], block["validity_ms"], block["oddities"]), (-1, 2000, []))

    def until(self, lines, wanted):
        """The first line about a block of which this holds; a monitor that ends fails the test."""
        for text in lines:
            block = json.loads(text)["block"]
            if block and wanted(block):
                return block
        self.fail("the monitor ended")

    def test_a_measurement_from_its_command_to_its_withdrawal(self):
        with link() as port, socket.create_connection(("127.0.0.1", port)) as robot, subprocess.Popen(
                [PROGRAM, "robot", "monitor", "--port", str(port), "--period-ms", "5", "--json"],
                stdout=subprocess.PIPE, text=True) as monitor:
            try:
                self.until(monitor.stdout, lambda block: block["request_id"] == 0)
                self.assertEqual(send(robot, command(77, MEASURE, job=1, part=4711)), 16)
                block = self.until(monitor.stdout, lambda block: "result valid" in block["status"])
                self.assertEqual((block["request_id"], block["job"], block["part"]), (77, 1, 4711))
                self.expect_near(block["correction"], [12.345, -6.789, 0.001, 0.1234, -0.5678, 30.25], 1e-4)
                self.expect_near(block["maker_values"], [12.345, -6.789, 0.001, 30.25, -0.5678, 0.1234], 1e-4)
                self.assertEqual((block["effective_marks"], block["effective_cameras"]), (11, 4))
                self.assertEqual((block["largest_deviation_um"], block["sigma_um"]), (250, 31))
                self.assertTrue(0 <= block["age_ms"] <= 2000)
                self.assertEqual(send(robot, command(77, ACKNOWLEDGE)), 16)
                gone = self.until(monitor.stdout, lambda block: block["request_id"] == 0)
                self.assertIsNone(gone["correction"])
                self.assertEqual(send(robot, command(78, MEASURE, job=2)), 16)
                refused = self.until(monitor.stdout, lambda block: "not ok" in block["status"])
                self.assertEqual((refused["code"], refused["code_name"]), (301, "too_few_marks"))
                self.assertIn("Fewer marks", refused["cause"])
            finally:
                monitor.terminate()

    def test_for_people_one_line_says_it_all(self):
        with link() as port:
            status, out, err = run("robot", "monitor", "--address", "127.0.0.1", "--port", port, "--unit", 1,
                                   "--count", 1)
        self.assertEqual((status, out.count("\n")), (0, 1), err)
        for text in ("Ready [ready, simulated]", "code 0 ok", "no correction", "age none of 2000 ms",
                     "robot 2, kuka, robot-base shift", "config 01020304"):
            self.assertIn(text, out)

    def test_the_cell_file_says_where(self):
        with link() as port:
            status, line = self.one(port, "--cell", CELL, "--robot", "robot1")
        self.assertEqual((status, line["status"]), (0, "ok"))

    def test_nothing_listens(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
        status, line = self.one(port)
        self.assertEqual((status, line["status"], line["block"]), (1, "failed", None))
        self.assertIn(str(port), line["reason"])
        status, out, _ = run("robot", "monitor", "--port", port)  # does not go on for ever
        self.assertEqual((status, out.count("\n")), (1, 1))
        self.assertIn("NO BLOCK", out)

    def test_another_unit_id_is_closed_and_said(self):
        with link() as port:
            status, line = self.one(port, "--unit", 9)
        self.assertEqual((status, line["status"]), (1, "failed"))
        self.assertIn("unit id", line["reason"])

    def test_bad_blocks_are_named(self):
        for registers, data_id, reason in (([0] * 61, 0x5A50, "swapped"), (block_with(r1=2), 0x5A50, "versions"),
                                           (block_with(r2=4), 0x5A50, "one request"),
                                           (block_with(), 0x1234, "--data-id")):
            with device(registers) as port:
                status, line = self.one(port, "--data-id", data_id)
            self.assertEqual((status, line["status"], line["block"]), (1, "failed", None))
            self.assertIn(reason, line["reason"])

    def test_a_block_that_contradicts_itself_is_decoded_and_not_good(self):
        for changes, oddity in (({}, None), ({"r12": 0x8001}, "status bits"), ({"r12": 0x18}, "at the same time"),
                                ({"r11": 17}, "state is unknown"), ({"r13": 999}, "code is unknown"),
                                ({"r14": 0, "r15": 5}, "values without"), ({"r30": 99}, "convention is unknown"),
                                ({"r31": 9}, "frame"), ({"r12": 9}, "no correction"), ({"r4": 0}, "epoch is 0")):
            with device(block_with(**changes)) as port:
                status, line = self.one(port)
            self.assertEqual(line["status"], "ok")
            self.assertEqual(status, 1 if oddity else 0, changes)
            if oddity:
                self.assertIn(oddity, " ".join(line["block"]["oddities"]))

    def test_wrong_usage(self):
        self.expect_refused(run("robot", "monitor", "--count", 1), "which robot?")
        self.expect_refused(run("robot", "monitor", "--cell", CELL, "--robot", "robot7"), "robot7", "robot1")
        self.expect_refused(run("robot", "monitor", "--cell", self.path("none.json")), "none.json")
        self.expect_refused(run("robot", "monitor", "--address", "no-address", "--count", 1), "no-address")
        self.assertEqual(run("robot", "monitor", "--port", 1, "--unit", 300)[0], 2)
        self.assertEqual(run("robot")[0], 2)


def kuka(six):
    return [six[0], six[1], six[2], six[5], six[4], six[3]]


class ConventionTest(Case):
    def went(self, poses):
        return self.write("went.txt", "# zero first\n" + "".join(" ".join(map(str, pose)) + "\n" for pose in poses))

    def check(self, poses, *more):
        return run_json("robot", "test", "--robot-went", self.went(poses), *more)

    def test_the_right_convention_is_proven(self):
        status, answer, err = self.check([kuka(six) for six in SHIFTS], "--cell", CELL, "--robot", "robot1")
        self.assertEqual((status, answer["status"], answer["proven"]), (0, "ok", True), err)
        self.assertEqual(answer["convention"], "kuka")
        self.assertEqual(answer["same_numbers"], ["kuka", "epson"])
        for place, six in zip(answer["places"], SHIFTS, strict=True):
            self.expect_near(place["pose"], six, 1e-9)
        self.assertTrue(all(place["agrees"] for place in answer["places"][1:]))

    def test_a_wrong_order_is_caught_and_named(self):
        status, answer, _ = self.check(SHIFTS, "--cell", CELL, "--robot", "robot1")
        self.assertEqual((status, answer["status"], answer["proven"]), (1, "failed", False))
        self.assertEqual(len(answer["explanations"]), 1)
        self.assertIn("fanuc", answer["explanations"][0])
        self.assertEqual([place["agrees"] for place in answer["places"][1:]],
                         [True, True, True, False, True, False, False])

    def test_the_opposite_way_is_caught_and_named(self):
        opposite = [[-value for value in six] for six in SHIFTS[:-1]]
        # the inverse of the combined shift, computed apart from the program
        opposite.append([-19.0078, 21.7473, -45.4506, -30.1543, 9.9574, -37.1659])
        status, answer, _ = self.check(opposite, "--convention", "fanuc")
        self.assertEqual((status, answer["proven"]), (1, False))
        self.assertIn("opposite way", " ".join(answer["explanations"]))

    def test_for_people(self):
        status, out, err = run("robot", "test", "--convention", "fanuc", "--robot-went", self.went(SHIFTS))
        self.assertEqual(status, 0, err)
        self.assertIn("turned 20 deg about y: agrees", out)
        self.assertIn("proven: fanuc", out)
        status, _, err = run("robot", "test", "--convention", "kuka", "--robot-went", self.went(SHIFTS))
        self.assertEqual(status, 1)
        self.assertIn("turned 15 deg about x: DOES NOT AGREE", err)
        self.assertIn("What would explain", err)

    def test_numbers_typed_in(self):
        typed = "".join(",".join(map(str, six)) + "\n" for six in SHIFTS)
        status, answer, err = run_json("robot", "test", "--convention", "yaskawa", stdin=typed)
        self.assertEqual((status, answer["proven"]), (0, True), err)
        self.assertIn("Now bring the object here: turned 25 deg about z", err)
        self.assertIn("X Y Z Rx Ry Rz", err)

    def test_the_simulated_cell_moves_the_object_and_puts_it_back(self):
        asked = []

        def cell(question):
            asked.append(question)
            return {"status": "ok"}

        with line_socket(self.path("cell.sock"), cell):
            status, answer, err = self.check([kuka(six) for six in SHIFTS], "--cell", CELL, "--robot", "robot1", "--simulated",
                                             self.path("cell.sock"))
        self.assertEqual((status, answer["proven"]), (0, True), err)
        self.assertEqual({question["cmd"] for question in asked}, {"shift"})
        self.assertEqual(len(asked), len(SHIFTS) + 1)
        for question, six in zip(asked, SHIFTS + SHIFTS[:1]):
            self.expect_near(question["pose"], six, 1e-9)

    def test_what_the_daemon_measured_counts(self):
        place = {"pose": SHIFTS[0]}

        def cell(question):
            place["pose"] = question["pose"]
            return {"status": "ok"}

        def daemon(question):
            self.assertEqual(question, {"cmd": "measure"})
            near = [value + (2 if i == 0 else 0) for i, value in enumerate(place["pose"])]  # 2 mm off
            return {"status": "ok", "X_O0O": near, "X_WO": near}

        shifted = [kuka([six[0] + 2] + six[1:]) for six in SHIFTS]
        with line_socket(self.path("cell.sock"), cell), line_socket(self.path("daemon.sock"), daemon):
            status, answer, err = self.check(shifted, "--cell", CELL, "--robot", "robot1", "--simulated", self.path("cell.sock"),
                                             "--socket", self.path("daemon.sock"))
        self.assertEqual((status, answer["proven"]), (0, True), err)
        self.expect_near(answer["places"][1]["measured"], [32, 0, 0, 0, 0, 0], 1e-9)
        self.assertIn("the robot would get:", err)

    def test_an_object_that_stands_elsewhere_ends_the_check(self):
        def daemon(_):
            return {"status": "ok", "X_O0O": [0] * 6, "X_WO": [0] * 6}

        with line_socket(self.path("daemon.sock"), daemon):
            status, answer, _ = self.check(SHIFTS, "--convention", "fanuc", "--socket", self.path("daemon.sock"))
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("does not stand as asked", answer["reason"])

    def test_a_measurement_that_fails_says_why(self):
        with line_socket(self.path("daemon.sock"), lambda _: {"status": "not_ok", "code": 701, "reason": "no zero"}):
            status, answer, _ = self.check(SHIFTS, "--convention", "fanuc", "--socket", self.path("daemon.sock"))
        self.assertEqual(status, 1)
        self.assertIn("no zero", answer["reason"])

    def test_a_socket_that_nobody_serves(self):
        status, answer, _ = self.check(SHIFTS, "--convention", "fanuc", "--simulated", self.path("none.sock"))
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("none.sock", answer["reason"])

    def test_wrong_usage(self):
        self.expect_refused(run("robot", "test"), "which robot?")
        self.expect_refused(run("robot", "test", "--convention", "KUKA"), "KUKA")
        self.expect_refused(run("robot", "test", "--convention", "matrix"), "matrix")
        self.expect_refused(run("robot", "test", "--cell", CELL, "--robot", "left"), "left", "robot1")
        self.expect_refused(run("robot", "test", "--convention", "fanuc", "--robot-went", self.path("none")), "none")
        for poses, fragment in ((SHIFTS[:-1], "ends before"), ([[1, 2, 3]], "needs 6 numbers"),
                                ([["a"] * 6], "needs 6 numbers")):
            status, answer, _ = self.check(poses, "--convention", "fanuc")
            self.assertEqual((status, answer["status"]), (2, "error"))
            self.assertIn(fragment, answer["reason"])
        status, answer, _ = self.check(SHIFTS, "--convention", "abb")
        self.assertEqual(status, 2)
        self.assertIn("needs 7 numbers", answer["reason"])


if __name__ == "__main__":
    os.environ.pop("RUNTIME_DIRECTORY", None)
    unittest.main(argv=["robot_verbs_test.py"])
