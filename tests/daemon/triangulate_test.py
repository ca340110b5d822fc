#!/usr/bin/env python3
"""zeropose triangulate through the real program: pixels made here from the formulas of spec 10 and 20, every reason why
a point has no place, wrong inputs. Usage: triangulate_test.py ZEROPOSE"""
import json
import math
import unittest

from program import Case, run, run_json


def rotation(six):
    (cx, sx), (cy, sy), (cz, sz) = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in six[3:]]
    return [[cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy]]


def pixel(camera, p_W):
    R, d = rotation(camera["X_WC"]), [p_W[k] - camera["X_WC"][k] for k in range(3)]
    p_C = [sum(R[k][i] * d[k] for k in range(3)) for i in range(3)]
    x, y = p_C[0] / p_C[2], p_C[1] / p_C[2]
    r2 = x * x + y * y
    if camera["model"] == "division":
        scale = 2 / (1 + math.sqrt(1 - 4 * camera["K"] * r2))
        x, y = x * scale, y * scale
    else:
        radial = 1 + camera["k1"] * r2 + camera["k2"] * r2 * r2
        x, y = x * radial, y * radial
    return camera["fx"] * x + camera["cx"], camera["fy"] * y + camera["cy"]


CHIP = {"width": 768, "height": 572, "fx": 2000.0, "fy": 1990.0, "cx": 390.0, "cy": 280.0}
CAMERAS = {"left": {"model": "division", **CHIP, "K": -0.2, "X_WC": [-300.0, 0.0, 0.0, 0.0, 15.0, 0.0]},
           "right": {"model": "brown", **CHIP, "k1": -0.2, "k2": 0.1, "p1": 0, "p2": 0, "k3": 0,
                     "X_WC": [300.0, 10.0, 5.0, 2.0, -15.0, 1.0]},
           "upper": {"model": "division", **CHIP, "K": 0, "X_WC": [0.0, -250.0, 0.0, -14.0, 0.0, 0.0]}}
POINTS = {"hole": [20.0, -30.0, 1050.0], "corner": [-60.0, 40.0, 1120.0]}


