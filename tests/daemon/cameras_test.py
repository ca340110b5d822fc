#!/usr/bin/env python3
"""zeropose cameras snapshot and stream through the real program, on folders of pictures: nothing here touches a network.
Usage: cameras_test.py ZEROPOSE"""
import unittest

from program import Case, run, run_json


class Pictures(Case):
    def folder(self, grey=100, white=255):
        self.path("pictures").mkdir()
        pixels = bytes([grey]) * (40 * 30) if white == 255 else grey.to_bytes(2, "big") * (40 * 30)
        (self.path("pictures") / "img1.pgm").write_bytes(b"P5 40 30 %d\n" % white + pixels)
        return self.path("pictures")


class Snapshot(Pictures):
    def snapshot(self, *arguments):
        return run_json("cameras", "snapshot", "--out", self.path("out.png"), *arguments)

    def test_a_picture_of_a_folder_with_its_health(self):
        status, answer, err = self.snapshot("--folder", self.folder(), "--size", "40x30")
        self.assertEqual((status, answer["status"], answer["width_px"], answer["height_px"]), (0, "ok", 40, 30), err)
        self.assertEqual(answer["health"]["mean_grey"], 100)
        self.assertEqual(answer["health"]["saturated_share"], 0)
        self.assertIsNone(answer["health"]["focus_px"])
        self.assertTrue(self.path("out.png").read_bytes().startswith(b"\x89PNG"))

    def test_sixteen_bits_stay_sixteen(self):
        status, answer, err = self.snapshot("--folder", self.folder(900, 65535), "--size", "40x30")
        self.assertEqual((status, answer["white"]), (0, 1023 - 3), err)  # no pixel uses the lowest two bits
        self.assertEqual(self.path("out.png").read_bytes()[24], 16)  # IHDR: bit depth

    def test_what_is_missing_is_said(self):
        status, answer, _ = self.snapshot("--folder", self.path("none"), "--size", "40x30")
        self.assertEqual((status, answer["status"]), (1, "failed"))
        self.assertIn("there is no such folder", answer["reason"])
        status, answer, _ = self.snapshot("--folder", self.folder(), "--size", "50x30")
        self.assertEqual(status, 1)
        self.assertIn("img1.pgm has 40 x 30 px, expected are 50 x 30 px", answer["reason"])
        self.assertFalse(self.path("out.png").exists())

    def test_wrong_usage(self):
        out = ("cameras", "snapshot", "--out", self.path("out.png"))
        self.expect_refused(run(*out, "--size", "40x30"), "which camera?")
        self.expect_refused(run(*out, "--folder", "x"), "--size WIDTHxHEIGHT")


class Stream(Pictures):
    def test_saved_frames_have_a_folder_of_their_own(self):
        command = ("cameras", "stream", "--folder", self.folder(), "--size", "40x30", "--frames", "1", "--save",
                   self.path("saved"))
        self.assertEqual(run(*command)[0], 0)
        saved = list(self.path("saved").iterdir())
        self.assertEqual([file.name for file in saved], ["frame000001.png"])
        before = saved[0].stat().st_mtime_ns
        self.expect_refused(run(*command), "saved: there are files in it", "name a new folder")
        self.assertEqual(saved[0].stat().st_mtime_ns, before)


if __name__ == "__main__":
    unittest.main(argv=["cameras_test.py"])
