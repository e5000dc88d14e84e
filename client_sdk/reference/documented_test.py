#!/usr/bin/env python3
"""Every function of the C headers says what it gives, in words directly before it, and how it fails.

    documented_test.py HEADER...
"""

import re
import sys
import unittest

HEADERS = sys.argv[1:]


def functions():
    """(name, result, arguments, comment) of each function; no comment where none stands directly before it."""
    for header in HEADERS:
        with open(header, encoding="utf-8") as file:
            text = re.sub(r"^#.*$", "", file.read(), flags=re.M)
        for match in re.finditer(r"TESSERA_API ([^;(]*?)(tessera_[a-z_]+)\(([^;]*)\);", text):
            before = text[: match.start()].rstrip()
            comment = before[before.rindex("/*") :] if before.endswith("*/") else ""
            comment = " ".join(re.sub(r"[/*\n]+", " ", comment).split())
            yield match[2], match[1].strip(), match[3], "" if comment.startswith("---") else comment


class DocumentedTest(unittest.TestCase):
    def test_every_function_has_words_of_its_own(self):
        found = list(functions())
        self.assertGreater(len(found), 45)
        for name, _, _, comment in found:
            self.assertGreater(len(comment), 30, f"{name}: nothing stands before it")

    def test_what_can_fail_says_how(self):
        for name, result, _, comment in functions():
            if result == "tessera_code":
                self.assertRegex(comment, r"TESSERA_[A-Z]+_?[A-Z]+|annot fail", f"{name}: names no code")

    def test_what_fills_a_buffer_says_how_much_fits(self):
        for name, _, arguments, comment in functions():
            if "capacity" in arguments:
                self.assertIn("capacity", comment, name)

    def test_arrays_and_times_have_units(self):
        for name, _, arguments, comment in functions():
            if re.search(r"double \w+\[", arguments):
                self.assertRegex(comment, r"\bm\b|metres|looks from", f"{name}: in what unit?")
            if re.search(r"float \w+\[", arguments):
                self.assertRegex(comment, r"\(N\)|\(N m\)", f"{name}: in what unit?")
            if "double seconds" in arguments:
                self.assertIn("seconds", comment, name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
