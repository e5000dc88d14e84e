#!/usr/bin/env python3
"""Writes the C interface of the client library as C#, from its headers, by the parser of make_binding.py.

    make_csharp.py tessera.h connect.h local.h > Native.cs

The file has every constant, struct and function of the headers by its own name, and an enum for each typedef of a
number that the header follows with its values. A struct's Initial is the TESSERA_... initialiser of the header, size
included. A handle and a callback is an IntPtr, a size_t a UIntPtr.
"""

import os
import re
import sys

sys.dont_write_bytecode = True  # beside the sources there is nothing but them
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "python"))
from make_binding import Callback, Headers  # noqa: E402

TYPES = {
    "int32_t": "int", "uint32_t": "uint", "int64_t": "long", "uint64_t": "ulong", "uint8_t": "byte",
    "size_t": "UIntPtr", "double": "double", "float": "float", "char": "byte", "void": "void",
}
LIBRARIES = {"tessera": "tessera-client", "connect": "tessera-connect", "local": "tessera-local"}  # by the header's name
KEYWORDS = {"event", "params", "ref", "out", "in", "object", "string", "lock", "base", "fixed"}
HEAD = '''// The C interface of libtessera-client, libtessera-connect and libtessera-local. Written by make_csharp.py from their headers.
using System;
using System.Runtime.InteropServices;

'''


def camel(name):
    """tessera_event_kind is EventKind."""
    return "".join(part.capitalize() for part in name.lower().replace("tessera_", "", 1).split("_"))


def named(name):
    return "@" + name if name in KEYWORDS else name


def type_of(headers, whole):
    if isinstance(whole, Callback):
        return "IntPtr"
    if whole.base in headers.handles:
        return "IntPtr" + "*" * (whole.stars - 1)
    if whole.alias in headers.enums:
        return camel(whole.alias) + "*" * whole.stars
    return TYPES.get(whole.base, whole.base) + "*" * whole.stars


def field(headers, name, whole):
    extents = () if isinstance(whole, Callback) else whole.extents
    if not extents:
        return f"public {type_of(headers, whole)} {named(name)};"
    if whole.base not in TYPES or whole.stars or whole.base == "size_t":
        raise SystemExit(f"make_csharp: no array of C# for {name}: {whole.base}")
    count = " * ".join(f"({extent})" if " " in extent else extent for extent in extents)
    return f"public fixed {type_of(headers, whole)} {named(name)}[{constants_of(count)}];"


def constants_of(text):
    return re.sub(r"TESSERA_\w+", lambda match: "Api." + match[0], text)


def parsed(text):
    """The braces of an initialiser as nested lists of texts."""
    whole, open_lists = [], []
    at = whole
    for token in re.findall(r"[{}]|[^{},]+(?:\([^)]*\))?", text):
        token = token.strip()
        if token == "{":
            open_lists.append(at)
            at.append([])
            at = at[-1]
        elif token == "}":
            at = open_lists.pop()
        elif token:
            at.append(token)
    return whole[0]


def assignments(headers, struct, values):
    """Those that are not 0: C# begins with zeros."""
    for (name, whole), value in zip(headers.structs[struct], values):
        if isinstance(value, list):
            for at, each in enumerate(value):
                if isinstance(each, list) and any(one not in ("0",) for one in each):
                    raise SystemExit(f"make_csharp: {struct}.{name} begins with more than zeros")
                if not isinstance(each, list) and each != "0":
                    if not whole.extents:
                        raise SystemExit(f"make_csharp: {struct}.{name} begins with more than zeros")
                    yield f"one.{named(name)}[{at}] = {each};"
        elif value == f"sizeof({struct})":
            yield f"one.{named(name)} = (uint)sizeof({struct});"
        elif value not in ("0", "NULL"):
            yield f"one.{named(name)} = {constants_of(value)};"


def write_enums(headers, out):
    out.write("namespace Tessera {\n")
    for typedef, names in headers.enums.items():
        prefix = os.path.commonprefix(names)
        prefix = prefix[:prefix.rindex("_") + 1]
        out.write(f"  public enum {camel(typedef)} {{\n")
        for name in names:
            out.write(f"    {camel(name[len(prefix):])} = {headers.constants[name]},\n")
        out.write("  }\n\n")
    out.write("}\n\n")


def write_structs(headers, out):
    for struct, fields in headers.structs.items():
        out.write(f"  [StructLayout(LayoutKind.Sequential)]\n  public unsafe struct {struct} {{\n")
        for name, whole in fields:
            out.write(f"    {field(headers, name, whole)}\n")
        if initialiser := headers.initialiser_of(struct):
            out.write(f"\n    public static {struct} Initial {{\n      get {{\n        var one = new {struct}();\n")
            for line in assignments(headers, struct, parsed(initialiser)):
                out.write(f"        {line}\n")
            out.write("        return one;\n      }\n    }\n")
        out.write("  }\n\n")


def write_functions(headers, out):
    out.write("  public static unsafe class Api {\n")
    for name, value in headers.constants.items():
        out.write(f"    public const int {name} = {value};\n")
    for name, (result, arguments) in headers.functions.items():
        library = LIBRARIES[headers.libraries[name]]
        listed = ", ".join(f"{type_of(headers, whole)} {named(argument)}" for argument, whole in arguments)
        out.write(f'\n    [DllImport("{library}", CallingConvention = CallingConvention.Cdecl)]\n')
        out.write(f"    public static extern {type_of(headers, result)} {name}({listed});\n")
    out.write("  }\n")


def read_headers(paths):
    headers = Headers()
    for path in paths:
        with open(path, encoding="utf-8") as file:
            headers.read(file.read(), os.path.splitext(os.path.basename(path))[0])
    return headers


def write(headers, out):
    out.write(HEAD)
    write_enums(headers, out)
    out.write("namespace Tessera.Native {\n")
    write_structs(headers, out)
    write_functions(headers, out)
    out.write("}\n")


if __name__ == "__main__":
    write(read_headers(sys.argv[1:]), sys.stdout)
