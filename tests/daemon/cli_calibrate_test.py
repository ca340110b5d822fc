#!/usr/bin/env python3
"""zeropose calibrate points, calibrate views, calibrate vanishing and convert camera through the real program: cameras
made here from the formulas of spec 20, published measurements, wrong inputs.
Usage: cli_calibrate_test.py ZEROPOSE SOURCE_DIR"""
import json
import math
import pathlib
import random
import sys
import unittest
import xml.dom.minidom

from program import Case, page_texts, run, run_json

SOURCE = pathlib.Path(sys.argv[2])


def rotation(six):
    (cx, sx), (cy, sy), (cz, sz) = [(math.cos(math.radians(a)), math.sin(math.radians(a))) for a in six[3:]]
    return [[cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy]]


def into(six, p):
    """p_C of p_W for the frame X_WC."""
    R, d = rotation(six), [p[k] - six[k] for k in range(3)]
    return [sum(R[k][i] * d[k] for k in range(3)) for i in range(3)]


def out_of(six, p):
    R = rotation(six)
    return [sum(R[i][k] * p[k] for k in range(3)) + six[i] for i in range(3)]


def pixel(camera, p_C):
    """E2 of spec 20."""
    x, y = p_C[0] / p_C[2], p_C[1] / p_C[2]
    scale = 2 / (1 + math.sqrt(1 - 4 * camera["K"] * (x * x + y * y)))
    return camera["fx"] * x * scale + camera["cx"], camera["fy"] * y * scale + camera["cy"]


CAMERA = {"model": "division", "width": 768, "height": 572, "fx": 1930.0, "fy": 1925.0, "cx": 395.0, "cy": 279.0,
          "K": -0.2, "X_WC": [150.0, -220.0, 900.0, 172.0, 8.0, 15.0]}


