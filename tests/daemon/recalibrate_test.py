#!/usr/bin/env python3
"""zeropose recalibrate and zeropose calibrate pose through the real program: cameras made here from the formulas of
spec 10 and 20, the published example of tables 4.9 and 4.10, wrong inputs. Usage: recalibrate_test.py ZEROPOSE SOURCE_DIR"""
import csv
import json
import math
import pathlib
import re
import sys
import unittest

from program import Case, page_texts, run, run_json

SOURCE = pathlib.Path(sys.argv[2])
CAMERA = {"model": "division", "width": 768, "height": 572, "fx": 4200, "fy": 4195, "cx": 383.5, "cy": 285.5,
          "K": -0.29, "X_WC": [900, -1500, 2100, -130, 12, 35]}
CHANGE = [9.86, 1.32, -7.63, 0.645, 2.097, 0.126]
TURN = [0, 0, 0, 0.645, 2.097, 0.126]


def rotation(six):
    (cx, sx), (cy, sy), (cz, sz) = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in six[3:]]
    return [[cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy]]


def out_of(six, p):
    R = rotation(six)
    return [sum(R[i][k] * p[k] for k in range(3)) + six[i] for i in range(3)]


def into(six, p):
    R, d = rotation(six), [p[k] - six[k] for k in range(3)]
    return [sum(R[k][i] * d[k] for k in range(3)) for i in range(3)]


def pixel(p_C, camera=CAMERA):
    x, y = p_C[0] / p_C[2], p_C[1] / p_C[2]
    scale = 2 / (1 + math.sqrt(1 - 4 * camera["K"] * (x * x + y * y)))
    return camera["fx"] * x * scale + camera["cx"], camera["fy"] * y * scale + camera["cy"]


def at(u, v, z):
    return [(u - CAMERA["cx"]) / CAMERA["fx"] * z, (v - CAMERA["cy"]) / CAMERA["fy"] * z, z]


POINTS = {"P1": at(60, 60, 2000), "P2": at(700, 60, 3000), "P3": at(700, 510, 2000), "P4": at(60, 510, 3000),
          "P5": at(380, 80, 2000), "P6": at(380, 490, 3000)}
PLATES = {"near": [*at(220, 240, 2050), 30, 20, 20], "far": [*at(540, 320, 2950), -35, -25, 10]}
CORNERS = {"P1": [90, 0, 0], "P2": [-45, 78, 0], "P3": [-45, -78, 0], "P4": [30, 20, 40]}


