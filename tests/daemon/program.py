"""Runs the zeropose program for the tests beside this file; its path is their first argument."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.dom.minidom

PROGRAM = sys.argv[1]


def run(*arguments, stdin=""):
    done = subprocess.run([PROGRAM, *map(str, arguments)], input=stdin, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def run_json(*arguments, stdin=""):
    status, out, err = run(*arguments, "--json", stdin=stdin)
    assert out.count("\n") == 1 and out.endswith("\n"), f"one line of JSON expected: {out!r} {err!r}"
    return status, json.loads(out), err


def page_texts(path):
    """All words of a report's page; it must be XML."""
    document = xml.dom.minidom.parse(str(path))
    return [node.firstChild.data for node in document.getElementsByTagName("text") if node.firstChild]


class Case(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)

    def path(self, name):
        return pathlib.Path(self.directory.name) / name

    def write(self, name, text):
        self.path(name).write_text(text)
        return self.path(name)

    def expect_refused(self, answer, *fragments):
        """Wrong usage or unreadable input: status 2, nothing but messages on stderr."""
        status, out, err = answer
        self.assertEqual((status, out), (2, ""), err)
        for fragment in fragments:
            self.assertIn(fragment, err)

    def expect_near(self, found, wanted, tolerance):
        self.assertEqual(len(found), len(wanted))
        for a, b in zip(found, wanted):
            self.assertAlmostEqual(a, b, delta=tolerance)