class Points(Case):
    SIZE = ("--width", 768, "--height", 572)

    def points(self, sigma=0.0, wrong=None, flat=False):
        """Points all over the image between 700 and 1100 mm from the camera, or on one plane."""
        dice = random.Random(5)
        rows = ["x_mm,y_mm,z_mm,u_px,v_px"]
        while len(rows) < 81:
            z = dice.uniform(700, 1100)
            p_C = [dice.uniform(-0.19, 0.19) * z, dice.uniform(-0.14, 0.14) * z, z]
            p_W = out_of(CAMERA["X_WC"], p_C)
            if flat:
                p_W[2] = 0.0
            u, v = pixel(CAMERA, into(CAMERA["X_WC"], p_W))
            u, v = u + dice.gauss(0, sigma), v + dice.gauss(0, sigma)
            if len(rows) == wrong:
                u += 15
            rows.append(",".join(map(repr, [*p_W, u, v])))
        return self.write("points.csv", "\n".join(rows) + "\n")

    def calibrate(self, *more, **kind):
        return run_json("calibrate", "points", "--points", self.points(**kind), *self.SIZE, *more)

    def expect_camera(self, found, px, relative, mm, degrees):
        for key in ("fx", "fy", "cx", "cy"):
            self.assertAlmostEqual(found[key], CAMERA[key], delta=px, msg=key)
        self.assertAlmostEqual(found["K"], CAMERA["K"], delta=relative)
        for i in range(6):
            self.assertAlmostEqual(found["X_WC"][i], CAMERA["X_WC"][i], delta=mm if i < 3 else degrees, msg=i)

    def test_finds_the_camera(self):
        status, answer, err = self.calibrate("--refine", "joint", "--pitch-mm", 0.008325)
        self.assertEqual((status, answer["status"], answer["reason"]), (0, "ok", ""), err)
        self.expect_camera(answer["camera"], 1e-4, 1e-6, 1e-4, 1e-5)
        self.assertEqual((answer["camera"]["model"], answer["camera"]["width"]), ("division", 768))
        self.assertLess(answer["rms_px"], 1e-6)
        self.assertEqual(len(answer["deviations"]), 80)
        self.assertEqual(sorted(answer["deviations"][0]),
                         ["depth_mm", "dev_mm", "dev_px", "u_px", "used", "v_px"])
        sheet = answer["data_sheet"]
        self.assertAlmostEqual(sheet["f"], 0.008325 * CAMERA["fy"], delta=1e-5)
        self.assertAlmostEqual(sheet["Sx"], 0.008325 * CAMERA["fy"] / CAMERA["fx"], delta=1e-8)
        self.assertAlmostEqual(sheet["origin_from_centre"][0], 395 - 384, delta=1e-3)
        self.assertFalse(answer["diagnosis"]["coplanar"])
        self.assertTrue(answer["steps"])

    def test_sigmas_are_right(self):
        """The truth lies within four sigmas of every parameter, and the sigmas are those of 0.1 px."""
        status, answer, _ = self.calibrate("--refine", "joint", "--sigma-px", 0.1, sigma=0.1)
        self.assertEqual(status, 0)
        truth = {key: CAMERA[key] for key in ("fx", "fy", "cx", "cy", "K")}
        truth.update(zip(("x", "y", "z", "rx", "ry", "rz"), CAMERA["X_WC"]))
        found = {key: answer["camera"][key] for key in ("fx", "fy", "cx", "cy", "K")}
        found.update(zip(("x", "y", "z", "rx", "ry", "rz"), answer["camera"]["X_WC"]))
        self.assertEqual(sorted(answer["sigma"]), sorted(truth))
        for key, value in truth.items():
            self.assertGreater(answer["sigma"][key], 0)
            self.assertLess(abs(found[key] - value), 4 * answer["sigma"][key], key)
        self.assertEqual(answer["correlation"]["fx"]["fx"], 1)
        self.assertAlmostEqual(answer["correlation"]["cx"]["ry"], answer["correlation"]["ry"]["cx"], delta=1e-12)
        self.assertIn(answer["verdict"]["quality"], ("good", "usable"))

    def test_wrong_point_is_rejected_and_named(self):
        status, answer, _ = self.calibrate("--reject-px", 2, "--sigma-px", 0.05, wrong=33, sigma=0.05)
        self.assertEqual(status, 0)
        self.assertEqual([i for i, d in enumerate(answer["deviations"]) if not d["used"]], [32])
        self.assertAlmostEqual(answer["deviations"][32]["dev_px"][0], 15, delta=0.5)
        _, out, _ = run("calibrate", "points", "--points", self.points(wrong=33, sigma=0.05), *self.SIZE,
                        "--reject-px", 2)
        self.assertRegex(out, r"\n +33 .* rejected\n")
        self.assertIn("1 of 80 points were rejected", out)

    def test_held_parameters_stay(self):
        start = self.write("start.json", json.dumps(CAMERA))
        status, answer, _ = run_json("calibrate", "points", "--points", self.points(sigma=0.1), "--start", start, "--fix",
                                     "fx,fy,origin,K")
        self.assertEqual(status, 0)
        self.assertEqual(sorted(answer["sigma"]), ["rx", "ry", "rz", "x", "y", "z"])
        for key in ("fx", "fy", "cx", "cy", "K"):
            self.assertEqual(answer["camera"][key], CAMERA[key])
        status, answer, _ = run_json("calibrate", "points", "--points", self.points(sigma=0.1), "--start", start, "--fix",
                                     "pose")
        self.assertEqual(status, 0)
        self.assertNotIn("rx", answer["sigma"])
        for i in range(6):
            self.assertAlmostEqual(answer["camera"]["X_WC"][i], CAMERA["X_WC"][i], delta=1e-9)

    def test_frame_offset(self):
        _, lens, _ = self.calibrate()
        _, moved, _ = self.calibrate("--frame-offset-z-mm", 30)
        wanted = out_of(lens["camera"]["X_WC"], [0, 0, 30])
        for i in range(3):
            self.assertAlmostEqual(moved["camera"]["X_WC"][i], wanted[i], delta=1e-9)
            self.assertAlmostEqual(moved["camera"]["X_WC"][3 + i], lens["camera"]["X_WC"][3 + i], delta=1e-9)
        self.expect_refused(run("calibrate", "points", "--points", self.points(), *self.SIZE, "--frame-offset-z-mm", 30,
                                "--output", self.path("a.json")), "must not be used for measuring")

    def test_files(self):
        output, page, report = self.path("camera.json"), self.path("page.svg"), self.path("report.json")
        active = self.write("active.json", json.dumps({**CAMERA, "cx": CAMERA["cx"] + 2}))
        status, answer, err = self.calibrate("--refine", "joint", "--output", output, "--report", page, "--report-json", report, "--active",
                                             active)
        self.assertEqual(status, 0, err)
        saved = json.loads(output.read_text())
        self.assertEqual(saved, answer["camera"])
        self.assertEqual(json.loads(report.read_text()), answer)
        document = xml.dom.minidom.parse(str(page))
        texts = [node.firstChild.data for node in document.getElementsByTagName("text") if node.firstChild]
        for part in ("Parameters", "Histogram", "Steps", "Warnings", "difference"):
            self.assertIn(part, texts)
        self.assertAlmostEqual(answer["comparison"]["difference"]["cx"], -2, delta=1e-3)
        self.assertAlmostEqual(answer["comparison"]["worst_internals_px"], 2, delta=1e-3)
        # Nothing in use is overwritten silently, and the old one is kept when it is wanted.
        before = output.read_text()
        self.expect_refused(run("calibrate", "points", "--points", self.points(), *self.SIZE, "--output", output),
                            "the file exists", "--replace")
        self.assertEqual(output.read_text(), before)
        status, _, _ = self.calibrate("--output", output, "--replace")
        self.assertEqual(status, 0)
        self.assertEqual(self.path("camera.json.previous").read_text(), before)

    def test_published_measurement(self):
        """27 balls of Table 4.2; the fixed origin and result of Table 4.3 (tests/golden/README.md)."""
        table = SOURCE / "tests/golden/ball-27.csv"
        lines = [line.split(",") for line in table.read_text().split()]
        rows = ["x_mm,y_mm,z_mm,u_px,v_px"] + [
            ",".join([x, y, z, repr(float(u) + 384), repr(float(v) + 286)]) for u, v, x, y, z in lines[1:]]
        points = self.write("ball.csv", "\n".join(rows))
        status, answer, _ = run_json("calibrate", "points", "--points", points, *self.SIZE, "--residual", "algebraic",
                                     "--refine", "joint", "--fix", "cx,cy", "--origin", "366.10,271.80")
        self.assertEqual(status, 0)
        self.assertAlmostEqual(answer["camera"]["fx"], 1921.42, delta=0.006)
        self.assertAlmostEqual(answer["camera"]["fy"], 1928.59, delta=0.006)
        self.assertAlmostEqual(answer["camera"]["K"], -0.21096, delta=1e-5)

    def test_no_answer(self):
        points = self.points().read_text().splitlines()
        few = self.write("few.csv", "\n".join(points[:5]))
        status, answer, err = run_json("calibrate", "points", "--points", few, *self.SIZE)
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertTrue(answer["reason"])
        self.assertIn(answer["reason"], err)
        self.assertNotIn("camera", answer)
        status, answer, _ = self.calibrate("--method", "linear", flat=True)
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("plane", answer["reason"])

    def test_wrong_input(self):
        points = self.points()
        verb = ("calibrate", "points", "--points", points)
        self.expect_refused(run("calibrate", "points"), "--points is required")
        self.expect_refused(run(*verb), "--width and --height are required")
        self.expect_refused(run(*verb, *self.SIZE, "--fix", "cx,f"), '--fix: found "f", expected fx fy')
        self.expect_refused(run(*verb, *self.SIZE, "--origin", "1,2,3"), "--origin: found 3 numbers, expected 2")
        self.expect_refused(run(*verb, *self.SIZE, "--method", "magic"), "--method")
        self.expect_refused(run(*verb, *self.SIZE, "--start", "/no/file"), "/no/file: found no such file")
        poseless = self.write("poseless.json", json.dumps({k: v for k, v in CAMERA.items() if k != "X_WC"}))
        self.expect_refused(run(*verb, *self.SIZE, "--active", poseless), "poseless.json: found no X_WC")
        self.expect_refused(run("calibrate", "points", "--points", self.write("a.csv", "x_mm\n1\n"), *self.SIZE), "a.csv:1: found no column")