class Recalibrate(Case):
    def setUp(self):
        super().setUp()
        self.camera = self.write("camera.json", json.dumps(CAMERA))

    def table(self, name, header, rows):
        return self.write(name, header + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))

    def pixels(self, change, knocked=None):
        """before.csv and after.csv of the single points."""
        before = [(n, *map(repr, pixel(p))) for n, p in POINTS.items()]
        after = [(n, *map(repr, [x + (8 if n == knocked else 0) for x in pixel(into(change, p))]))
                 for n, p in POINTS.items()]
        return (self.table("b.csv", "point,u_px,v_px", before), self.table("a.csv", "point,u_px,v_px", after))

    def world(self):
        return self.table("p.csv", "point,x_mm,y_mm,z_mm",
                          [(n, *map(repr, out_of(CAMERA["X_WC"], p))) for n, p in POINTS.items()])

    def plates(self, change):
        points = {(g, n): out_of(pose, p) for g, pose in PLATES.items() for n, p in CORNERS.items()}
        header = "group,point,u_px,v_px"
        return (self.table("b.csv", header, [(*k, *map(repr, pixel(p))) for k, p in points.items()]),
                self.table("a.csv", header, [(*k, *map(repr, pixel(into(change, p)))) for k, p in points.items()]),
                self.table("p.csv", "point,x_mm,y_mm,z_mm", [(n, *p) for n, p in CORNERS.items()]))

    def arguments(self, method, before, after, points=None):
        extra = ["--points", points] if points else []
        return ["recalibrate", "--method", method, "--camera", self.camera, "--before", before, "--after", after, *extra]

    def expect_change(self, answer, change):
        self.expect_near(answer["X_CoCn"], change, 1e-5)
        new = out_of(CAMERA["X_WC"], out_of(change, [10, 20, 3000]))
        self.expect_near(out_of(answer["X_WC"], [10, 20, 3000]), new, 1e-4)

    def test_known_points(self):
        status, answer, err = run_json(*self.arguments("known", *self.pixels(CHANGE), self.world()))
        self.assertEqual((status, answer["status"], answer["reason"], err), (0, "ok", "", ""))
        self.expect_change(answer, CHANGE)
        self.assertEqual(len(answer["sigma"]), 6)
        self.assertEqual([len(row) for row in answer["covariance"]], [6] * 6)
        for row in answer["covariance"]:
            self.assertTrue(all(isinstance(x, float) for x in row))
        self.assertAlmostEqual(answer["sigma"][0] ** 2, answer["covariance"][0][0], delta=1e-9)
        self.assertEqual([d["point"] for d in answer["deviations"]], list(POINTS))
        self.assertLess(answer["rms_px"], 1e-5)
        status, out, _ = run(*self.arguments("known", *self.pixels(CHANGE), self.world()))
        self.assertEqual(status, 0)
        self.assertIn("9.8600", out)

    def test_the_page(self):
        page = self.path("page.svg")
        known = self.arguments("known", *self.pixels(CHANGE, knocked="P3"), self.world())
        status, answer, err = run_json(*known, "--report", page)
        self.assertEqual((status, answer["removed"]), (0, ["P3"]), err)
        texts = page_texts(page)
        for part in ("Moved camera", "5 of 6 points fit within %.3f px RMS." % answer["rms_px"], "%.3f" % answer["X_WC"][0],
                     "%.3f" % CAMERA["X_WC"][0], "point P3 was left out: it moved itself, by 11.31 px"):
            self.assertIn(part, texts)
        turned = self.arguments("arbitrary", *self.pixels(TURN))
        self.assertEqual(run(*turned, "--report", page)[0], 0)
        self.assertIn("The translation is neglected", " ".join(page_texts(page)))

    def test_the_camera_is_written_for_activation(self):
        arguments = [*self.arguments("known", *self.pixels(CHANGE), self.world()), "--output", self.path("new.json")]
        _, answer, _ = run_json(*arguments)
        written = json.loads(self.path("new.json").read_text())
        self.expect_near(written["X_WC"], answer["X_WC"], 1e-9)
        self.assertEqual(written["fx"], CAMERA["fx"])
        self.expect_refused(run(*arguments), "new.json: the file exists")

    def test_arbitrary_points(self):
        status, answer, _ = run_json(*self.arguments("arbitrary", *self.pixels(TURN)))
        self.assertEqual(status, 0)
        self.expect_change(answer, TURN)
        self.assertEqual(answer["sigma"][:3], [None] * 3)
        self.assertFalse(answer["translation_known"])
        self.assertEqual(answer["warnings"], [])
        status, answer, _ = run_json(*self.arguments("arbitrary", *self.pixels(CHANGE)))
        self.assertEqual(status, 0)
        self.assertIn("shifted as well", answer["warnings"][0])

    def test_groups(self):
        status, answer, _ = run_json(*self.arguments("groups", *self.plates(CHANGE)))
        self.assertEqual(status, 0, answer["reason"])
        self.expect_change(answer, CHANGE)
        self.assertEqual({d["group"] for d in answer["deviations"]}, set(PLATES))

    def test_a_knocked_point_is_named(self):
        status, answer, _ = run_json(*self.arguments("known", *self.pixels(CHANGE, "P3"), self.world()))
        self.assertEqual((status, answer["removed"]), (0, ["P3"]))
        self.expect_change(answer, CHANGE)
        out = run(*self.arguments("known", *self.pixels(CHANGE, "P3"), self.world()))[1]
        self.assertIn("P3  left out: it moved itself", out)

    def test_another_camera_is_refused(self):
        tables = [*self.pixels(CHANGE), self.world()]
        self.camera = self.write("other.json", json.dumps(dict(CAMERA, X_WC=[900, -1500, 2100, -130, 12, 95])))
        status, answer, _ = run_json(*self.arguments("known", *tables), "--output", self.path("new.json"))
        self.assertEqual((status, answer["X_WC"]), (1, None))
        self.assertIn("is this the camera", answer["reason"])
        self.assertFalse(self.path("new.json").exists())

    def test_wrong_tables(self):
        before, after = self.pixels(CHANGE)
        world = self.world()
        short = self.table("short.csv", "point,u_px,v_px", [(n, 1, 2) for n in list(POINTS)[:5]])
        self.expect_refused(run(*self.arguments("known", before, short, world)), 'b.csv:7', '"P6" without a partner')
        strange = self.table("strange.csv", "point,x_mm,y_mm,z_mm", [("X", 1, 2, 3)])
        self.expect_refused(run(*self.arguments("known", before, after, strange)), 'found "P1"', "strange.csv has")
        nan = self.table("nan.csv", "point,u_px,v_px", [(n, "nan", 2) for n in POINTS])
        self.expect_refused(run(*self.arguments("arbitrary", before, nan)), "nan.csv:2", "u_px")
        twice = self.table("twice.csv", "point,u_px,v_px", [("P1", 1, 2), ("P1", 3, 4)])
        self.expect_refused(run(*self.arguments("arbitrary", twice, twice)), '"P1" again')
        self.expect_refused(run(*self.arguments("groups", before, after, world)), "group")

    def test_wrong_usage(self):
        before, after = self.pixels(CHANGE)
        self.expect_refused(run(*self.arguments("known", before, after)), "--points is required")
        self.expect_refused(run(*self.arguments("arbitrary", before, after, self.world())), "--points is not used")
        self.expect_refused(run("recalibrate", "--method", "guess"), "guess")
        self.expect_refused(run(*self.arguments("known", before, "/no/such.csv", self.world())), "/no/such.csv")
        placeless = self.write("camera.json", json.dumps({k: v for k, v in CAMERA.items() if k != "X_WC"}))
        self.expect_refused(run(*self.arguments("known", before, after, self.world())), "X_WC", str(placeless))

    def test_what_cannot_give_an_answer(self):
        before, after = self.pixels(CHANGE)
        two = {n: self.table(n, "point,u_px,v_px", [("P1", 1, 2), ("P2", 3, 4)]) for n in ("b2.csv", "a2.csv")}
        status, answer, err = run_json(*self.arguments("known", two["b2.csv"], two["a2.csv"], self.world()))
        self.assertEqual((status, answer["status"], answer["X_WC"], answer["name"]), (1, "failed", None, "too_few_marks"))
        self.assertIn("needs 3", answer["reason"])
        line = self.table("line.csv", "point,x_mm,y_mm,z_mm", [(n, i, 2 * i, 0) for i, n in enumerate(POINTS)])
        status, answer, _ = run_json(*self.arguments("known", before, after, line))
        self.assertEqual((status, answer["name"]), (1, "geometry_degenerate"))


