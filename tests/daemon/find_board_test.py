#!/usr/bin/env python3
"""zeropose find-board through the real program: pictures drawn here, exact exit status, output and files.
Usage: find_board_test.py ZEROPOSE"""
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROGRAM = sys.argv[1]
ROWS, COLS, STEP, FIRST, RADIUS = 5, 6, 40, 50.25, 11


def board(u, v):
    """Share of a dark circle in the picture at a place; soft over one pixel, light falls off to the right."""
    col, row = round((u - FIRST) / STEP), round((v - FIRST) / STEP)
    if not (0 <= col < COLS and 0 <= row < ROWS):
        return 0
    return min(1, max(0, RADIUS + 0.5 - math.hypot(u - FIRST - col * STEP, v - FIRST - row * STEP)))


def png(path, bits, channels, shade=board):
    """A grey or colour picture of 300 x 260 px with 8 or 16 bit; 16 bit uses a quarter of the range."""
    width, height = 300, 260
    rows = b""
    for v in range(height):
        rows += b"\0"
        for u in range(width):
            level = 180 - 0.2 * u - (110 - 0.1 * u) * shade(u, v)
            value = round(level) if bits == 8 else round(level * 64)
            rows += (struct.pack(">B", value) if bits == 8 else struct.pack(">H", value)) * channels

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, 0 if channels == 1 else 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
                     chunk(b"IEND", b""))
    return path


def run(*arguments):
    done = subprocess.run([PROGRAM, "find-board", *map(str, arguments)], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


def run_json(*arguments):
    status, out, err = run(*arguments, "--json")
    assert out.count("\n") == 1 and out.endswith("\n"), f"one line of JSON expected: {out!r} {err!r}"
    return status, json.loads(out), err


class FindBoard(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.folder = pathlib.Path(directory.name)

    def size(self, rows=ROWS, cols=COLS):
        return "--rows", rows, "--cols", cols, "--pitch-mm", 12.5

    def expect_board(self, points):
        self.assertEqual([(p["row"], p["col"]) for p in points], [(r, c) for r in range(ROWS) for c in range(COLS)])
        for p in points:
            self.assertEqual((p["x_mm"], p["y_mm"], p["z_mm"]), (12.5 * p["col"], 12.5 * p["row"], 0))
            # The picture is rounded to grey levels and its edge is a ramp, not a blurred step.
            self.assertAlmostEqual(p["u_px"], FIRST + STEP * p["col"], delta=0.02)
            self.assertAlmostEqual(p["v_px"], FIRST + STEP * p["row"], delta=0.02)
            self.assertGreater(p["suu"] * p["svv"], p["suv"] ** 2)

    def test_grey_colour_and_16_bit(self):
        for bits, channels in ((8, 1), (8, 3), (16, 1)):
            image = png(self.folder / f"{bits}-{channels}.png", bits, channels)
            status, answer, _ = run_json("--image", image, *self.size())
            self.assertEqual((status, answer["status"], answer["reason"]), (0, "ok", ""))
            self.assertEqual((answer["missing"], answer["equivalent_readings"]), ([], 2))
            self.expect_board(answer["points"])

    def test_csv_and_overlay(self):
        image = png(self.folder / "board.png", 8, 1)
        table, overlay = self.folder / "points.csv", self.folder / "overlay.png"
        status, out, err = run("--image", image, *self.size(), "--diameter-mm", 6.875, "--csv", table, "--overlay",
                               overlay)
        self.assertEqual((status, err), (0, ""))
        self.assertIn("30 points", out)
        with table.open() as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]), "x_mm y_mm z_mm u_px v_px suu svv suv radius_mm".split())
        self.assertEqual(len(rows), ROWS * COLS)
        self.assertEqual({float(row["radius_mm"]) for row in rows}, {3.4375})
        self.assertAlmostEqual(float(rows[-1]["x_mm"]), 12.5 * (COLS - 1))
        self.assertTrue(overlay.read_bytes().startswith(b"\x89PNG"))

    def test_not_found_says_why_and_writes_no_points(self):
        image = png(self.folder / "board.png", 8, 1)
        table = self.folder / "points.csv"
        for rows, cols, name, text in ((4, 6, "wrong_size", "30 circles"), (6, 6, "ambiguous", "30 of 36"),
                                       (20, 20, "too_few", "30 of 400")):
            status, answer, _ = run_json("--image", image, *self.size(rows, cols), "--csv", table)
            self.assertEqual((status, answer["status"], answer["name"]), (1, "failed", name))
            self.assertIn(text, answer["reason"])
            self.assertEqual(answer["points"], [])
            self.assertFalse(table.exists())
        blank = png(self.folder / "blank.png", 8, 1, lambda u, v: 0)
        status, out, err = run("--image", blank, *self.size())
        self.assertEqual((status, out), (1, ""))
        self.assertIn("no regular grid", err)

    def test_partial(self):
        image = png(self.folder / "board.png", 8, 1)
        status, answer, _ = run_json("--image", image, *self.size(6, 7), "--partial")
        self.assertEqual((status, answer["place_known"], len(answer["points"])), (0, False, 30))
        self.assertIn("not known", answer["reason"])

    def test_wrong_usage(self):
        image = png(self.folder / "board.png", 8, 1)
        text = self.folder / "text.png"
        text.write_text("no picture")
        cases = ((("--image", image, *self.size(1)), "--rows"),
                 (("--image", image, "--rows", 5, "--cols", 6, "--pitch-mm", 0), "--pitch-mm"),
                 (("--image", image, *self.size(), "--board", "dots"), "--board"),
                 (("--image", text, *self.size()), "text.png: found no picture"),
                 (("--image", self.folder / "none.png", *self.size()), "none.png: found no such file"),
                 (("--image", image, *self.size(), "--csv", self.folder / "no" / "where.csv"), "cannot be written"),
                 (self.size(), "--image"))
        for arguments, message in cases:
            status, out, err = run(*arguments)
            self.assertEqual((status, out), (2, ""), (arguments, err))
            self.assertIn(message, err)

    def test_help_teaches(self):
        status, out, _ = run("--help")
        self.assertEqual(status, 0)
        for word in ("equivalent_readings", "--partial", "Exit status", "radius_mm"):
            self.assertIn(word, out)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
