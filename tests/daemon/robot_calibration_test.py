#!/usr/bin/env python3
"""zeropose calibrate tool, ball and hand-eye through the real program: robots and cameras made here from the formulas of
spec 10 and 20, the 27 published ball positions, what is done wrong in practice.
Usage: robot_calibration_test.py ZEROPOSE SOURCE_DIR"""
import csv
import json
import math
import pathlib
import random
import sys
import unittest

from program import Case, page_texts, run, run_json

SOURCE = pathlib.Path(sys.argv[2])
CAMERA = {"model": "division", "width": 768, "height": 572, "fx": 1930.0, "fy": 1925.0, "cx": 395.0, "cy": 279.0, "K": -0.2}
POSE = "x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg"


def product(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def matrix(six):
    (cx, sx), (cy, sy), (cz, sz) = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in six[3:]]
    return [[cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz, six[0]],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz, six[1]],
            [-sy, sx * cy, cx * cy, six[2]], [0, 0, 0, 1]]


def inverse(A):
    R = [[A[j][i] for j in range(3)] for i in range(3)]
    return [R[i] + [-sum(R[i][k] * A[k][3] for k in range(3))] for i in range(3)] + [[0, 0, 0, 1]]


def six(A):
    return [A[0][3], A[1][3], A[2][3], math.degrees(math.atan2(A[2][1], A[2][2])),
            math.degrees(math.asin(max(-1, min(1, -A[2][0])))), math.degrees(math.atan2(A[1][0], A[0][0]))]


def moved(A, p):
    return [sum(A[i][k] * p[k] for k in range(3)) + A[i][3] for i in range(3)]


def pixel(p_C, camera=CAMERA):
    x, y = p_C[0] / p_C[2], p_C[1] / p_C[2]
    scale = 2 / (1 + math.sqrt(1 - 4 * camera["K"] * (x * x + y * y)))
    return camera["fx"] * x * scale + camera["cx"], camera["fy"] * y * scale + camera["cy"]


class RobotCase(Case):
    def table(self, name, header, rows):
        return self.write(name, header + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))

    def camera(self):
        return self.write("camera.json", json.dumps(CAMERA))