class FromWhatTheDaemonSaw(Case):
    """The shipped car-body cell; what `zeropose measure --json` answers is made here."""
    CELL = SOURCE / "config/cells/car-body.json"

    def setUp(self):
        super().setUp()
        plain = [re.sub(r"//.*", "", (SOURCE / "config/cells" / name).read_text())
                 for name in ("car-body.json", "car-body.calibration.json")]
        cell, calibration = map(json.loads, plain)
        self.camera = calibration["camera2"]
        self.points = {r["name"]: r["position_mm"] for r in cell["reference_points"] if r["cameras"] == ["camera2"]}
        self.references = [{"camera": "camera2", "point": name, "finding": "found",
                            "before_px": self.seen(p, [0] * 6), "after_px": self.seen(p, CHANGE)}
                           for name, p in self.points.items()]

    def seen(self, p, change):
        return list(pixel(into(change, into(self.camera["X_WC"], p)), self.camera))

    def recalibrate(self, references, *more, name="camera2"):
        measured = self.write("measured.json", json.dumps({"status": "not ok", "code": 601, "references": references}))
        return ["recalibrate", "--method", "known", "--cell", self.CELL, "--name", name, "--measured", measured, *more]

    def test_the_change_is_found_and_written(self):
        status, answer, _ = run_json(*self.recalibrate(self.references, "--output", self.path("new.json")))
        self.assertEqual((status, answer["reason"]), (0, ""))
        self.expect_near(answer["X_CoCn"], CHANGE, 1e-4)
        self.assertEqual([d["point"] for d in answer["deviations"]], list(self.points))
        self.assertEqual(answer["sigma_px"], 0.05)  # the cell's
        self.expect_near(json.loads(self.path("new.json").read_text())["camera2"]["X_WC"], answer["X_WC"], 1e-9)

    def test_what_is_not_seen_any_more_is_left_out(self):
        del self.references[1]["after_px"]
        status, answer, _ = run_json(*self.recalibrate(self.references))
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertEqual(len(answer["deviations"]), 0)

    def test_wrong_inputs(self):
        self.expect_refused(run(*self.recalibrate(self.references, name="camera9")), 'no camera "camera9"', "--name")
        self.expect_refused(run(*self.recalibrate(self.references, name="camera3")), 'no reference points of "camera3"')
        unknown = [dict(self.references[0], point="R9"), *self.references[1:]]
        self.expect_refused(run(*self.recalibrate(unknown)), "measured.json", '"R9"')
        early = [{k: v for k, v in r.items() if k != "before_px"} for r in self.references]
        self.expect_refused(run(*self.recalibrate(early)), "before_px", "zero measurement")
        arguments = self.recalibrate(self.references)
        self.write("measured.json", "{}")
        self.expect_refused(run(*arguments), "measured.json", "zeropose measure --json")
        self.path("measured.json").unlink()
        self.expect_refused(run(*arguments), "no such file")
        self.expect_refused(run(*arguments, "--before", "b.csv"), "--before")
        self.expect_refused(run("recalibrate", "--method", "known"), "which camera?")


