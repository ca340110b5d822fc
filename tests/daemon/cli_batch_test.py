#!/usr/bin/env python3
"""The batch verbs of zeropose through the real program: golden runs against formulas written here once more
(spec 10, 20), wrong inputs of every kind with exact exit status and message. Usage: cli_batch_test.py ZEROPOSE SOURCE_DIR"""
import json
import math
import pathlib
import re
import sys
import unittest

from program import Case, run, run_json

SOURCE = pathlib.Path(sys.argv[2])
CELL = SOURCE / "config/cells/car-body.json"


def product(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(len(B))) for j in range(len(B[0]))] for i in range(len(A))]


def rotation(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]


def six_to_rotation(six):
    return product(product(rotation("z", six[5]), rotation("y", six[4])), rotation("x", six[3]))


def apply(six, p):
    R = six_to_rotation(six)
    return [sum(R[i][k] * p[k] for k in range(3)) + six[i] for i in range(3)]


def apply_inverse(six, p):
    R = six_to_rotation(six)
    return [sum(R[k][i] * (p[k] - six[k]) for k in range(3)) for i in range(3)]


def project(camera, p_W):
    """E2 of spec 20."""
    x, y, z = apply_inverse(camera["X_WC"], p_W)
    xn, yn = x / z, y / z
    r2 = xn * xn + yn * yn
    scale = 2 / (1 + math.sqrt(1 - 4 * camera["K"] * r2))
    return camera["fx"] * xn * scale + camera["cx"], camera["fy"] * yn * scale + camera["cy"]


def without_comments(text):
    return re.sub(r"^\s*//.*$", "", text, flags=re.M)


class CheckConfig(Case):
    def broken_cell(self):
        cell = json.loads(without_comments(CELL.read_text()))
        cell["calibration"] = str(SOURCE / "config/cells/car-body.calibration.json")
        cell["cameras"][0]["width_px"] = 768.5
        cell["jobs"][0]["search"] = cell["jobs"][0].pop("search_mm")
        cell["robots"][0]["link"]["port"] = -1
        return self.write("broken.json", json.dumps(cell))

    MISTAKES = ["cameras[0].width_px: found 768.5, expected an integer from 1 to 65535",
                "jobs[0].search_mm: found no such key, expected a number above 0 and at most 10000",
                "jobs[0].search: found an unknown key, expected ",
                "robots[0].link.port: found -1, expected an integer from 1 to 65535"]

    def test_example_is_ok(self):
        status, out, err = run("check-config", CELL)
        self.assertEqual((status, err), (0, ""))
        self.assertTrue(out.startswith("OK: cell car-body"))
        status, answer, _ = run_json("check-config", CELL)
        self.assertEqual(status, 0)
        self.assertEqual((answer["status"], answer["cameras"], answer["marks"]), ("ok", 4, 12))

    def test_every_mistake_at_once(self):
        path = self.broken_cell()
        status, out, err = run("check-config", path)
        self.assertEqual((status, out), (2, ""))
        lines = err.splitlines()
        self.assertEqual(len(lines), 4, err)
        for mistake in self.MISTAKES:
            self.assertTrue(any(line.startswith(f"{path}: {mistake}") for line in lines), (mistake, err))

    def test_mistakes_as_json(self):
        status, answer, err = run_json("check-config", self.broken_cell())
        self.assertEqual((status, answer["status"], len(answer["mistakes"])), (2, "error", 4))
        self.assertEqual(err.splitlines(), answer["mistakes"])

    def test_unreadable(self):
        self.expect_refused(run("check-config", "/no/such/file"), "/no/such/file: found no such file")
        self.expect_refused(run("check-config", self.directory.name), "found a directory")
        self.expect_refused(run("check-config", self.write("a.json", "{\n \"name\": }")), "a.json:2:10: found a syntax error")
        self.expect_refused(run("check-config"), "CELL is required")


