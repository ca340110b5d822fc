#!/usr/bin/env python3
"""zeropose verify through the real program. Usage: verify_test.py ZEROPOSE CELL"""
import pathlib
import re
import sys
import unittest

from program import Case, run, run_json

CELL = pathlib.Path(sys.argv[2]).resolve()
HEAD = "mark,point,x_mm,y_mm,z_mm\n"


class Verify(Case):
    def points(self, shift=0.0):
        """Two application points and a mark of the car body at x + 10, the last one off by shift."""
        return self.write("v.csv", HEAD + ",front left,-290,-750,200\n,rear right,2810,500,300\n"
                          f"camera1/1,,-515.64,-751.88,{200.92 + shift}\n")

    def verify(self, *more):
        return run_json("verify", "--cell", CELL, *more)

    def test_points_where_they_are_expected(self):
        status, found, err = self.verify("--points", self.points(0.25), "--pose", "10,0,0,0,0,0")
        self.assertEqual((status, found["status"], found["reason"], found["job"]), (0, "ok", "", "body"), err)
        self.assertEqual([p["point"] for p in found["points"]], ["front left", "rear right", "camera1/1"])
        self.assertEqual(found["worst"], "camera1/1")
        self.assertAlmostEqual(found["worst_mm"], 0.25, 9)
        self.assertAlmostEqual(found["rms_mm"], 0.25 / 3 ** 0.5, 9)
        self.expect_near(found["mean_mm"], (0, 0, 0.25 / 3), 1e-9)
        self.assertRegex(found["date"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        self.assertIsNone(found["zero_time"])

    def test_a_turned_pose_turns_the_points(self):
        table = self.write("t.csv", "point,x_mm,y_mm,z_mm\nfront left,750,-300,200\n")
        status, found, err = self.verify("--points", table, "--pose", "0,0,0,0,0,90")
        self.assertEqual(status, 0, err)
        self.assertLess(found["worst_mm"], 1e-9)

    def test_beyond_the_limit(self):
        status, found, err = self.verify("--points", self.points(1.5), "--pose", "10,0,0,0,0,0")
        self.assertEqual((status, found["status"]), (1, "failed"), err)
        self.assertEqual(found["reason"], "1 of 3 points are farther than 1.00 mm from where they are expected, the "
                                          "worst is camera1/1 with 1.500 mm")
        status, _, _ = self.verify("--points", self.points(1.5), "--pose", "10,0,0,0,0,0", "--max-mm", "1.6")
        self.assertEqual(status, 0)

    def test_no_zero(self):
        status, found, _ = self.verify("--points", self.points(), "--state", self.directory.name)
        self.assertEqual((status, found["status"]), (1, "failed"))
        self.assertTrue(re.search("zero", found["reason"]), found["reason"])

    def test_wrong_usage(self):
        self.expect_refused(run("verify", "--cell", CELL, "--points", self.points()), "--state or --pose")
        self.expect_refused(run("verify", "--cell", CELL, "--points", self.points(), "--state", self.path("none")),
                            "none: no such folder")
        pose = "--pose", "0,0,0,0,0,0"
        table = self.write("w.csv", HEAD + "door,,1,2,3\n,roof,1,2,3\ncamera1/1,front left,1,2,3\n,,1,2,3\n")
        self.expect_refused(run("verify", "--cell", CELL, "--points", table, *pose), '"door"', "a mark of job",
                            '"roof"', "an application point of job", "beside a mark")
        self.expect_refused(run("verify", "--cell", CELL, "--points", self.points(), *pose, "--job", "door"), '"door"')


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