class CalibratePose(Case):
    def published(self):
        rows = list(csv.DictReader((SOURCE / "tests/golden/pose-reference-points.csv").read_text().splitlines()))
        values = {}
        for row in rows:
            values.setdefault(row["kind"], []).append([float(row[c]) for c in "abcdef"])
        fx, fy, cx, cy, K, _ = values["internals-fx-fy-cx-cy-K"][0]
        camera = {"model": "division", "width": 768, "height": 572, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "K": K}
        points = [[x, y, z, u, v] for u, v, x, y, z, _ in values["point-u-v-x-y-z"]]
        self.points = self.write("p.csv", "x_mm,y_mm,z_mm,u_px,v_px\n" +
                                 "".join(",".join(map(str, p)) + "\n" for p in points))
        self.camera = self.write("camera.json", json.dumps(camera))
        feature = values["feature-in-camera-xyz"][0][:3]
        world = out_of(values["camera-pose-X_WC"][0], feature)
        self.feature = ["--feature=" + ",".join(map(str, feature)), "--feature-world=" + ",".join(map(repr, world))]
        return values["result-with-internals-X_WC"][0]

    def test_table_4_10(self):
        wanted = self.published()
        status, answer, err = run_json("calibrate", "pose", "--camera", self.camera, "--points", self.points, *self.feature)
        self.assertEqual((status, answer["status"], err), (0, "ok", ""))
        self.expect_near(answer["X_WC"][:3], wanted[:3], 0.01)
        self.expect_near(answer["X_WC"][3:], wanted[3:], 0.005)
        self.assertEqual((len(answer["sigma"]), len(answer["deviations"])), (6, 4))

    def test_the_page(self):
        wanted = self.published()
        page = self.path("page.svg")
        used = self.write("used.json", json.dumps({**json.loads(self.camera.read_text()), "X_WC": wanted}))
        pose = ["calibrate", "pose", "--camera", self.camera, "--points", self.points, *self.feature, "--report", page]
        status, answer, err = run_json(*pose, "--active", used)
        self.assertEqual(status, 0, err)
        texts = page_texts(page)
        for part in ("%.3f" % answer["X_WC"][0], "%.3f" % wanted[0], "%.4f" % answer["sigma"][3], "Points on the housing",
                     "Histogram", "4 of 4 points fit within %.3f px RMS." % answer["rms_px"]):
            self.assertIn(part, texts)
        self.expect_refused(run(*pose, "--active", self.camera), "found no X_WC")

    def test_framework(self):
        self.published()
        X_WC = [4636.4, 1632.1, -3815.99, -16.985, 20.201, -179.798]
        options = []
        for p in ([30, 20, -10], [-30, 20, -12], [0, -25, -40]):
            options += ["--feature=" + ",".join(map(str, p)), "--feature-world=" + ",".join(map(repr, out_of(X_WC, p)))]
        status, answer, _ = run_json("calibrate", "pose", "--camera", self.camera, *options)
        self.assertEqual(status, 0)
        self.expect_near(answer["X_WC"], X_WC, 1e-6)

    def test_wrong_inputs(self):
        self.published()
        base = ["calibrate", "pose", "--camera", self.camera]
        self.expect_refused(run(*base), "--points is required")
        self.expect_refused(run(*base, "--points", self.points, "--feature=1,2,3"), "expected as often")
        self.expect_refused(run(*base, "--points", self.points, "--feature=1,2", "--feature-world=1,2,3"), "X,Y,Z")
        few = self.write("few.csv", "x_mm,y_mm,z_mm,u_px,v_px\n1,2,3,4,5\n")
        status, answer, _ = run_json(*base, "--points", few)
        self.assertEqual((status, answer["status"], answer["X_WC"], answer["what"]), (1, "failed", None, "too_few_points"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