class Tool(RobotCase):
    END, POINT = [35, -12, 180], [900, -250, 300]
    TURNS = [[180, 0, 0], [150, 10, 20], [200, -20, 70], [180, 30, -40], [165, -25, 110], [190, 20, 160]]

    def touches(self, turns=None, change=lambda row: row):
        rows = []
        for turn in turns or self.TURNS:
            at = moved(matrix([0, 0, 0, *turn]), self.END)
            rows.append(change([self.POINT[k] - at[k] for k in range(3)] + turn))
        return rows

    def tool(self, rows, *more):
        return run_json("calibrate", "tool", "--touches", self.table("t.csv", POSE, rows), *more)

    def test_end_and_point(self):
        status, answer, err = self.tool(self.touches())
        self.assertEqual((status, answer["status"], answer["reason"], err), (0, "ok", "", ""))
        self.expect_near(answer["p_HT"], self.END, 1e-6)
        self.expect_near(answer["fixed_point"], self.POINT, 1e-6)
        self.assertEqual([r["touch"] for r in answer["residuals_mm"]], ["1", "2", "3", "4", "5", "6"])
        self.assertEqual([len(row) for row in answer["covariance"]], [3] * 3)
        out = run("calibrate", "tool", "--touches", self.path("t.csv"))[1]
        self.assertIn("180.0000", out)

    def test_turns_about_one_axis(self):
        status, answer, _ = self.tool(self.touches([[0, 0, a] for a in (0, 40, 80, 120)]))
        self.assertEqual((status, answer["status"], answer["what"], answer["p_HT"]), (1, "failed", "rotation_missing", None))
        self.assertIn("(0.00, 0.00, 1.00) in the hand", answer["reason"])
        self.expect_near(answer["open_axis_R"], [0, 0, 1], 1e-9)

    def test_a_wrong_touch_is_named(self):
        rows = self.touches()
        rows[2][0] += 4
        self.table("t.csv", "touch," + POSE, [["ABCDEF"[i], *row] for i, row in enumerate(rows)])
        status, answer, _ = run_json("calibrate", "tool", "--touches", self.path("t.csv"), "--sigma-mm", 0.05)
        self.assertEqual((status, answer["removed"]), (0, ["C"]), answer["reason"])
        self.expect_near(answer["p_HT"], self.END, 1e-6)

    def test_the_page(self):
        page = self.path("page.svg")
        rows = self.touches()
        rows[2][0] += 4
        self.table("t.csv", "touch," + POSE, [["ABCDEF"[i], *row] for i, row in enumerate(rows)])
        tool = ["calibrate", "tool", "--touches", self.path("t.csv"), "--sigma-mm", 0.05]
        self.assertIn("written: ", run(*tool, "--report", page, "--active=35,-12,179")[1])
        texts = page_texts(page)
        for part in ("180.000", "179.000", "1.000", "900.000", "A", "F", "4.000", "left out: it contradicts the others",
                     "Turns of the hand", "5 of 6"):
            self.assertIn(part, texts)
        self.expect_refused(run(*tool, "--active", "1,2,3"), "--report")
        self.expect_refused(run(*tool, "--report", page, "--active", "1,2"), "--active")
        # Without an answer no page.
        none = self.path("none.svg")
        self.assertEqual(self.tool(rows[:2], "--report", none)[0], 1)
        self.assertFalse(none.exists())

    def test_units(self):
        status, answer, _ = self.tool(self.touches(change=lambda row: [x / 1000 for x in row[:3]] + row[3:]))
        self.assertEqual(status, 0)
        self.assertIn("look like metres", answer["warnings"][0])
        status, answer, _ = self.tool(self.touches(change=lambda row: row[:3] + [math.radians(a) for a in row[3:]]))
        self.assertEqual(status, 1)
        self.assertIn("radians", answer["reason"])

    def test_wrong_input(self):
        rows = self.touches()
        self.expect_refused(run("calibrate", "tool", "--touches", self.table("n.csv", POSE, [["nan", *rows[0][1:]]])),
                            "n.csv:2", "x_mm")
        self.expect_refused(run("calibrate", "tool", "--touches", self.table("m.csv", "x_mm,y_mm", [[1, 2]])), "z_mm")
        status, answer, _ = self.tool(rows[:2])
        self.assertEqual((status, answer["what"]), (1, "too_few_touches"))


