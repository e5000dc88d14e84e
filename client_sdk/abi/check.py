#!/usr/bin/env python3
"""Compares the binary interface that the client library's C headers describe with the one that is written down.

    check.py COMPILER INCLUDE_FOLDER tessera.xml            exits with 1 and the differences where there are any
    check.py COMPILER INCLUDE_FOLDER tessera.xml --write    writes it anew

Needs abidw and abidiff (Debian: abigail-tools). Functions, structs with their layout, and constants count. Nothing but
the functions of the headers can be seen of the library (symbols.map), so a library of empty functions, made from the
headers, has the interface of the real one.
"""

import os
import re
import subprocess
import sys
import tempfile

HEADERS = ["tessera.h", "connect.h", "local.h"]
CHANGED, INCOMPATIBLE = 4, 8  # bits of what abidiff returns


def stub_of(include):
    """C source of a library that does nothing, with every function and every constant of the headers."""
    functions, constants = [], []
    for header in HEADERS:
        with open(os.path.join(include, "tessera", header), encoding="utf-8") as file:
            text = re.sub(r"/\*.*?\*/", " ", file.read(), flags=re.S).replace("\\\n", " ")
        text = re.sub(r"^#.*$", "", text, flags=re.M)
        functions += re.findall(r"TESSERA_API ([^;]*?\([^;]*\));", text)
        for body in re.findall(r"enum \{(.*?)\};", text, flags=re.S):
            constants += re.findall(r"\b(TESSERA_[A-Z0-9_]+)\s*=", body)
    if len(functions) < 50 or len(constants) < 50:
        sys.exit(f"abi: only {len(functions)} functions and {len(constants)} constants in {include}")
    lines = [f'#include "tessera/{header}"' for header in HEADERS]
    lines += [f"{' '.join(function.split())} {{ __builtin_trap(); }}" for function in functions]
    # No function has an unnamed constant in its type, so this one has them all: each as an array with one element more
    # than its value, since abidiff passes over other values of an enumeration.
    lines += ["union tessera_constants {"] + [f"  char value_of_{name}[{name} + 1];" for name in constants] + ["};"]
    lines += ["void tessera_constants(union tessera_constants* all) { __builtin_trap(); }"]
    return "\n".join(lines) + "\n"


def described(compiler, include, folder):
    """A file with the description of the headers' interface."""
    with open(os.path.join(folder, "stub.c"), "w", encoding="utf-8") as file:
        file.write(stub_of(include))
    # From within the folder, so that no path of this machine is in the description.
    subprocess.run([compiler, "-x", "c", "-std=c99", "-w", "-g", "-shared", "-fPIC", f"-I{os.path.abspath(include)}",
                    "stub.c", "-o", "stub.so"], check=True, cwd=folder)
    subprocess.run(["abidw", "--no-corpus-path", "--no-comp-dir-path", "--no-show-locs", "--out-file", "now.xml",
                    "stub.so"], check=True, cwd=folder)
    return os.path.join(folder, "now.xml")


def main(compiler, include, written, *more):
    with tempfile.TemporaryDirectory() as folder:
        now = described(compiler, include, folder)
        if more == ("--write",):
            with open(now, encoding="utf-8") as source, open(written, "w", encoding="utf-8") as target:
                target.write(source.read())
            return 0
        compared = subprocess.run(["abidiff", "--harmless", "--no-show-locs", written, now], check=False, capture_output=True, text=True)
    if compared.returncode == 0:
        return 0
    # The names of all constants in one line say nothing; what has changed of them stands before.
    shown = [line for line in (compared.stdout + compared.stderr).splitlines() if "union tessera_constants{" not in line]
    print("\n".join(shown))
    if compared.returncode & INCOMPATIBLE:
        print("abi: programs that were built with the headers before this change no longer work with the library. "
              "Add a function or a field at a struct's end instead; else the major version has to grow.")
    elif compared.returncode & CHANGED:
        print("abi: the interface is another one. If the above only adds functions, constants, or fields at a "
              f"struct's end, write it down: {sys.argv[0]} {compiler} {include} {written} --write")
    return 1


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
