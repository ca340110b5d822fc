#!/usr/bin/env python3
"""zeropose find through the real program: pictures drawn here, exact exit status, output and files.
Usage: find_test.py ZEROPOSE"""
import math
import struct
import unittest
import zlib

from program import Case, run, run_json


def step(x):
    """From 0 to 1 at an edge blurred by 0.7 px, as lenses do."""
    return 0.5 + 0.5 * math.erf(x / (0.7 * math.sqrt(2)))


def disc(u, v, at, radius):
    return step(radius - math.hypot(u - at[0], v - at[1]))


def png(path, level, size=(160, 140), bits=8, shift=0):
    """A grey picture; level(u, v) of 0..255. 16 bit: 12 bits of them are used, shift bits from the lower end."""
    rows = b""
    for v in range(size[1]):
        rows += b"\0"
        for u in range(size[0]):
            grey = level(u, v)
            rows += struct.pack(">B", round(grey)) if bits == 8 else struct.pack(">H", round(grey * 4095 / 255) << shift)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size[0], size[1], bits, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
                     chunk(b"IEND", b""))
    return path


def two_discs(u, v):
    return 180 - 110 * disc(u, v, (50.3, 60.7), 15) - 80 * disc(u, v, (110.6, 80.2), 12)


def texture(u, v):
    return 120 + 40 * math.sin(u / 5.3) * math.cos(v / 6.1) + 30 * math.sin((u + 2 * v) / 9.7) + 20 * math.cos(u * v / 900)


