#!/usr/bin/env python3
"""zeropose network through the real program, and on into the world by frame. Usage: network_test.py ZEROPOSE CELL"""
import csv
import math
import pathlib
import random
import sys
import unittest

from program import Case, run, run_json

CELL = pathlib.Path(sys.argv[2]).resolve()
HEAD = "station,point,x_mm,y_mm,z_mm\n"
# Places in A. B is turned by 90 degrees about z and lies at (1000, 200, 50).
PLACES = {"a": (0, 0, 0), "b": (2000, 100, 50), "c": (300, 1500, 20), "d": (700, 800, 900), "e": (1800, 1400, 400)}
STATION = {"A": lambda p: p, "B": lambda p: (p[1] - 200, 1000 - p[0], p[2] - 50)}


def rows(station, points, shift=None, scale=1.0):
    """The points as the station sees them; shift: {point: along its x axis}."""
    table = ""
    for name in points:
        x, y, z = (scale * number for number in STATION[station](PLACES[name]))
        table += f"{station},{name},{x + (shift or {}).get(name, 0)!r},{y!r},{z!r}\n"
    return table


class Network(Case):
    def network(self, table, *more, head=HEAD):
        return run_json("network", "--points", self.write("n.csv", head + table), *more)

    def test_the_second_station_is_carried_into_the_first(self):
        status, found, err = self.network(rows("A", "abcd") + rows("B", "bcde"), "--sigma-mm", "0.03")
        self.assertEqual((status, found["status"], found["what"], found["reference"]), (0, "ok", "ok", "A"), err)
        self.assertEqual((found["redundancy"], found["sigma_mm"]), (3, 0.03))
        self.assertEqual([s["station"] for s in found["stations"]], ["A", "B"])
        self.assertEqual([s["common_points"] for s in found["stations"]], [3, 3])
        self.expect_near(found["stations"][1]["X_AS"], (1000, 200, 50, 0, 0, 90), 1e-6)
        self.expect_near(found["stations"][1]["X_SA"], (-200, 1000, -50, 0, 0, -90), 1e-6)
        self.assertEqual(found["stations"][0]["sigma"], [0] * 6)
        for point in found["points"]:
            self.expect_near(point["p_A"], PLACES[point["point"]], 1e-6)
        # The place in A of what A measured itself is as good as that or better, of what only B saw worse.
        sigma = {p["point"]: max(p["sigma"]) for p in found["points"]}
        self.assertAlmostEqual(sigma["a"], 0.03, 9)
        self.assertLess(sigma["b"], 0.03)
        self.assertGreater(sigma["e"], 0.03)

    def test_sigma_from_the_residuals_or_of_every_row(self):
        noise = random.Random(1)
        table, own = "", ""
        for station in "AB":
            for name in PLACES:
                seen = ",".join(repr(x + noise.gauss(0, 0.05)) for x in STATION[station](PLACES[name]))
                table += f"{station},{name},{seen}\n"
                own += f"{station},{name},{seen},0.05\n"
        _, free, _ = self.network(table)
        # Nine degrees of freedom: chance leaves a factor outside 0.36..1.8 in one case of 1e4.
        self.assertTrue(0.018 < free["sigma_mm"] < 0.09, free["sigma_mm"])
        self.assertAlmostEqual(free["residual_ratio"], 1, 9)
        _, each, _ = self.network(own, head="station,point,x_mm,y_mm,z_mm,sigma_mm\n")
        self.assertIsNone(each["sigma_mm"])
        self.assertAlmostEqual(each["residual_ratio"], free["sigma_mm"] / 0.05, 6)
        self.expect_near(each["stations"][1]["X_AS"], free["stations"][1]["X_AS"], 1e-4)

    def test_a_wrong_point_is_named_and_has_no_place(self):
        output = self.path("out.csv")
        status, found, err = self.network(rows("A", "abcde") + rows("B", "abcde", {"c": 1.0}), "--sigma-mm", "0.03",
                                          "--output", output)
        self.assertEqual(status, 0, err)
        self.assertEqual([(o["station"], o["point"]) for o in found["observations"] if o["removed"]],
                         [("A", "c"), ("B", "c")])
        self.assertEqual([p["point"] for p in found["points"] if p["p_A"] is None], ["c"])
        with open(output, encoding="utf-8") as file:
            self.assertEqual([row["point"] for row in csv.DictReader(file)], list("abde"))
        _, text, _ = run("network", "--points", self.path("n.csv"), "--sigma-mm", "0.03")
        self.assertIn("c from B  left out", text)
        self.assertIn("c: its stations contradict each other", text)

    def test_no_answer(self):
        for table, what, reason in (
                (rows("A", "abcd"), "wrong_problem", "a network needs 2"),
                (rows("A", "abc") + rows("B", "bcde"), "too_few_points", "2 of 3 points (b, c)"),
                (rows("A", "ab") + rows("B", "cde"), "not_connected", "station B: no point in common"),
                (rows("A", "abcd") + rows("B", "abcd", scale=0.001), "other_units", "not the same unit"),
                (rows("A", "abc") + rows("B", "abc", {"b": 5}), "contradiction", "no single one explains it")):
            output = self.path("none.csv")
            status, found, err = self.network(table, "--sigma-mm", "0.03", "--output", output)
            self.assertEqual((status, found["status"], found["what"]), (1, "failed", what), err)
            self.assertIn(reason, found["reason"])
            self.assertFalse(output.exists())

    def test_on_into_the_world(self):
        """Three application points of the car body's job make W; the tracker saw the fourth from elsewhere."""
        places = {"front left": (-300, -750, 200), "front right": (-300, 750, 200), "rear left": (2800, -500, 300),
                  "rear right": (2800, 500, 300), "o": (0, 0, 0), "x, far": (2500, 0, 0), "y": (100, 1300, 0)}
        roles = {"o": "origin", "x, far": "x", "y": "xy"}

        def seen(station, names, angle, shift):
            table = ""
            for name in names:
                x, y, z = places[name]
                x, y = x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)
                role = roles.get(name, "") if station == "front" else ""
                table += f'{station},"{name}",{role},{x + shift!r},{y - shift!r},{z + 300!r}\n'
            return table

        table = seen("front", [n for n in places if n != "rear right"], 0.3, 2000)
        table += seen("rear", ["x, far", "y", "rear left", "rear right"], 2.9, -700)
        in_A, in_W = self.path("in_A.csv"), self.path("in_W.csv")
        status, found, err = self.network(table, "--output", in_A, head="station,point,role,x_mm,y_mm,z_mm\n")
        self.assertEqual(status, 0, (found, err))
        status, frame, err = run_json("frame", "--points", in_A, "--output", in_W)
        self.assertEqual(status, 0, (frame, err))
        for point in frame["points"]:
            self.expect_near(point["p_W"], places[point["point"]], 1e-6)
        job = self.write("job.csv", "".join(line for line in in_W.read_text().splitlines(keepends=True)
                                            if line.startswith(("point", "front", "rear"))))
        status, verdict, err = run_json("verify", "--cell", CELL, "--points", job, "--pose", "0,0,0,0,0,0")
        self.assertEqual((status, len(verdict["points"])), (0, 4), (verdict, err))
        self.assertLess(verdict["worst_mm"], 1e-6)
        self.expect_refused(run("frame", "--points", in_A, "--output", in_W), "the file exists")

    def test_the_example_of_the_help(self):
        lines = run("network", "--help")[1].splitlines()
        first = next(i for i, line in enumerate(lines) if line.strip().startswith("station, point, role,"))
        last = next(i for i, line in enumerate(lines) if line.strip().startswith("zeropose network"))
        table = "\n".join(line.strip() for line in lines[first:last]) + "\n"
        status, found, err = self.network(table, "--output", self.path("in_A.csv"), head="")
        self.assertEqual((status, found["redundancy"], len(found["points"])), (0, 3, 5), err)
        self.assertLess(found["sigma_mm"], 0.3)
        status, frame, err = run_json("frame", "--points", self.path("in_A.csv"))
        self.assertEqual((status, len(frame["points"])), (0, 5), err)

    def test_wrong_usage(self):
        def refused(table, *fragments, head=HEAD, more=()):
            self.expect_refused(run("network", "--points", self.write("w.csv", head + table), *more), *fragments)

        good = rows("A", "abcd") + rows("B", "abcd")
        refused(good + rows("B", "b"), '"b" again', "each point once per station")
        refused(good, '"D"', "expected one of: A, B", more=("--reference", "D"))
        refused("A,a,1,2,3,0.1\nB,a,1,2,3,\n", "sigma_mm", "or --sigma-mm", head=HEAD.replace("\n", ",sigma_mm\n"))
        refused("A,a,1,2,3,x\nB,a,1,2,3,xy\n", '"xy"', "already, x", head=HEAD.replace("\n", ",role\n"))
        refused("A,a,1,2,3,y\n", '"y"', "origin, x or xy", head=HEAD.replace("\n", ",role\n"))
        self.expect_refused(run("network", "--points", self.path("none.csv")), "none.csv")
        kept = self.write("kept.csv", "")
        refused(good, "the file exists", more=("--output", kept))
        self.assertEqual(run("network", "--points", self.path("w.csv"), "--output", kept, "--replace")[0], 0)
        self.assertTrue(kept.read_text().startswith("point,x_mm,y_mm,z_mm\na,"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
