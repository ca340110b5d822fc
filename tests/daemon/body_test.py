#!/usr/bin/env python3
"""zeropose find-body and calibrate body through the real program, with a picture drawn here.
Usage: body_test.py ZEROPOSE SOURCE"""
import csv
import json
import math
import pathlib
import shutil
import sys
import tempfile
import unittest

from program import Case, run, run_json

BODY = pathlib.Path(sys.argv[2]) / "tests/golden/calibration-body.csv"
WIDTH, HEIGHT, FOCAL, CX, CY, RADIUS = 640, 480, 1500, 325, 236, 9
PLACE = (900.0, 1000.0, 780.0)  # of the camera in the body


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return [x / math.sqrt(dot(a, a)) for x in a]


Z = unit(minus((120, 140, 80), PLACE))
X = unit(cross((0, 0, -1), Z))
Y = cross(Z, X)


def marks():
    with open(BODY) as file:
        return [(row["mark"], [float(row[k]) for k in ("x_mm", "y_mm", "z_mm")]) for row in csv.DictReader(file)]


def axis_of(name):
    """The axis of the body that the mark's plane is square to."""
    return 2 if int(name) <= 20 else 1 if int(name) <= 32 else 0


def pixel(p_B):
    d = minus(p_B, PLACE)
    return FOCAL * dot(X, d) / dot(Z, d) + CX, FOCAL * dot(Y, d) / dot(Z, d) + CY


