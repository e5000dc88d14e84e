#!/usr/bin/env python3
"""Holds the Python binding against a compiler and the library.

    binding_test.py COMPILER INCLUDE_DIR CLIENT_LIBRARY
"""

import ctypes
import importlib
import os
import subprocess
import sys
import tempfile
import unittest

COMPILER, INCLUDE, CLIENT = sys.argv[1:4]
HERE = os.path.dirname(os.path.abspath(__file__))
FOLDER = tempfile.TemporaryDirectory()


def make_binding():
    headers = [os.path.join(INCLUDE, "tessera", name) for name in ("tessera.h",)]
    with open(os.path.join(FOLDER.name, "tessera.py"), "w", encoding="utf-8") as out:
        subprocess.run([sys.executable, os.path.join(HERE, "make_binding.py")] + headers, stdout=out, check=True)
    sys.path[:0] = [FOLDER.name, HERE]
    return importlib.import_module("tessera")


t = make_binding()


def structs():
    classes = [one for one in vars(t).values() if isinstance(one, type) and issubclass(one, ctypes.Structure)]
    return [one for one in classes if hasattr(one, "_fields_")]


class BindingTest(unittest.TestCase):
    def compiled(self, lines):
        """What a program prints that includes the headers."""
        source, program = os.path.join(FOLDER.name, "layout.cpp"), os.path.join(FOLDER.name, "layout")
        with open(source, "w", encoding="utf-8") as file:
            file.write("#include <cstddef>\n#include <cstdio>\n#include <tessera/tessera.h>\nint main() {\n")
            file.write("\n".join(lines) + "\n}\n")
        subprocess.run([COMPILER, "-I", INCLUDE, source, "-o", program], check=True)
        return subprocess.run([program], check=True, capture_output=True, text=True).stdout.split("\n")

    def test_every_struct_lies_in_memory_as_the_compiler_lays_it(self):
        lines, expected = [], []
        for struct in structs():
            name = struct.__name__
            lines.append(f'std::printf("{name} %zu\\n", sizeof({name}));')
            expected.append(f"{name} {ctypes.sizeof(struct)}")
            for field, _ in struct._fields_:
                lines.append(f'std::printf("{name}.{field} %zu\\n", offsetof({name}, {field}));')
                expected.append(f"{name}.{field} {getattr(struct, field).offset}")
        self.assertGreater(len(expected), 120)
        self.assertEqual(self.compiled(lines)[:-1], expected)

    def test_structs_begin_as_the_initialisers_make_them(self):
        for struct in structs():
            if struct._fields_[0][0] == "size":
                self.assertEqual(struct().size, ctypes.sizeof(struct), struct.__name__)
        self.assertEqual(list(t.tessera_body().orientation), [0, 0, 0, 1])
        self.assertEqual(t.tessera_grant_options().deadline_ms, 10000)
        self.assertEqual(t.tessera_grant_options(deadline_ms=5).deadline_ms, 5)
        with self.assertRaises(AttributeError):
            t.tessera_body(nonsense=1)

    def test_every_function_is_in_the_library(self):
        library = t.load(CLIENT)
        self.assertGreater(len(t._FUNCTIONS), 40)
        for name in t._FUNCTIONS:
            self.assertTrue(hasattr(library, name), name)

    def test_an_error_is_an_exception_with_its_line(self):
        library = t.load(CLIENT)
        client = ctypes.c_void_p()
        code = library.tessera_join_grant(b"abc", 3, None, ctypes.byref(client))
        with self.assertRaises(t.Error) as raised:
            t.check(library, code)
        self.assertEqual(raised.exception.code, t.TESSERA_INVALID_ARGUMENT)
        self.assertIn("grant", raised.exception.line)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