class Triangulate(Case):
    def setUp(self):
        super().setUp()
        self.camera_file = self.write("stereo.json", json.dumps(CAMERAS))

    def rows(self, points=None, cameras=CAMERAS):
        return [(name, point, *pixel(CAMERAS[name], p_W)) for point, p_W in (points or POINTS).items() for name in cameras]

    def file(self, rows, covariance=""):
        lines = ["camera,point,u_px,v_px" + (",suu,svv,suv" if covariance else "")]
        lines += [f"{camera},{point},{u!r},{v!r}{covariance}" for camera, point, u, v in rows]
        return self.write("found.csv", "\n".join(lines) + "\n")

    def triangulate(self, rows, covariance=""):
        return run_json("triangulate", "--cameras", self.camera_file, "--observations", self.file(rows, covariance))

    def test_finds_the_points(self):
        for cameras in (("left", "right"), ("right", "upper"), CAMERAS):
            with self.subTest(cameras=cameras):
                status, answer, err = self.triangulate(self.rows(cameras=cameras))
                self.assertEqual((status, answer["status"], answer["reason"], err), (0, "ok", "", ""))
                self.assertEqual([p["point"] for p in answer["points"]], ["hole", "corner"])
                for point in answer["points"]:
                    self.expect_near(point["p_W"], POINTS[point["point"]], 1e-6)
                    self.assertLess(point["ray_gap_mm"], 1e-6)
                    self.assertEqual((point["code"], point["reason"]), (0, ""))
                    self.assertEqual([len(row) for row in point["covariance"]], [3] * 3)
                    self.assertEqual([d["camera"] for d in point["deviations"]], list(cameras))

    def test_covariance_scales_with_the_pixels(self):
        one = self.triangulate(self.rows())[1]["points"][0]["covariance"]
        tenth = self.triangulate(self.rows(), ",0.01,0.01,0")[1]["points"][0]["covariance"]
        for i in range(3):
            self.assertAlmostEqual(tenth[i][i] / one[i][i], 0.01, delta=1e-6)

    def test_for_people(self):
        status, out, err = run("triangulate", "--cameras", self.camera_file, "--observations", self.file(self.rows()))
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"20\.0000 +-30\.0000 +1050\.0000 .*  hole\n")

    def expect_no_place(self, rows, code, words, covariance=""):
        """Of the hole; the corner is given all the same."""
        status, answer, err = self.triangulate(rows, covariance)
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("point hole: ", answer["reason"])
        self.assertIn(words, answer["reason"])
        self.assertIn(words, err)
        hole, corner = answer["points"]
        self.assertEqual((hole["code"], hole["p_W"], hole["covariance"]), (code, None, None))
        self.assertIn(words, hole["reason"])
        self.expect_near(corner["p_W"], POINTS["corner"], 1e-6)
        return hole

    def test_one_camera(self):
        self.expect_no_place(self.rows()[:1] + self.rows()[3:], 303, "seen by 1 camera, the place of a point needs 2")

    def test_parallel_rays(self):
        far = self.rows({"hole": [0.0, 0.0, 5e6]}, ("left", "right"))
        self.expect_no_place(far + self.rows()[3:], 401, "parallel within their noise")

    def test_behind_a_camera(self):
        rows = [("left", "hole", -600.0, 280.0), ("right", "hole", 1400.0, 280.0)]
        self.expect_no_place(rows + self.rows()[3:], 402, "behind camera left")

    def test_contradiction(self):
        rows = self.rows()
        rows[1] = (*rows[1][:3], rows[1][3] + 0.5)
        self.assertEqual(self.triangulate(rows)[0], 0)  # half a pixel where one is the sigma
        hole = self.expect_no_place(rows, 403, "contradict each other", ",0.0004,0.0004,0")
        self.assertGreater(hole["ray_gap_mm"], 0.05)

    def test_no_points(self):
        status, answer, err = self.triangulate([])
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("no point", answer["reason"] + err)

    def test_wrong_input(self):
        found = self.file(self.rows())
        arguments = ("triangulate", "--cameras", self.camera_file, "--observations")
        self.expect_refused(run("triangulate"), "is required")
        self.expect_refused(run(*arguments, "/no/file"), "/no/file: found no such file")
        self.expect_refused(run(*arguments, found, "--what"), "--what")
        self.expect_refused(run("triangulate", "--cameras", found, "--observations", found), "found.csv")
        bad = self.write("bad.json", json.dumps({"left": {**CAMERAS["left"], "fx": 0}}))
        self.expect_refused(run("triangulate", "--cameras", bad, "--observations", found), "bad.json: left.fx: found 0")
        header = "camera,point,u_px,v_px\n"
        self.expect_refused(run(*arguments, self.write("a.csv", "camera,mark,u_px,v_px\n")),
                            "a.csv:1: found no column point", 'a.csv:1: found the unknown column "mark"')
        self.expect_refused(run(*arguments, self.write("b.csv", header + "middle,a,1,2\nleft,,nan,2\n")),
                            'b.csv:2: camera: found "middle", expected the name of a camera of the other file',
                            "b.csv:3: point", 'b.csv:3: u_px: found "nan"')
        self.expect_refused(run(*arguments, self.write("c.csv", header + "left,a,1,2\nleft,a,3,4\n")),
                            'c.csv:3: point: found "a" again in this camera, expected each point once per camera')
        self.expect_refused(run(*arguments, self.write("d.csv", "camera,point,u_px,v_px,suu,svv,suv\nleft,a,1,2,1,1,2\n")),
                            "d.csv:2: suv")

    def test_help(self):
        status, out, err = run("triangulate", "--help")
        self.assertEqual((status, err), (0, ""))
        for part in ("Usage:", "Example", "Exit status:", "--json", "zeropose triangulate"):
            self.assertIn(part, out)


if __name__ == "__main__":
    import sys
    unittest.main(argv=[sys.argv[0]], verbosity=1)
