#!/usr/bin/env python3
"""zeropose frame through the real program. Usage: frame_test.py ZEROPOSE"""
import sys
import unittest

from program import Case, run, run_json

HEAD = "point,role,x_mm,y_mm,z_mm\n"
# W is turned by 90 degrees about z and lies at (100, 200, 300): its x axis is y of T, its y axis -x of T.
THREE = "o,origin,100,200,300\nx1,x,100,1200,300\np1,xy,-700,500,300\n"


class Frame(Case):
    def test_three_two_one(self):
        status, frame, err = run_json("frame", "--points", self.write("p.csv", HEAD + THREE))
        self.assertEqual((status, frame["status"], frame["redundancy"]), (0, "ok", 0), err)
        self.expect_near(frame["X_TW"], (100, 200, 300, 0, 0, 90), 1e-9)
        self.expect_near(frame["X_WT"], (-200, 100, -300, 0, 0, -90), 1e-9)
        self.assertEqual((frame["sigma"], frame["sigma_mm"]), (None, None))

    def test_more_points_check_each_other(self):
        more = self.write("m.csv", HEAD + THREE + "p2,xy,-400,900,300\np3,xy,-100,1300,300.6\n")
        status, frame, err = run_json("frame", "--points", more)
        self.assertEqual((status, frame["redundancy"]), (0, 2), err)
        self.assertTrue(0.05 < frame["sigma_mm"] < 0.6)
        self.assertEqual([r["point"] for r in frame["residuals"]], ["o", "x1", "p1", "p2", "p3"])
        _, given, _ = run_json("frame", "--points", more, "--sigma-mm", "0.02")
        self.assertEqual(given["X_TW"], frame["X_TW"])
        for a, b in zip(given["sigma"], frame["sigma"]):
            self.assertAlmostEqual(a / b, 0.02 / frame["sigma_mm"], 9)

    def test_degenerate_layouts(self):
        for rows, reason in ((THREE.replace("xy", "x"), "no point for the xy plane"),
                             (THREE.replace("-700,500", "100,700"), "from the x axis"),
                             (THREE.replace("1200", "200"), "from the origin")):
            status, frame, _ = run_json("frame", "--points", self.write("d.csv", HEAD + rows))
            self.assertEqual((status, frame["status"]), (1, "failed"))
            self.assertIn(reason, frame["reason"])

    def test_points_without_a_role_are_carried_over(self):
        output = self.path("w.csv")
        status, frame, err = run_json("frame", "--points", self.write("p.csv", HEAD + THREE + '"q, 1",,100,1200,310\n'),
                                      "--output", output)
        self.assertEqual((status, frame["redundancy"], len(frame["residuals"])), (0, 0, 3), err)
        self.assertEqual([p["point"] for p in frame["points"]], ["o", "x1", "p1", "q, 1"])
        self.expect_near(frame["points"][3]["p_W"], (1000, 0, 10), 1e-9)
        _, text, _ = run("frame", "--points", self.path("p.csv"))
        self.assertRegex(text, r"in W, mm: +1000\.0000 +-?0\.0000 +10\.0000  q, 1\n$")
        lines = output.read_text().splitlines()
        self.assertEqual(lines[0], "point,x_mm,y_mm,z_mm")
        self.assertTrue(lines[4].startswith('"q, 1",1000,'), lines)

    def test_wrong_usage(self):
        self.expect_refused(run("frame", "--points", self.write("w.csv", HEAD + "a,z,1,2,3\n")), '"z"',
                            "origin, x or xy")
        self.expect_refused(run("frame", "--points", self.path("none.csv")), "none.csv")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
