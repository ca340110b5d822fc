#!/usr/bin/env python3
"""zeropose plan through the real program. Usage: plan_test.py ZEROPOSE CELL"""
import json
import pathlib
import re
import sys
import unittest

from program import Case, run, run_json

CELL = pathlib.Path(sys.argv[2]).resolve()


class Plan(Case):
    def test_of_the_car_body(self):
        status, plan, _ = run_json("plan", "--cell", CELL)
        self.assertEqual((status, plan["status"], plan["reason"], plan["job"]), (0, "ok", "", "body"))
        self.assertEqual([p["name"] for p in plan["points"]], ["front left", "front right", "rear left", "rear right"])
        self.assertEqual(plan["sigma_mm"], max(p["sigma_mm"] for p in plan["points"]))
        self.assertEqual(plan["hidden_mm"], max(v["hidden_mm"] for v in plan["views"]))
        self.assertEqual((len(plan["views"]), len(plan["cameras"]), len(plan["weak_directions"])), (12, 4, 6))
        self.assertTrue(all(camera["references"]["points"] == 3 for camera in plan["cameras"]))
        # Better than the published differences of three known points to a laser tracker, root of the sum of squares.
        self.assertTrue(all(camera["references"]["sigma_mm"] < 1.25 for camera in plan["cameras"]))
        self.assertTrue(all(camera["references"]["sigma_deg"] < 0.021 for camera in plan["cameras"]))
        self.assertTrue(all(camera["without"]["sigma_mm"] > plan["sigma_mm"] for camera in plan["cameras"]))

    def test_noise_counts(self):
        _, good, _ = run_json("plan", "--cell", CELL)
        status, bad, _ = run_json("plan", "--cell", CELL, "--sigma-px", "5")
        self.assertEqual((status, bad["status"], bad["code"]), (1, "failed", 405))
        self.assertGreater(bad["sigma_mm"], 10 * good["sigma_mm"])

    def test_text_names_all_there_is(self):
        status, out, _ = run("plan", "--cell", CELL)
        self.assertEqual(status, 0)
        for word in ("front left", "camera3 camera3/2", "camera4: 3 marks", "camera2: 3 points", "worst point"):
            self.assertIn(word, out)

    def test_a_layout_in_which_nothing_checks_a_mark(self):
        cell = json.loads(re.sub(r"^\s*//.*$", "", CELL.read_text(), flags=re.M))
        cell["calibration"] = str(CELL.parent / cell["calibration"])
        job = cell["jobs"][0]
        job["marks"] = [mark for mark in job["marks"] if mark["cameras"] == ["camera1"]]
        job["requirements"].update(min_cameras=1, min_marks=3, max_sigma_mm=100, max_hidden_mm=3)
        status, plan, err = run_json("plan", "--cell", self.write("cell.json", json.dumps(cell)))
        self.assertEqual((status, plan["code"]), (1, 405), err)
        self.assertIn("nothing checks", plan["reason"])
        self.assertIsNone(plan["hidden_mm"])
        self.assertEqual(plan["cameras"][0]["without"]["verdict"]["code"], 301)

    def test_wrong_usage(self):
        self.expect_refused(run("plan", "--cell", CELL, "--job", "door"), "--job", '"door"', "body")
        self.expect_refused(run("plan", "--cell", CELL, "--sigma-px", "0"), "--sigma-px")
        self.expect_refused(run("plan", "--cell", self.path("none.json")), "none.json")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