class BestFit(Case):
    def points(self, pose, points, extra="", weights=None):
        rows = ["# made by hand", "xb,yb,zb,xa,ya,za" + extra]
        for i, b in enumerate(points):
            a = apply(pose, b)
            rows.append(",".join(map(repr, [*b, *a] + ([weights[i]] if weights else []))))
        return self.write("f.csv", "\n".join(rows) + "\n")

    POSE = [100.5, -20.25, 3000, 30, -40, 110]
    CORNERS = [[0, 0, 0], [100, 0, 0], [0, 50, 0], [0, 0, 70], [-20, 30, 40]]

    def test_finds_the_pose(self):
        status, answer, err = run_json("bestfit", "--points", self.points(self.POSE, self.CORNERS))
        self.assertEqual((status, answer["status"], err), (0, "ok", ""))
        self.expect_near(answer["X_AB"], self.POSE, 1e-9)
        self.assertEqual(len(answer["residuals"]), 5)
        self.assertLess(answer["rms_mm"], 1e-9)
        self.assertLess(answer["sigma_mm"], 1e-9)
        self.assertEqual([len(row) for row in answer["covariance"]], [6] * 6)

    def test_weight_zero_is_left_out(self):
        path = self.points(self.POSE, self.CORNERS, ",weight", [1, 1, 1, 2, 0])
        lines = path.read_text().splitlines()
        cells = lines[-1].split(",")
        cells[3] = str(float(cells[3]) + 50)
        path.write_text("\n".join(lines[:-1] + [",".join(cells)]))
        status, answer, _ = run_json("bestfit", "--points", path)
        self.assertEqual(status, 0)
        self.expect_near(answer["X_AB"], self.POSE, 1e-9)
        self.assertAlmostEqual(answer["residuals"][4][0], 50, delta=1e-9)

    def test_for_people(self):
        status, out, err = run("bestfit", "--points", self.points(self.POSE, self.CORNERS))
        self.assertEqual((status, err), (0, ""))
        self.assertIn("100.5000     -20.2500    3000.0000      30.0000     -40.0000     110.0000", out)

    def test_no_answer(self):
        line = [[0, 0, 0], [10, 10, 10], [20, 20, 20], [35, 35, 35]]
        for points, reason in ((line, "line"), (self.CORNERS[:2], "fewer than three"), ([], "fewer than three")):
            status, answer, err = run_json("bestfit", "--points", self.points(self.POSE, points))
            self.assertEqual((status, answer["status"]), (1, "failed"))
            self.assertIn(reason, answer["reason"])
            self.assertIn(reason, err)
            self.assertNotIn("X_AB", answer)

    def test_wrong_input(self):
        good = "xa,ya,za,xb,yb,zb\n1,2,3,4,5,6\n"
        self.expect_refused(run("bestfit", "--points", "/no/file"), "/no/file: found no such file")
        self.expect_refused(run("bestfit"), "--points is required")
        self.expect_refused(run("bestfit", "--points", self.write("a.csv", good.replace("zb", "z"))),
                            "a.csv:1: found no column zb, expected it", "a.csv:1: found the unknown column \"z\"")
        self.expect_refused(run("bestfit", "--points", self.write("b.csv", good + "1,2,nan,4,x,6\n1,2\n")),
                            "b.csv:4: found 2 values, expected the 6 of the header")
        self.expect_refused(run("bestfit", "--points", self.write("c.csv", good + "1,2,nan,4,x,6\n")),
                            "c.csv:3: za: found \"nan\", expected a number from -1e+06 to 1e+06",
                            "c.csv:3: yb: found \"x\"")
        self.expect_refused(run("bestfit", "--points", self.write("d.csv", "")), "d.csv: found no header line")
        self.expect_refused(run("bestfit", "--points", self.write("e.csv", good), "--what"), "--what")