class Views(Case):
    # X_CB of a board of 8 x 6 points, 30 mm apart, before the camera.
    POSES = [[-100, -70, 850, 25, 0, 3], [-110, -80, 900, -25, 5, -10], [-90, -60, 800, 4, 28, 20],
             [-120, -70, 870, -5, -30, 40], [-100, -90, 820, 20, 22, -35]]
    BOARD = [[30 * i, 30 * j, 0] for j in range(6) for i in range(8)]

    def table(self, cameras, sigma_px=0.0):
        """cameras: name -> (camera, six numbers of the camera in the first camera's frame)"""
        noise = random.Random(3)
        lines = ["view,camera,x_mm,y_mm,z_mm,u_px,v_px"]
        for view, X_CB in enumerate(self.POSES):
            for name, (camera, X_FC) in cameras.items():
                for p in self.BOARD:
                    u, v = pixel(camera, into(X_FC, out_of(X_CB, p)))
                    u, v = u + noise.gauss(0, sigma_px), v + noise.gauss(0, sigma_px)
                    lines.append(",".join(map(repr, [view + 1, name, *p, u, v])).replace("'", ""))
        return self.write("views.csv", "\n".join(lines))

    def test_one_camera(self):
        path = self.table({"left": (CAMERA, [0] * 6)})
        page = self.path("page.svg")
        status, answer, err = run_json("calibrate", "views", "--points", path, "--width", 768, "--height", 572,
                                       "--report", page)
        self.assertEqual((status, answer["status"]), (0, "ok"), err)
        for name in ("fx", "fy", "cx", "cy"):
            self.assertAlmostEqual(answer["camera"][name], CAMERA[name], delta=1e-4)
        self.assertAlmostEqual(answer["camera"]["K"], CAMERA["K"], delta=1e-6)
        self.assertEqual([view["view"] for view in answer["views"]], ["1", "2", "3", "4", "5"])
        for view, six in zip(answer["views"], self.POSES):
            for found, true in zip(view["X_CB"], six):
                self.assertAlmostEqual(found, true, delta=1e-4)
        self.assertLess(answer["rms_px"], 1e-6)
        xml.dom.minidom.parse(str(page))

    def test_a_rig(self):
        right = dict(CAMERA, fx=1880.0, cx=370.0)
        X_FC = [60, 5, -10, 2, -4, 1]
        path = self.table({"left": (CAMERA, [0] * 6), "right": (right, X_FC)}, 0.05)
        status, answer, err = run_json("calibrate", "views", "--points", path, "--width", 768, "--height", 572,
                                       "--sigma-px", 0.05, "--report", self.path("rig.svg"))
        self.assertEqual((status, answer["status"]), (0, "ok"), err)
        self.assertAlmostEqual(answer["rms_px"], 0.05 * math.sqrt(2), delta=0.006)  # 480 points: 3.2 %, four of them
        X_WC = answer["cameras"]["right"]["X_WC"]
        for found, true, room in zip(X_WC, X_FC, [1.5, 1.5, 5, 0.3, 0.3, 0.05]):
            self.assertAlmostEqual(found, true, delta=room)
        self.assertEqual(len(answer["views"][0]["X_WB"]), 6)
        for name in ("rig-left.svg", "rig-right.svg"):
            xml.dom.minidom.parse(str(self.path(name)))

    def test_the_cameras_are_written(self):
        one = ["calibrate", "views", "--points", self.table({"left": (CAMERA, [0] * 6)}), "--width", 768, "--height", 572,
               "--output", self.path("camera.json")]
        self.assertEqual(run(*one)[0], 0)
        camera = json.loads(self.path("camera.json").read_text())
        self.assertAlmostEqual(camera["fx"], CAMERA["fx"], delta=1e-4)
        self.assertNotIn("X_WC", camera)  # nobody knows where it stands
        self.expect_refused(run(*one), "camera.json: the file exists")
        two = {"left": (CAMERA, [0] * 6), "right": (CAMERA, [60, 5, -10, 2, -4, 1])}
        status, _, err = run("calibrate", "views", "--points", self.table(two), "--width", 768, "--height", 572,
                             "--output", self.path("camera.json"), "--replace")
        self.assertEqual(status, 0, err)
        rig = json.loads(self.path("camera.json").read_text())
        self.assertAlmostEqual(rig["right"]["X_WC"][0], 60, delta=1e-3)

    def test_no_answer(self):
        path = self.table({"left": (CAMERA, [0] * 6)})
        lines = path.read_text().splitlines()
        one = self.write("one.csv", "\n".join(lines[:1] + [l for l in lines if l.startswith("1,")][:3]))
        status, answer, _ = run_json("calibrate", "views", "--points", one, "--width", 768, "--height", 572)
        self.assertEqual(status, 1)
        self.assertNotEqual(answer["reason"], "")
        self.assertNotIn("camera", {key for key in answer if answer[key]})

    def test_wrong_input(self):
        path = self.table({"left": (CAMERA, [0] * 6)})
        self.expect_refused(run("calibrate", "views", "--points", path), "--width and --height")
        self.expect_refused(run("calibrate", "views", "--points", path, "--width", 768, "--height", 572, "--fix", "x"),
                            'found "x"')
        self.expect_refused(run("calibrate", "views", "--points", "/no/file", "--width", 768, "--height", 572),
                            "/no/file")