class HandEye(RobotCase):
    X_FC, X_GB = matrix([40, -60, 90, 10, -20, 35]), matrix([820, 150, -40, 3, -5, 60])

    def scene(self, setup, views=8, change=lambda row: row, pitch=30.0):
        """robot.csv and points.csv; F is what the camera is fixed to, G what the board is fixed to."""
        dice = random.Random(11)
        robot, points = [], []
        for view in range(views):
            turn = [dice.uniform(-30, 30), dice.uniform(-30, 30), dice.uniform(-60, 60)]
            X_CB = product(matrix([dice.uniform(-50, 50), dice.uniform(-40, 40), dice.uniform(550, 800), *turn]),
                           matrix([-45, -45, 0, 0, 0, 0]))
            X_FG = product(product(self.X_FC, X_CB), inverse(self.X_GB))
            X_RH = X_FG if setup == "eye-to-hand" else inverse(X_FG)
            robot.append([f"v{view}", *map(repr, change(six(X_RH)))])
            for x in range(4):
                for y in range(4):
                    u, v = pixel(moved(X_CB, [30.0 * x, 30.0 * y, 0]))
                    points.append([f"v{view}", pitch * x, pitch * y, 0, repr(u + dice.gauss(0, 0.03)),
                                   repr(v + dice.gauss(0, 0.03))])
        self.table("robot.csv", "view," + POSE, robot)
        self.table("points.csv", "view,x_mm,y_mm,z_mm,u_px,v_px", points)
        return ["calibrate", "hand-eye", "--setup", setup, "--robot", self.path("robot.csv"), "--points",
                self.path("points.csv"), "--camera", self.camera()]

    def test_both_setups(self):
        for setup, camera, board in (("eye-in-hand", "X_HC", "X_RB"), ("eye-to-hand", "X_RC", "X_HB")):
            status, answer, err = run_json(*self.scene(setup))
            self.assertEqual((status, answer["status"], answer["reason"], err), (0, "ok", "", ""))
            for key, truth in ((camera, self.X_FC), (board, self.X_GB)):
                for found, wanted, sigma in zip(answer[key], six(truth), answer["sigma"][key]):
                    self.assertLess(abs(found - wanted), 6 * sigma)
                self.expect_near(answer[key][:3], six(truth)[:3], 0.5)
            self.assertEqual([v["view"] for v in answer["views"]], [f"v{i}" for i in range(8)])
            self.assertLess(max(v["error_mm"] for v in answer["views"]), 2)
            self.assertEqual([len(row) for row in answer["covariance"][camera]], [6] * 6)
            self.assertIn(camera, run(*self.scene(setup))[1])

    def test_the_camera_is_written_where_it_hangs(self):
        for setup, key, base in (("eye-in-hand", "X_HC", []), ("eye-to-hand", "X_WC", ["--X-WR", "0,0,0,0,0,0"])):
            output = self.path(setup + ".json")
            _, answer, _ = run_json(*self.scene(setup), *base, "--output", output)
            written = json.loads(output.read_text())
            self.assertEqual([pose for pose in ("X_HC", "X_WC") if pose in written], [key])
            self.expect_near(written[key], answer["X_HC" if setup == "eye-in-hand" else "X_RC"], 1e-9)

    def test_the_page(self):
        page, camera = self.path("page.svg"), self.path("used.json")
        in_use = six(self.X_FC)
        in_use[2] -= 1
        for setup, key, other, base in (("eye-in-hand", "X_HC", "X_RB", []), ("eye-to-hand", "X_RC", "X_HB", ["--X-WR", "100,0,0,0,0,0"])):
            X_WC = in_use if not base else [in_use[0] + 100, *in_use[1:]]
            self.write("used.json", json.dumps({**CAMERA, "X_WC" if base else "X_HC": X_WC}))
            status, answer, err = run_json(*self.scene(setup), *base, "--report", page, "--active", camera)
            self.assertEqual(status, 0, err)
            texts = page_texts(page)
            for part in ("Error of each view, mm", "Error of each view, deg", "Turns of the hand", "Histogram", "v0", "v7",
                         "8 of 8 views agree within %.3f mm and %.4f deg RMS." % (answer["rms_mm"], answer["rms_deg"]),
                         "%.3f" % answer[key][0], "%.4f" % answer[other][5], "%.3f" % (answer[key][2] - in_use[2]),
                         "v7 16"):
                self.assertIn(part, texts)
        self.expect_refused(run(*self.scene("eye-to-hand"), "--report", page, "--active", camera), "--X-WR")
        self.expect_refused(run(*self.scene("eye-in-hand"), "--report", page, "--active", camera), "used.json", "X_HC")

    def test_inverted_poses_and_units(self):
        status, answer, _ = run_json(*self.scene("eye-to-hand", change=lambda row: six(inverse(matrix(row)))))
        self.assertEqual((status, answer["X_RC"]), (1, None))
        self.assertIn("look like X_HR, not X_RH", answer["reason"])
        status, answer, _ = run_json(*self.scene("eye-in-hand", change=lambda r: [x / 1000 for x in r[:3]] + r[3:]))
        self.assertEqual(status, 1)
        self.assertIn("metres", answer["reason"])

    def test_a_wrong_pitch(self):
        status, answer, _ = run_json(*self.scene("eye-to-hand", pitch=29.7))
        self.assertEqual(status, 0, answer["reason"])
        self.assertIn("% too small", answer["warnings"][0])
        self.assertAlmostEqual(answer["scale"], 30 / 29.7, delta=4 * answer["scale_sigma"])

    def test_wrong_input(self):
        arguments = self.scene("eye-to-hand")
        status, answer, _ = run_json(*self.scene("eye-to-hand", views=2))
        self.assertEqual((status, answer["what"]), (1, "too_few_views"))
        self.scene("eye-to-hand")
        self.table("robot.csv", "view," + POSE, [["v0", 1, 2, 3, 4, 5, 6]])
        self.expect_refused(run(*arguments), '"v1"', "robot.csv")
        self.table("robot.csv", "view," + POSE, [["v0", 1, 2, 3, 4, 5, 6]] * 2)
        self.expect_refused(run(*arguments), '"v0" again')
        self.expect_refused(run(*arguments, "--robot-sigma-mm", 0.1), "robot-sigma-deg")
        self.expect_refused(run("calibrate", "hand-eye", "--setup", "hand"), "hand")