def picture(path, hidden=()):
    """Areas by 4 x 4 samples per pixel on the mark's plane."""
    grey = bytearray([170]) * (WIDTH * HEIGHT)
    for name, p_B in marks():
        if name in hidden:
            continue
        axis, (u0, v0) = axis_of(name), pixel(p_B)
        for v in range(int(v0) - 22, int(v0) + 23):
            for u in range(int(u0) - 22, int(u0) + 23):
                share = 0
                for k in range(16):
                    x, y = (u + k % 4 / 4 - 0.375 - CX) / FOCAL, (v + k // 4 / 4 - 0.375 - CY) / FOCAL
                    ray = [x * a + y * b + c for a, b, c in zip(X, Y, Z)]
                    t = (p_B[axis] - PLACE[axis]) / ray[axis]
                    off = minus([p + t * d for p, d in zip(PLACE, ray)], p_B)
                    share += dot(off, off) < RADIUS * RADIUS
                if share and 0 <= u < WIDTH and 0 <= v < HEIGHT:
                    grey[v * WIDTH + u] = min(grey[v * WIDTH + u], round(170 - 115 * share / 16))
    path.write_bytes(b"P5\n%d %d\n255\n" % (WIDTH, HEIGHT) + grey)
    return path


class Body(Case):
    @classmethod
    def setUpClass(cls):
        cls.images = pathlib.Path(tempfile.mkdtemp())
        cls.image = picture(cls.images / "body.pgm", hidden=("7", "30"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.images, ignore_errors=True)

    def find(self, *more):
        return run_json("find-body", "--image", self.image, "--body", BODY, "--focal-px", FOCAL * 1.15, "--radius-mm",
                        RADIUS, *more)

    def test_every_mark_has_its_number(self):
        status, found, err = self.find("--csv", self.path("p.csv"), "--overlay", self.path("o.png"))
        self.assertEqual((status, found["status"], found["missing"]), (0, "ok", ["7", "30"]), err)
        self.assertEqual(found["reason"], "found 42 of 44 marks")
        self.assertEqual((found["discs"], found["explained"]), (42, 42))
        self.assertLess(found["next_best"], 32)
        places = dict(marks())
        for p in found["points"]:
            self.expect_near((p["u_px"], p["v_px"]), pixel(places[p["mark"]]), 0.5)
            self.assertEqual(p["radius_mm"], RADIUS)
            self.assertGreater((p["nz"], p["ny"], p["nx"])[2 - axis_of(p["mark"])], 0.99)
        self.assertEqual(self.path("o.png").read_bytes()[1:4], b"PNG")
        with open(self.path("p.csv")) as file:
            self.assertEqual([row["mark"] for row in csv.DictReader(file)], [p["mark"] for p in found["points"]])

    def expect_camera(self, found, p):
        """Within five of the sigmas that come from the residuals."""
        sigma = found["sigma"]
        for axis, name in enumerate("xyz"):
            self.assertAlmostEqual(p[axis], PLACE[axis], delta=5 * sigma[name])
            self.assertLess(sigma[name], 2)
        self.assertAlmostEqual(found["camera"]["fx"], FOCAL, delta=5 * sigma["fx"])

    def test_the_table_is_ready_for_calibrate(self):
        self.find("--csv", self.path("p.csv"))
        size = "--width", WIDTH, "--height", HEIGHT
        status, points, _ = run_json("calibrate", "points", "--points", self.path("p.csv"), *size, "--refine", "joint")
        self.assertEqual(status, 0)
        self.expect_camera(points, points["camera"]["X_WC"])
        status, body, _ = run_json("calibrate", "body", "--points", self.path("p.csv"), *size)
        self.assertEqual((status, body["X_BC"]), (0, points["camera"]["X_WC"]))
        self.assertEqual(body["camera"], points["camera"])

    def control(self, wrong=0):
        """The body turned by 90 deg about z and moved in the world: x_W = 1000 - y, y_W = 2000 + x, z_W = z + 5."""
        rows = [(0, 0, 0), (300, 0, 0), (0, 350, 0), (0, 0, 200), (300, 350, 0)]
        text = "mark,xa,ya,za,xb,yb,zb\n"
        for k, (x, y, z) in enumerate(rows):
            text += f"c{k},{1000 - y + (wrong if k == 3 else 0)},{2000 + x},{z + 5},{x},{y},{z}\n"
        return self.write("control.csv", text)

    def calibrate(self, *more):
        return run_json("calibrate", "body", "--image", self.image, "--body", BODY, "--radius-mm", RADIUS, *more)

    def test_control_marks_put_the_camera_into_the_world(self):
        status, found, err = self.calibrate("--control", self.control(), "--output", self.path("camera.json"))
        self.assertEqual((status, found["status"]), (0, "ok"), err)
        self.expect_camera(found, found["X_BC"])
        self.expect_near(found["X_WB"], (1000, 2000, 5, 0, 0, 90), 1e-6)
        x, y, z = found["X_BC"][:3]
        self.expect_near(found["X_WC"][:3], (1000 - y, 2000 + x, z + 5), 1e-6)
        self.assertEqual(found["camera"]["X_WC"], found["X_WC"])
        self.assertEqual(json.loads(self.path("camera.json").read_text())["X_WC"], found["X_WC"])
        self.assertEqual(len(found["sigma_X_WC"]), 6)
        # The control marks' sigma adds to the camera's own.
        self.assertTrue(all(a > 0 for a in found["sigma_X_WC"]))
        self.assertEqual(found["body"]["missing"], ["7", "30"])

    def test_a_wrong_control_mark_is_named(self):
        status, found, err = self.calibrate("--control", self.control(wrong=2))
        self.assertEqual((status, [m["mark"] for m in found["control"]["marks"] if m["removed"]]), (0, ["c3"]), err)
        self.expect_near(found["X_WB"], (1000, 2000, 5, 0, 0, 90), 1e-6)

    def test_control_marks_on_a_line(self):
        self.write("line.csv", "xa,ya,za,xb,yb,zb\n0,0,0,0,0,0\n1,0,0,1,0,0\n2,0,0,2,0,0\n")
        status, found, _ = self.calibrate("--control", self.path("line.csv"))
        self.assertEqual((status, found["status"]), (1, "failed"))
        self.assertIn("on a line", found["reason"])

    def test_a_left_handed_table(self):
        rows = "".join(f"{name},{x},{z},{y}\n" for name, (x, y, z) in marks())
        status, found, err = run_json("find-body", "--image", self.image, "--body",
                                      self.write("swapped.csv", "mark,x_mm,y_mm,z_mm\n" + rows))
        self.assertEqual((status, found["status"], found["name"], found["points"]), (1, "failed", "mirrored", []), err)
        self.assertIn("left-handed", found["reason"])

    def test_no_body(self):
        blank = self.path("blank.pgm")
        blank.write_bytes(b"P5\n64 48\n255\n" + b"\x80" * (64 * 48))
        status, found, _ = run_json("find-body", "--image", blank, "--body", BODY)
        self.assertEqual((status, found["name"]), (1, "no_numbering"))
        status, found, _ = run_json("calibrate", "body", "--image", blank, "--body", BODY)
        self.assertEqual((status, found["name"]), (1, "no_numbering"))

    def test_wrong_usage(self):
        self.expect_refused(run("find-body", "--image", self.path("none.png"), "--body", BODY), "none.png")
        few = self.write("few.csv", "mark,x_mm,y_mm,z_mm\na,0,0,0\na,1,b,0\n")
        self.expect_refused(run("find-body", "--image", self.image, "--body", few), '"a" again', "few.csv")
        three = self.write("three.csv", "mark,x_mm,y_mm,z_mm\na,0,0,0\nb,1,0,0\nc,1,1,0\n")
        self.expect_refused(run("find-body", "--image", self.image, "--body", three), "3 marks", "at least 8")
        self.expect_refused(run("calibrate", "body", "--body", BODY), "--image or --points")
        self.expect_refused(run("calibrate", "body", "--image", self.image), "--body is required")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