class Vanishing(Case):
    FLAT = {**CAMERA, "K": 0.0}

    def test_published_table(self):
        for row in (SOURCE / "tests/golden/vanishing-results.csv").read_text().split()[1:]:
            count, cx, cy = row.split(",")[:3]
            status, answer, _ = run_json("calibrate", "vanishing", "--pairs",
                                         SOURCE / "tests/golden/vanishing-points.csv", "--first", count)
            self.assertEqual((status, answer["used"], answer["skipped"]), (0, int(count), []))
            self.assertAlmostEqual(answer["cx"], float(cx), delta=0.02)
            self.assertAlmostEqual(answer["cy"], float(cy), delta=0.02)

    def corners(self, poses, ratio=0.6, side=150.0):
        rows = ["image,corner,u_px,v_px"]
        for name, X_CO in poses.items():
            for i, (x, y) in enumerate(((0, 0), (1, 0), (1, ratio), (0, ratio))):
                u, v = pixel(self.FLAT, out_of(X_CO, [x * side, y * side, 0]))
                rows.append(f"{name},{i + 1},{u!r},{v!r}")
        return self.write("corners.csv", "\n".join(rows) + "\n")

    POSES = {"a": [-60, -40, 900, 35, 20, 10], "b": [-50, -40, 950, -30, 25, -20], "c": [-60, -30, 900, 25, -40, 35],
             "d": [-60, -40, 850, -40, -30, 5], "e": [-40, -40, 900, 15, 45, -40]}

    def test_camera_and_poses_from_corners(self):
        status, answer, err = run_json("calibrate", "vanishing", "--corners", self.corners(self.POSES), "--ratio", 0.6,
                                       "--side-mm", 150)
        self.assertEqual((status, answer["status"]), (0, "ok"), err)
        for key in ("fx", "fy", "cx", "cy"):
            self.assertAlmostEqual(answer[key], CAMERA[key], delta=1e-6)
        self.assertEqual([pose["image"] for pose in answer["poses"]], list(self.POSES))
        for pose in answer["poses"]:
            for found, wanted in zip(pose["X_CO"], self.POSES[pose["image"]]):
                self.assertAlmostEqual(found, wanted, delta=1e-6)

    def test_skipped_images_are_named(self):
        poses = {**self.POSES, "parallel": [0, 0, 800, 0, 0, 30]}
        status, answer, _ = run_json("calibrate", "vanishing", "--corners", self.corners(poses, 1), "--square",
                                     "--side-mm", 150)
        self.assertEqual((status, answer["used"]), (0, 5))
        self.assertEqual([s["image"] for s in answer["skipped"]], ["parallel"])
        self.assertIn("parallel to the chip", answer["skipped"][0]["reason"])
        page = self.path("page.svg")
        _, out, _ = run("calibrate", "vanishing", "--corners", self.corners(poses, 1), "--square", "--side-mm", 150,
                        "--report", page)
        self.assertIn("warning: image parallel skipped", out)
        texts = page_texts(page)
        for part in ("5 images of the rectangle were used.", "fx px", "%.2f" % answer["fx"], "a", "parallel", "1.0000"):
            self.assertIn(part, texts)

    def test_no_answer_and_wrong_input(self):
        pairs = SOURCE / "tests/golden/vanishing-points.csv"
        status, answer, err = run_json("calibrate", "vanishing", "--pairs", pairs, "--first", 2)
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("2 usable pairs", answer["reason"] + err)
        self.expect_refused(run("calibrate", "vanishing"), "one of --pairs and --corners")
        self.expect_refused(run("calibrate", "vanishing", "--corners", pairs), "--corners needs --side-mm")
        three = self.write("q.csv", "image,corner,u_px,v_px\na,1,0,0\na,1,9,0\na,5,9,9\n")
        self.expect_refused(run("calibrate", "vanishing", "--corners", three, "--side-mm", 1, "--ratio", 1),
                            "q.csv:3: corner: found 1 again", "q.csv:4: corner: found \"5\"")
        three = self.write("q.csv", "image,corner,u_px,v_px\na,1,0,0\na,2,9,0\na,3,9,9\n")
        self.expect_refused(run("calibrate", "vanishing", "--corners", three, "--side-mm", 1, "--ratio", 1),
                            'image "a": found 3 corners')


