#!/usr/bin/env python3
"""Holds the C# binding against a C++ compiler and the libraries, and runs its layer and its sample.

    csharp_test.py COMPILER INCLUDE_DIR LIBRARY_DIR FAKE_INSTANCE

Compiles with mcs and runs with mono. Where neither is there, only Native.cs is compared with the headers, and a line
says so; ./dev test installs both.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

COMPILER, INCLUDE, LIBRARIES, FAKE_INSTANCE = sys.argv[1:5]
HERE = os.path.dirname(os.path.abspath(__file__))
FOLDER = tempfile.TemporaryDirectory()
HEADERS = [os.path.join(INCLUDE, "tessera", name) for name in ("tessera.h", "connect.h", "local.h")]
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)
import make_csharp  # noqa: E402

HAVE_MONO = shutil.which("mcs") and shutil.which("mono")
if not HAVE_MONO:
    print("csharp_test: mcs or mono is not installed: only the declarations are checked", file=sys.stderr)


def made(name):
    return os.path.join(FOLDER.name, name)


def compiled(name, sources, *options):
    command = ["mcs", "-langversion:7.2", "-warnaserror", "-warn:4", f"-out:{made(name)}", *options]
    subprocess.run(command + [os.path.join(HERE, one) for one in sources], check=True)
    return made(name)


def run(*command, check=True):
    environment = dict(os.environ, LD_LIBRARY_PATH=LIBRARIES, LC_ALL="C.UTF-8")
    return subprocess.run(command, check=check, capture_output=True, text=True, encoding="utf-8", env=environment)


def layout_in_c(headers):
    """A program that prints where each field lies, and each initialiser byte by byte."""
    yield "#include <cstddef>\n#include <cstdio>\n#include <tessera/connect.h>\n#include <tessera/local.h>\n"
    yield 'template <class T> void Show(const char* name, const T& one) {\n  std::printf("%s", name);\n'
    yield "  for (std::size_t i = 0; i < sizeof one; ++i) {\n"
    yield '    std::printf(" %u", reinterpret_cast<const unsigned char*>(&one)[i]);\n  }\n  std::printf("\\n");\n}\n'
    yield "int main() {\n"
    for struct, fields in headers.structs.items():
        yield f'  std::printf("{struct} %zu\\n", sizeof({struct}));\n'
        for name, _ in fields:
            yield f'  std::printf("{struct}.{name} %zu\\n", offsetof({struct}, {name}));\n'
        if headers.initialiser_of(struct):
            yield f'  {{\n    static const {struct} one = {struct.upper()};\n    Show("{struct}", one);\n  }}\n'
    yield "}\n"


def layout_in_csharp(headers):
    yield "using System;\nusing System.Runtime.InteropServices;\nusing Tessera.Native;\n\n"
    yield "static unsafe class Layout {\n  static void Show(string name, void* one, int size) {\n"
    yield "    Console.Write(name);\n"
    yield '    for (int i = 0; i < size; ++i) Console.Write(" {0}", ((byte*)one)[i]);\n    Console.WriteLine();\n  }\n'
    yield "  static void Main() {\n"
    for struct, fields in headers.structs.items():
        yield f'    Console.WriteLine("{struct} {{0}}", sizeof({struct}));\n'
        for name, _ in fields:
            yield f'    Console.WriteLine("{struct}.{name} {{0}}", Marshal.OffsetOf(typeof({struct}), "{name}"));\n'
        if headers.initialiser_of(struct):
            yield f"    {{\n      {struct} one = {struct}.Initial;\n"
            yield f'      Show("{struct}", &one, sizeof({struct}));\n    }}\n'
    yield "  }\n}\n"


class CsharpTest(unittest.TestCase):
    def test_the_declarations_are_those_of_the_headers(self):
        headers = make_csharp.read_headers(HEADERS)
        with open(made("Native.cs"), "w", encoding="utf-8") as out:
            make_csharp.write(headers, out)
        with open(made("Native.cs"), encoding="utf-8") as new, open(os.path.join(HERE, "Native.cs"), encoding="utf-8") as old:
            self.assertEqual(new.read(), old.read(), "run client_sdk/csharp/make_csharp.py: see its head")
        self.assertGreater(len(headers.functions), 50)

    def test_no_array_and_no_initialiser_is_guessed(self):
        headers = make_csharp.Headers()
        headers.read("#define TESSERA_X { sizeof(tessera_x), {{1}} }\n"
                     "typedef struct tessera_x { uint32_t size; double a[2][2]; } tessera_x;", "tessera")
        with self.assertRaisesRegex(SystemExit, "tessera_x.a"):
            list(make_csharp.assignments(headers, "tessera_x", make_csharp.parsed(headers.initialiser_of("tessera_x"))))
        headers.read("typedef struct tessera_y { const char* names[3]; } tessera_y;", "tessera")
        with self.assertRaisesRegex(SystemExit, "names"):
            make_csharp.field(headers, *headers.structs["tessera_y"][0])


@unittest.skipUnless(HAVE_MONO, "mcs and mono are not installed")
class CompiledTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.library = compiled("Tessera.dll", ["Native.cs", "Values.cs", "World.cs", "Connect.cs"], "-unsafe", "-target:library")

    def program(self, name, *sources):
        return compiled(name, sources, f"-r:{self.library}", "-r:System.Core", "-unsafe")

    def test_structs_lie_in_memory_and_begin_as_the_c_compiler_makes_them(self):
        headers = make_csharp.read_headers(HEADERS)
        for name, lines in (("layout.cpp", layout_in_c(headers)), ("Layout.cs", layout_in_csharp(headers))):
            with open(made(name), "w", encoding="utf-8") as file:
                file.writelines(lines)
        subprocess.run([COMPILER, "-I", INCLUDE, made("layout.cpp"), "-o", made("layout")], check=True)
        in_c = run(made("layout")).stdout.split("\n")
        in_csharp = run("mono", self.program("Layout.exe", made("Layout.cs"))).stdout.split("\n")
        self.assertGreater(len(in_c), 150)
        self.assertEqual(in_c, in_csharp)

    def test_the_layer_plays_in_a_world_of_its_own(self):
        played = run("mono", "--debug", self.program("world_test.exe", "test/WorldTest.cs"), check=False)
        self.assertEqual(played.returncode, 0, played.stdout + played.stderr)
        self.assertIn("AllBodiesComeInOneSpanAndMove", played.stdout)

    def test_the_sample_plays_by_a_grant(self):
        world_test, drifter = self.program("world_test.exe", "test/WorldTest.cs"), self.program("drifter.exe", "sample/Drifter.cs")
        with subprocess.Popen([FAKE_INSTANCE], stdout=subprocess.PIPE, text=True) as instance:
            try:
                address = instance.stdout.readline().strip()
                run("mono", world_test, "grant", address, "plaza-1", made("grant"))
                played = run("mono", "--debug", drifter, made("grant"), "2", check=False)
            finally:
                instance.kill()
        self.assertEqual(played.returncode, 0, played.stdout + played.stderr)
        self.assertRegex(played.stdout, "player [0-9]+ in plaza")
        self.assertIn("2 bodies", played.stdout)

    def test_the_sample_says_what_is_wrong(self):
        with open(made("damaged"), "wb") as file:
            file.write(b"abc")
        played = run("mono", self.program("drifter.exe", "sample/Drifter.cs"), made("damaged"), check=False)
        self.assertEqual(played.returncode, 1)
        self.assertIn("grant", played.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