class Ball(RobotCase):
    SIZE = ["--width", 768, "--height", 572]

    def published(self, extra=()):
        rows = list(csv.DictReader(r for r in (SOURCE / "tests/golden/ball-27.csv").read_text().splitlines() if r[0] != "#"))
        # A tool straight down the hand; the published places are the ball's.
        robot = [[i, *[float(r[c]) + (150 if c == "z_mm" else 0) for c in ("x_mm", "y_mm", "z_mm")], 180, 0, 0]
                 for i, r in enumerate(rows)]
        pixels = [[i, 384 + float(r["u_from_centre_px"]), 286 + float(r["v_from_centre_px"])] for i, r in enumerate(rows)]
        self.table("robot.csv", "view," + POSE, [*robot, *extra])
        self.table("pixels.csv", "view,u_px,v_px", pixels)
        return ["calibrate", "ball", "--setup", "eye-to-hand", "--robot", self.path("robot.csv"), "--pixels",
                self.path("pixels.csv"), "--tool", "0,0,150", *self.SIZE, "--refine", "joint", "--residual", "algebraic"]

    def test_27_published_places(self):
        result = next(csv.DictReader(r for r in (SOURCE / "tests/golden/ball-27-result.csv").read_text().splitlines()
                                     if r[0] != "#"))
        wanted = [float(result[k]) for k in ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")]
        status, answer, _ = run_json(*self.published([["idle", 1, 2, 3, 4, 5, 6]]))
        self.assertEqual((status, answer["status"]), (0, "ok"))
        self.assertAlmostEqual(answer["camera"]["fx"], float(result["fx_px"]), delta=0.01)
        self.expect_near(answer["X_RC"][:3], wanted[:3], 0.005)
        for found, value in zip(answer["X_RC"][3:], wanted[3:]):
            self.assertAlmostEqual(math.remainder(found - value, 360), 0, delta=0.002)
        self.assertNotIn("X_WC", answer)
        self.assertTrue(any("no pixel: idle" in w for w in answer["diagnosis"]["warnings"]))
        status, moved_answer, _ = run_json(*self.published(), "--X-WR=100,-50,20,0,0,90")
        self.expect_near(moved_answer["X_RC"][:3], wanted[:3], 0.005)
        self.expect_near(moved_answer["X_WC"][:3], moved(matrix([100, -50, 20, 0, 0, 90]), wanted[:3]), 0.005)

    def places(self, change=lambda row: row, flat=False, radius=0.0):
        """A ball at a point of the base, seen by a camera on the hand that goes round it."""
        dice = random.Random(3)
        X_HC, ball, robot, pixels = matrix([30, 50, 80, 5, -8, 20]), [700, 100, 50], [], []
        for view in range(36):
            z = 800 if flat else dice.uniform(600, 1000)
            p_C = [dice.uniform(-0.18, 0.18) * z, dice.uniform(-0.13, 0.13) * z, z]
            turn = matrix([0, 0, 0, 180 + dice.uniform(-20, 20), dice.uniform(-20, 20), dice.uniform(-40, 40)])
            p_H = moved(X_HC, p_C)
            at = moved(turn, p_H)
            robot.append([view, *map(repr, change([ball[k] - at[k] for k in range(3)] + six(turn)[3:]))])
            if radius:
                # The outline of the ball, point by point: the cone that touches it. Its centre of area.
                n = math.sqrt(sum(x * x for x in p_C))
                d = [x / n for x in p_C]
                a = [d[2], 0, -d[0]]
                a = [x / math.hypot(*a) for x in a]
                b = [d[1] * a[2] - d[2] * a[1], d[2] * a[0] - d[0] * a[2], d[0] * a[1] - d[1] * a[0]]
                tan = radius / math.sqrt(n * n - radius * radius)
                ring = [pixel([d[i] + tan * (math.cos(t) * a[i] + math.sin(t) * b[i]) for i in range(3)])
                        for t in (2 * math.pi * k / 360 for k in range(360))]
                area = sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(ring, ring[1:] + ring[:1]))
                u = sum((p[0] + q[0]) * (p[0] * q[1] - q[0] * p[1]) for p, q in zip(ring, ring[1:] + ring[:1])) / 3 / area
                v = sum((p[1] + q[1]) * (p[0] * q[1] - q[0] * p[1]) for p, q in zip(ring, ring[1:] + ring[:1])) / 3 / area
            else:
                u, v = pixel(p_C)
            pixels.append([view, repr(u), repr(v)])
        self.table("robot.csv", "view," + POSE, robot)
        self.table("pixels.csv", "view,u_px,v_px", pixels)
        return six(X_HC), ["calibrate", "ball", "--setup", "eye-in-hand", "--robot", self.path("robot.csv"), "--pixels",
                           self.path("pixels.csv"), "--ball=700,100,50", *self.SIZE, "--refine", "joint"]

    def test_eye_in_hand(self):
        X_HC, arguments = self.places()
        status, answer, _ = run_json(*arguments)
        self.assertEqual((status, answer["status"]), (0, "ok"), answer["reason"])
        self.expect_near(answer["X_HC"], X_HC, 1e-3)
        self.assertAlmostEqual(answer["camera"]["fx"], 1930, delta=1e-3)
        run_json(*arguments, "--output", self.path("camera.json"))
        self.expect_near(json.loads(self.path("camera.json").read_text())["X_HC"], X_HC, 1e-3)

    def test_outlines_of_a_large_ball(self):
        X_HC, arguments = self.places(radius=40.0)
        _, without, _ = run_json(*arguments)
        status, answer, _ = run_json(*arguments, "--radius-mm", 40)
        self.assertEqual(status, 0)
        worst = lambda a: max(abs(x - y) for x, y in zip(a["X_HC"][:3], X_HC[:3]))
        # What is left is that the centre of area is not the centre of the best fitting ellipse where the lens bends it.
        self.assertLess(worst(answer), 0.3 * worst(without))

    def test_one_plane_is_warned_of(self):
        _, arguments = self.places(flat=True)
        status, answer, _ = run_json(*arguments)
        text = answer["reason"] + str(answer["diagnosis"]["warnings"])
        self.assertIn("in one plane", text)

    def test_inverted_poses(self):
        _, arguments = self.places(change=lambda row: six(inverse(matrix(row))))
        status, answer, _ = run_json(*arguments)
        self.assertEqual(status, 1)
        self.assertIn("look like X_HR, not X_RH", answer["reason"])

    def test_wrong_usage(self):
        _, arguments = self.places()
        self.expect_refused(run(*arguments, "--tool", "1,2,3"), "no --tool")
        self.expect_refused(run(*arguments, "--X-WR", "1,2,3,4,5,6"), "--X-WR")
        self.expect_refused(run(*[a if a != "eye-in-hand" else "eye-to-hand" for a in arguments]), "--tool")
        self.table("pixels.csv", "view,u_px,v_px", [["nowhere", 1, 2]])
        self.expect_refused(run(*arguments), '"nowhere"')
        self.table("pixels.csv", "view,u_px,v_px", [[i, 100 + i, 200] for i in range(3)])
        status, answer, _ = run_json(*arguments)
        self.assertEqual((status, answer["status"]), (1, "failed"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