class Find(Case):
    def find(self, level, *arguments, **options):
        return run_json("find", "--image", png(self.path("picture.png"), level, **options), *arguments)

    def expect_mark(self, mark, at, tolerance=0.05):
        self.expect_near([mark["u_px"], mark["v_px"]], at, tolerance)
        self.assertGreater(mark["suu"], 0)

    def test_all_discs_of_a_picture_the_highest_contrast_first(self):
        for bits in (8, 16):
            status, answer, _ = self.find(two_discs, "--min-diameter", 20, "--max-diameter", 40, bits=bits)
            self.assertEqual((status, answer["status"], len(answer["marks"])), (0, "ok", 2), answer)
            self.expect_mark(answer["marks"][0], (50.3, 60.7))
            self.expect_mark(answer["marks"][1], (110.6, 80.2))
            self.assertAlmostEqual(answer["marks"][0]["diameter_px"], 30, delta=0.3)
            self.assertEqual(sorted(set(answer["marks"][0]) & {"suu", "svv", "suv", "axis_ratio", "quality"}),
                             ["axis_ratio", "quality", "suu", "suv", "svv"])

    def test_twelve_bits_at_either_end_of_sixteen_are_saturated_at_their_white(self):
        for shift in (0, 4):
            fine = lambda u, v: 250 - 150 * disc(u, v, (50.3, 60.7), 15)
            status, answer, _ = self.find(fine, "--min-diameter", 20, bits=16, shift=shift)
            self.assertEqual((status, len(answer["marks"])), (0, 1), answer)
            self.assertAlmostEqual(answer["marks"][0]["contrast"], 150, delta=5)
            white = lambda u, v: min(255, fine(u, v) + 40)
            status, answer, _ = self.find(white, "--min-diameter", 20, bits=16, shift=shift)
            self.assertEqual((status, answer["name"]), (1, "saturated"), answer)

    def test_a_window_and_an_overlay(self):
        status, answer, _ = self.find(two_discs, "--window", "80,50,60,60", "--min-diameter", 15, "--overlay",
                                      self.path("found.png"))
        self.assertEqual((status, len(answer["marks"])), (0, 1), answer)
        self.expect_mark(answer["marks"][0], (110.6, 80.2))
        self.assertTrue(self.path("found.png").read_bytes().startswith(b"\x89PNG"))

    def test_nothing_found_says_why_with_the_numbers(self):
        status, answer, err = self.find(two_discs, "--min-diameter", 33, "--max-diameter", 50)
        self.assertEqual((status, answer["status"], answer["name"]), (1, "failed", "too_small"), answer)
        self.assertIn("at least 33.0 px", answer["reason"])
        self.assertIn(answer["reason"], err)
        status, answer, _ = self.find(lambda u, v: 100)
        self.assertEqual((status, answer["name"], answer["marks"]), (1, "low_contrast", []))

    def test_bright_ring(self):
        level = lambda u, v: 60 + 120 * disc(u, v, (80.2, 70.4), 24) - 120 * disc(u, v, (80.2, 70.4), 14.4)
        status, answer, _ = self.find(level, "--kind", "ring", "--inner", "0.6", "--bright", "--min-diameter", 30)
        self.assertEqual((status, len(answer["marks"])), (0, 1), answer)
        self.expect_mark(answer["marks"][0], (80.2, 70.4))
        self.assertLess(answer["marks"][0]["radius_share"], 1)

    def test_an_edge_needs_a_window(self):
        level = lambda u, v: 60 + 100 * step(u - 70.4)
        answer = run("find", "--image", png(self.path("edge.png"), level), "--kind", "edge")
        self.expect_refused(answer, "--window X,Y,W,H")
        status, answer, _ = self.find(level, "--kind", "edge", "--window", "50,50,40,40", "--min-diameter", 10)
        self.assertEqual(status, 0, answer)
        self.assertAlmostEqual(answer["marks"][0]["u_px"], 70.4, delta=0.05)
        self.assertAlmostEqual(math.cos(math.radians(answer["marks"][0]["direction_deg"])), 1, delta=1e-3)

    def test_cross_corner_and_slot(self):
        at = (81.3, 68.6)
        bar = lambda x: step(x + 4) - step(x - 4)
        cross = lambda u, v: 180 - 110 * max(bar(u - at[0]), bar(v - at[1]))
        corner = lambda u, v: 180 - 110 * step(u - at[0]) * step(v - at[1])
        slot = lambda u, v: 180 - 110 * disc(max(0, abs(u - at[0]) - 14), v - at[1], (0, 0), 8)
        for kind, level in (("cross", cross), ("corner", corner), ("slot", slot)):
            status, answer, _ = self.find(level, "--kind", kind, "--window", "41,28,80,80", "--min-diameter", 20)
            self.assertEqual((status, len(answer["marks"])), (0, 1), (kind, answer))
            self.expect_mark(answer["marks"][0], at, 0.1)

    def test_a_template(self):
        png(self.path("patch.png"), lambda u, v: texture(u + 60, v + 45), size=(41, 37))
        status, answer, _ = self.find(texture, "--kind", "template", "--template", self.path("patch.png"), "--click",
                                      "10,12", "--window", "40,25,90,80")
        self.assertEqual((status, len(answer["marks"])), (0, 1), answer)
        self.expect_mark(answer["marks"][0], (70, 57))
        flat = png(self.path("flat.png"), lambda u, v: 100, size=(41, 37))
        answer = run("find", "--image", self.path("patch.png"), "--kind", "template", "--template", flat, "--window",
                     "0,0,41,37")
        self.expect_refused(answer, "flat.png: this patch is no mark: flat")

    def test_wrong_usage(self):
        picture = png(self.path("picture.png"), two_discs)
        self.expect_refused(run("find", "--image", self.path("missing.png")), "missing.png")
        self.expect_refused(run("find", "--image", self.write("text.png", "no picture")), "found no picture")
        self.expect_refused(run("find", "--image", picture, "--kind", "ring"), "--inner")
        self.expect_refused(run("find", "--image", picture, "--kind", "ring", "--inner", "0.3,0.6"), "sense")
        self.expect_refused(run("find", "--image", picture, "--min-diameter", 30, "--max-diameter", 20), "below")
        self.assertNotEqual(run("find", "--image", picture, "--kind", "star")[0], 0)
        self.assertNotEqual(run("find", "--image", picture, "--bright", "--dark")[0], 0)


if __name__ == "__main__":
    unittest.main(argv=["find_test.py"])