class ConvertPose(Case):
    def convert(self, source, target, *values):
        status, answer, err = run_json("convert", "pose", "--from", source, "--to", target, *values)
        self.assertEqual((status, answer["status"]), (0, "ok"), err)
        return answer["values"]

    def test_orders_of_the_makers(self):
        first, second, third = 35, 20, 65
        zyx = product(product(rotation("z", first), rotation("y", second)), rotation("x", third))
        xyz = product(product(rotation("x", first), rotation("y", second)), rotation("z", third))
        zyz = product(product(rotation("z", first), rotation("y", second)), rotation("z", third))
        orders = {"kuka": (zyx, "123"), "epson": (zyx, "123"), "fanuc": (zyx, "321"), "techman": (zyx, "321"),
                  "yaskawa": (zyx, "321"), "denso": (zyx, "321"), "mitsubishi": (zyx, "321"), "zeropose": (zyx, "321"),
                  "generic": (zyx, "321"), "staubli": (xyz, "123"), "kawasaki": (zyz, "123"), "comau": (zyz, "123"),
                  "adept": (zyz, "123"), "doosan": (zyz, "123")}
        for maker, (R, order) in orders.items():
            angles = [first, second, third] if order == "123" else [third, second, first]
            with self.subTest(maker=maker):
                matrix = self.convert(maker, "matrix", 100, -200, 300.5, *angles)
                wanted = [*R[0], 100, *R[1], -200, *R[2], 300.5, 0, 0, 0, 1]
                self.expect_near(matrix, wanted, 1e-12)
                back = self.convert("matrix", maker, *map(repr, wanted))
                self.expect_near(back, [100, -200, 300.5, *angles], 1e-9)

    def test_quaternion_and_rotation_vector(self):
        half = math.sqrt(0.5)
        self.expect_near(self.convert("kuka", "abb", 1, 2, 3, 90, 0, 0), [1, 2, 3, half, 0, 0, half], 1e-12)
        self.expect_near(self.convert("kuka", "universal-robots", 1, 2, 3, 0, 0, 60),
                         [0.001, 0.002, 0.003, math.pi / 3, 0, 0], 1e-12)
        self.expect_near(self.convert("abb", "zeropose", 0, 0, 0, half, 0, half, 0)[:3], [0, 0, 0], 1e-12)

    def test_forms_of_input(self):
        self.expect_near(self.convert("zeropose", "kuka", "-1,2,3,10,20,30"), [-1, 2, 3, 30, 20, 10], 1e-9)
        self.expect_near(self.convert("zeropose", "kuka", "-1, 2", "-3 10,", 20, -30), [-1, 2, -3, -30, 20, 10], 1e-9)
        status, out, _ = run("convert", "pose", "--from", "zeropose", "--to", "kuka", "--", "-.5", 2, 3, 10, 20, 30)
        self.assertEqual((status, out), (0, "-0.5 2 3 30 20 10\n"))

    def test_many_from_stdin(self):
        lines = "# a comment\n\n1 2 3 10 20 30\r\n-4,5,6,0,0,90\n"
        status, answer, _ = run_json("convert", "pose", "--from", "zeropose", "--to", "kuka", stdin=lines)
        self.assertEqual(status, 0)
        self.expect_near(answer["poses"][0]["values"], [1, 2, 3, 30, 20, 10], 1e-9)
        self.expect_near(answer["poses"][1]["values"], [-4, 5, 6, 90, 0, 0], 1e-9)
        status, out, _ = run("convert", "pose", "--from", "zeropose", "--to", "kuka", stdin=lines)
        self.assertEqual((status, len(out.splitlines())), (0, 2))

    def test_wrong_input(self):
        kuka = ("convert", "pose", "--from", "kuka", "--to")
        self.expect_refused(run(*kuka, "abb", 1, 2, 3), "found 3 numbers, expected the 6 of kuka")
        self.expect_refused(run(*kuka, "abb", 1, 2, 3, 4, 5, "six"), 'found "six", expected a finite number')
        self.expect_refused(run(*kuka, "abb", 1, 2, 3, 4, 5, "nan"), 'found "nan"')
        self.expect_refused(run(*kuka, "abc", 1, 2, 3, 4, 5, 6), 'found the convention "abc", expected one of zeropose')
        self.expect_refused(run("convert", "pose", "--to", "abb", 1), "--from is required")
        self.expect_refused(run("convert"), "subcommand is required")
        self.expect_refused(run(*kuka, "abb", stdin="1 2 3 4 5 6\n1 2\n"), "stdin:2: found 2 numbers")
        for values in ((0, 0, 0, 1, 1, 0, 0), (0, 0, 0, 0, 0, 0, 0)):
            status, answer, err = run_json("convert", "pose", "--from", "abb", "--to", "kuka", *values)
            self.assertEqual((status, answer["status"]), (1, "failed"))
            self.assertIn("no rotation", answer["reason"] + err)