class ConvertCamera(Case):
    def test_there_and_back(self):
        brown = {"model": "brown", "width": 640, "height": 480, "fx": 500.25, "fy": 1501 / 3, "cx": 319.5, "cy": 240.125,
                 "k1": -0.25, "k2": 0.1, "p1": 1e-17, "p2": -0.002, "k3": 0.0}
        source = self.write("camera.json", json.dumps(brown))
        for form in ("opencv", "ros"):
            status, text, err = run("convert", "camera", "--from", "zeropose", "--to", form, source)
            self.assertEqual((status, err), (0, ""))
            status, back, err = run("convert", "camera", "--from", form, "--to", "zeropose", stdin=text)
            self.assertEqual(status, 0, err)
            found = json.loads(back)
            self.assertEqual(found["camera"] if form == "ros" else found, brown)  # exact, and no pose out of nothing

    def test_division_is_replaced_and_said(self):
        source = self.write("camera.json", json.dumps(CAMERA))
        status, answer, err = run_json("convert", "camera", "--from", "zeropose", "--to", "ros", source, "--name", "left")
        self.assertEqual((status, answer["camera"]["model"], answer["name"]), (0, "brown", "left"))
        self.assertLess(answer["worst_px"], 0.05)
        self.assertIn("camera_name: left\n", answer["text"])
        self.assertIn("wrong by up to", err)
        self.assertIn("X_WC has no place in this format", err)
        status, answer, _ = run_json("convert", "camera", "--from", "zeropose", "--to", "ros", source, "--max-residual-px",
                                     "1e-12")
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("--max-residual-px", answer["reason"])

    def test_brown_to_division_on_request(self):
        brown = {"model": "brown", "width": 768, "height": 572, "fx": 4000, "fy": 4000, "cx": 380, "cy": 290, "k1": -0.2,
                 "k2": 0.08, "p1": 0, "p2": 0, "k3": 0, "X_WC": CAMERA["X_WC"]}
        source = self.write("brown.json", json.dumps(brown))
        status, answer, _ = run_json("convert", "camera", "--from", "zeropose", "--to", "zeropose", "--model", "division",
                                     source)
        self.assertEqual((status, answer["camera"]["model"]), (0, "division"))
        self.assertAlmostEqual(answer["camera"]["K"], -0.2, delta=0.01)
        for found, wanted in zip(answer["camera"]["X_WC"], CAMERA["X_WC"]):
            self.assertAlmostEqual(found, wanted, delta=1e-9)

    def test_files_and_mistakes(self):
        source = self.write("camera.json", json.dumps(CAMERA))
        verb = ("convert", "camera", "--from", "zeropose", "--to", "opencv", source)
        output = self.path("camera.yml")
        self.assertEqual(run(*verb, "--output", output)[:2], (0, ""))
        self.assertTrue(output.read_text().startswith("%YAML:1.0\n---\nimage_width: 768\n"))
        self.expect_refused(run(*verb, "--output", output), "the file exists")
        self.expect_refused(run(*verb, "--model", "division"), "brown model only")
        self.expect_refused(run("convert", "camera", "--from", "opencv", "--to", "ros", stdin="a: [1"), "stdin")
        self.expect_refused(run("convert", "camera", "--from", "opencv", "--to", "maya", source), "--to")


class Help(Case):
    def test_every_verb_teaches(self):
        for verb in (("calibrate", "points"), ("calibrate", "vanishing"), ("convert", "camera")):
            status, out, err = run(*verb, "--help")
            self.assertEqual((status, err), (0, ""))
            for part in ("Usage:", "Example", "Exit status:", "--json", "zeropose " + " ".join(verb)):
                self.assertIn(part, out)
        _, out, _ = run("calibrate", "--help")
        for part in ("Which method when", "coplanar", "vanishing", "points"):
            self.assertIn(part, out)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]], verbosity=1)
