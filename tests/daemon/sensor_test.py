#!/usr/bin/env python3
"""zeropose calibrate sensor through the real program: two ideal cameras of a sensor. Usage: sensor_test.py ZEROPOSE"""
import json
import math
import sys
import unittest

from program import Case, page_texts, run, run_json

FOCAL, BASE = 1000, 200
PLACES = [(-100, -80, 900), (110, -70, 1000), (90, 80, 850), (-90, 75, 1050), (20, 10, 950)]


def camera(x):
    return {"model": "division", "width": 1000, "height": 800, "fx": FOCAL, "fy": FOCAL, "cx": 500, "cy": 400, "K": 0,
            "X_WC": [x, 0, 0, 0, 0, 0]}


def seen(place, prefix="", suffix=""):
    """Rows of both cameras, which stand at -BASE / 2 and BASE / 2 and look along z."""
    x, y, z = place
    return "".join(f"{prefix}{name},{500 + FOCAL * (x - at) / z},{400 + FOCAL * y / z},{suffix}0.01,0.01,0\n"
                   for name, at in (("left", -BASE / 2), ("right", BASE / 2)))


class Sensor(Case):
    def setUp(self):
        super().setUp()
        self.write("s.json", json.dumps({"left": camera(-BASE / 2), "right": camera(BASE / 2)}))

    def calibrate(self, *more):
        return run_json("calibrate", "sensor", "--cameras", self.path("s.json"), "--points", self.path("p.csv"),
                        "--observations", self.path("o.csv"), *more)

    def stationary(self, places, wrong=0.0):
        """X_WS: turned by 90 degrees about z, at (1000, 2000, 50)."""
        known, rows = "point,x_mm,y_mm,z_mm\n", "point,camera,u_px,v_px,suu,svv,suv\n"
        for k, (x, y, z) in enumerate(places):
            known += f"p{k},{1000 - y},{2000 + x},{z + 50 + (wrong if k == 2 else 0)}\n"
            rows += seen((x, y, z), prefix=f"p{k},")
        self.write("p.csv", known)
        self.write("o.csv", rows)

    def test_in_the_world(self):
        self.stationary(PLACES)
        status, found, err = self.calibrate()
        self.assertEqual((status, found["status"], found["redundancy"]), (0, "ok", 9), err)
        self.expect_near(found["X_WS"], (1000, 2000, 50, 0, 0, 90), 1e-6)
        self.assertTrue(all(s > 0 for s in found["sigma"]))
        self.expect_near(found["points"][0]["p_S"], PLACES[0], 1e-6)

    def test_a_wrong_point_is_named(self):
        self.stationary(PLACES, wrong=5)
        status, found, err = self.calibrate()
        self.assertEqual((status, [p["point"] for p in found["points"] if p["removed"]]), (0, ["p2"]), err)

    def test_the_page(self):
        page = self.path("page.svg")
        self.stationary(PLACES, wrong=5)
        self.calibrate("--report", page, "--active", "1000,2000,49,0,0,90")
        texts = page_texts(page)
        for part in ("2000.000", "49.000", "1.000", "p4", "Camera left", "Camera right", "4 of 5 points fit within 0.000 mm RMS.",
                     "left out: it contradicts the others"):
            self.assertIn(part, texts)
        self.calibrate(*self.hand(PLACES), "--report", page)
        self.assertIn("X_HS, the sensor in the hand", page_texts(page))

    def test_points_on_a_line(self):
        self.stationary([(0, 10 * k, 900) for k in range(4)])
        status, found, _ = self.calibrate()
        self.assertEqual((status, found["status"], found["X_WS"]), (1, "failed", None))
        self.assertIn("on a line", found["reason"])

    def hand(self, places):
        """X_HS is (10, 20, 100) without a turn; the hand is not turned either: X_RH = p_R - p_S - p_HS."""
        robot, rows = "view,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n", "view,point,camera,u_px,v_px,suu,svv,suv\n"
        for k, (x, y, z) in enumerate(places):
            robot += f"{k},{800 - x - 10},{100 - y - 20},{1500 - z - 100},0,0,0\n"
            rows += seen((x, y, z), prefix=f"{k},tip,")
        self.write("p.csv", "point,x_mm,y_mm,z_mm\ntip,800,100,1500\n")
        self.write("o.csv", rows)
        return "--robot", self.write("r.csv", robot)

    def test_on_the_hand(self):
        status, found, err = self.calibrate(*self.hand(PLACES))
        self.assertEqual((status, found["status"]), (0, "ok"), err)
        self.expect_near(found["X_HS"], (10, 20, 100, 0, 0, 0), 1e-6)
        self.assertEqual([p["view"] for p in found["points"]], ["0", "1", "2", "3", "4"])

    def test_the_missing_motion_is_named(self):
        status, found, _ = self.calibrate(*self.hand([(20 * k, 0, 900) for k in range(4)]))
        self.assertEqual((status, found["what"]), (1, "collinear"))
        self.assertIn("move the hand in a second direction", found["reason"])
        status, found, _ = self.calibrate(*self.hand(PLACES[:2]))
        self.assertEqual((status, found["what"]), (1, "too_few_points"))
        self.assertIn("more positions of the hand", found["reason"])

    def test_known_positions_of_a_board_on_a_stage(self):
        """The world is the stage's; the camera stands 600 mm before its zero, 40 mm to the right."""
        rows, poses = "view,x_mm,y_mm,u_px,v_px\n", "view,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n"
        for k, at in enumerate((0, 60, 120)):
            poses += f"{k},0,0,{at},0,0,0\n"
            for x in range(-120, 121, 40):
                for y in range(-120, 121, 40):
                    rows += f"{k},{x},{y},{500 + FOCAL * (x - 40) / (600 + at)},{400 + FOCAL * y / (600 + at)}\n"
        views = ("calibrate", "views", "--points", self.write("v.csv", rows), "--width", 1000, "--height", 800)
        status, found, err = run_json(*views, "--poses", self.write("stage.csv", poses))
        self.assertEqual((status, found["status"]), (0, "ok"), err)
        self.expect_near(found["camera"]["X_WC"], (40, 0, -600, 0, 0, 0), 1e-4)
        self.assertAlmostEqual(found["camera"]["fx"], FOCAL, 3)
        self.expect_near(found["views"][2]["X_WB"], (0, 0, 120, 0, 0, 0), 1e-9)
        self.expect_refused(run(*views, "--poses", self.write("more.csv", poses + "9,0,0,0,0,0,0\n")), '"9"',
                            "has no points")

    def turned_stage(self, turn_deg):
        """Two cameras, 300 mm apart, without lens errors; the board moves along an axis turned about its y."""
        rows, poses = "view,camera,x_mm,y_mm,u_px,v_px\n", "view,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n"
        sine, cosine = math.sin(math.radians(turn_deg)), math.cos(math.radians(turn_deg))
        for k, at in enumerate((0, 60, 120)):
            poses += f"{k},0,0,{at},0,0,0\n"
            for name, tilt in (("left", 15), ("right", -15)):
                s, c = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
                for x in range(-120, 121, 40):
                    for y in range(-120, 121, 40):
                        along, across = x + at * sine + 600 * s, at * cosine + 600 * c
                        u, w = c * along - s * across, s * along + c * across
                        rows += f"{k},{name},{x},{y},{500 + FOCAL * u / w},{400 + FOCAL * y / w}\n"
        return ("calibrate", "views", "--points", self.write("v.csv", rows), "--poses", self.write("stage.csv", poses),
                "--width", 1000, "--height", 800, "--sigma-px", 0.1, "--one-focal")

    def test_a_stage_that_is_not_parallel_to_its_board(self):
        views = self.turned_stage(0.3)
        status, found, err = run_json(*views, "--stage", "estimate", "--report", self.path("page.svg"))
        self.assertEqual((status, found["status"]), (0, "ok"), err)
        self.assertEqual((found["stage"]["axes"], found["stage"]["unknowns"]), ("estimated", 2))
        self.expect_near(found["stage"]["X_BS"], (0, 0, 0, 0, 0.3, 0), 1e-4)
        self.assertGreater(found["stage"]["sigma"][4], 0)
        self.assertEqual(found["stage"]["sigma"][5], 0)
        self.assertAlmostEqual(found["cameras"]["left"]["fx"], FOCAL, 2)
        self.assertAlmostEqual(found["views"][2]["X_WB"][0], 120 * math.sin(math.radians(0.3)), 4)
        self.assertIn("ry 0.300", self.path("page-left.svg").read_text())
        self.assertIn("the stage's axes: estimated: turned against the board's by", run(*views, "--stage", "estimate")[1])

        status, held, err = run_json(*views)
        self.assertEqual((status, held["stage"]["axes"]), (0, "held"), err)
        self.assertAlmostEqual(held["stage"]["X_BS"][4], 0.3, 3)
        self.assertGreater(held["rms_px"], 2 * held["stage"]["rms_px"])
        self.assertTrue(any("axes seem turned" in warning for warning in held["diagnosis"]["warnings"]), held)
        status, none, _ = run_json(*self.turned_stage(0))
        self.assertFalse(any("stage" in warning for warning in none["diagnosis"]["warnings"]), none)

    def test_a_stage_needs_known_poses(self):
        views = self.turned_stage(0)
        self.expect_refused(run(*views[:4], *views[6:], "--stage", "estimate"), "--stage estimate", "give --poses")

    def test_wrong_usage(self):
        self.stationary(PLACES)
        self.write("o.csv", "point,camera,u_px,v_px\np9,left,1,2\np1,middle,1,2\np1,left,1,2\np1,left,1,2\n")
        self.expect_refused(run("calibrate", "sensor", "--cameras", self.path("s.json"), "--points",
                                self.path("p.csv"), "--observations", self.path("o.csv")), '"p9"', '"middle"',
                            '"p1" again')


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