class Pose(Case):
    TRUTH = [12.5, -20.25, 8.75, 0.15, -0.2, 0.1]

    def setUp(self):
        super().setUp()
        text = (SOURCE / "config/cells/car-body.calibration.json").read_text()
        self.cameras = json.loads(without_comments(text))
        self.camera_file = self.write("cameras.json", json.dumps(self.cameras))
        cell = json.loads(without_comments(CELL.read_text()))
        self.marks = [(m["name"], m["cameras"][0], m["position_mm"]) for m in cell["jobs"][0]["marks"]]
        self.mark_file = self.write("marks.csv", "mark,x_mm,y_mm,z_mm\n" + "".join(
            f"{name},{p[0]!r},{p[1]!r},{p[2]!r}\n" for name, _, p in self.marks))

    def observations(self, covariance="", wrong=None, only=None):
        """Found pixels of the object at TRUTH; `wrong`: the mark that is 20 px off."""
        rows = ["camera,mark,u_px,v_px" + (",suu,svv,suv" if covariance else "")]
        for name, camera, p_O in self.marks if only is None else self.marks[:only]:
            u, v = project(self.cameras[camera], apply(self.TRUTH, p_O))
            rows.append(f"{camera},{name},{u + (20 if name == wrong else 0)!r},{v!r}{covariance}")
        return self.write("found.csv", "\n".join(rows) + "\n")

    def estimate(self, observations, *more):
        return run_json("pose", "--cameras", self.camera_file, "--marks", self.mark_file, "--observations", observations, *more)

    def test_finds_the_truth(self):
        for more in ((), ("--start", "-1,2,3,0,0,0"), ("--residual", "algebraic"), ("--system-sigma-px", "0.1")):
            with self.subTest(more=more):
                status, answer, err = self.estimate(self.observations(",0.0025,0.0025,0"), *more)
                self.assertEqual((status, answer["status"], answer["code"], err), (0, "ok", 0, ""))
                self.expect_near(answer["X_WO"], self.TRUTH, 1e-6)
                self.assertEqual((answer["effective_marks"], answer["effective_cameras"], answer["redundancy"]), (12, 4, 18))
                self.assertEqual(answer["removed"], [])
                self.assertEqual([len(row) for row in answer["covariance"]], [6] * 6)
                self.assertEqual(len(answer["deviations"]), 12)
                self.assertTrue(all(d["used"] and abs(d["dev_px"][0]) < 1e-6 for d in answer["deviations"]))

    def test_covariance_scales_with_the_pixels(self):
        one = self.estimate(self.observations())[1]["covariance"]
        tenth = self.estimate(self.observations(",0.01,0.01,0"))[1]["covariance"]
        for i in range(6):
            self.assertAlmostEqual(tenth[i][i] / one[i][i], 0.01, delta=1e-6)

    def test_wrong_mark_is_named(self):
        status, answer, _ = self.estimate(self.observations(",0.0025,0.0025,0", wrong="camera2/3"))
        self.assertEqual((status, answer["status"]), (0, "ok"))
        self.assertEqual(answer["removed"], [{"camera": "camera2", "mark": "camera2/3"}])
        self.expect_near(answer["X_WO"], self.TRUTH, 1e-6)
        wrong = [d for d in answer["deviations"] if d["removed"]]
        self.assertEqual(len(wrong), 1)
        self.assertAlmostEqual(wrong[0]["dev_px"][0], 20, delta=1e-3)
        _, out, _ = run("pose", "--cameras", self.camera_file, "--marks", self.mark_file, "--observations",
                        self.observations(",0.0025,0.0025,0", wrong="camera2/3"))
        self.assertRegex(out, r"camera2 camera2/3 +removed as wrong")

    def test_no_answer(self):
        for count in (0, 2):
            status, answer, err = self.estimate(self.observations(only=count))
            self.assertEqual((status, answer["status"], answer["code"]), (1, "failed", 301))
            self.assertIsNone(answer["X_WO"])
            self.assertIn("301", err)
            self.assertTrue(answer["reason"])

    def test_poses_that_cannot_be_told_apart_are_listed(self):
        self.assertEqual(self.estimate(self.observations())[1]["alternatives"], [])
        status, answer, err = self.estimate(self.observations(only=3))  # three marks of one camera
        self.assertEqual((status, answer["status"], answer["code"]), (1, "failed", 401))
        self.assertIsNone(answer["X_WO"])
        self.assertIn("different poses", err)
        self.assertIn(len(answer["alternatives"]), (2, 3, 4))
        distances = [max(abs(a - b) for a, b in zip(X_WO, self.TRUTH)) for X_WO in answer["alternatives"]]
        self.assertLess(min(distances), 1e-3)

    def test_wrong_input(self):
        found = self.observations()
        arguments = ("pose", "--cameras", self.camera_file, "--marks", self.mark_file, "--observations", found)
        self.expect_refused(run("pose"), "is required")
        self.expect_refused(run(*arguments, "--start", "1,2,3"), "--start: found 3 numbers, expected the 6")
        self.expect_refused(run(*arguments, "--planar", "1,2,3,4,5,x"), '--planar: found "x"')
        self.expect_refused(run(*arguments, "--residual", "other"), "other not in {reprojection,algebraic}")
        self.expect_refused(run(*arguments, "--system-sigma-px", "-1"), "-1 not in range")
        bad_camera = self.write("bad.json", json.dumps({"camera1": {**self.cameras["camera1"], "fx": -1}}))
        bad_marks = self.write("bad.csv", "mark,x_mm,y_mm,z_mm,weight\na,1,2,3,2\na,1,2,3,1\n")
        self.expect_refused(run("pose", "--cameras", bad_camera, "--marks", bad_marks, "--observations", found),
                            "bad.json: camera1.fx: found -1, expected a number above 0",
                            'bad.csv:2: weight: found "2", expected a number from 0 to 1',
                            'bad.csv:3: mark: found "a" again, expected each mark once')
        text = found.read_text()
        found.write_text(text.replace("camera4,camera4/3", "camera5,camera4/4"))
        self.expect_refused(run(*arguments), 'found.csv:13: camera: found "camera5"', 'found.csv:13: mark: found "camera4/4"')


class Help(Case):
    def test_every_verb_shows_an_example(self):
        for verb in (("check-config",), ("pose",), ("bestfit",), ("convert", "pose")):
            status, out, err = run(*verb, "--help")
            self.assertEqual((status, err), (0, ""))
            for part in ("Usage:", "Example", "Exit status:", "--json", "zeropose " + " ".join(verb)):
                self.assertIn(part, out)

    def test_wrong_usage(self):
        self.expect_refused(run())
        self.expect_refused(run("no-such-verb"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]], verbosity=1)
