#!/usr/bin/env python3
"""Writes a ctypes module from the client library's C headers, so that Python knows what C knows.

    make_binding.py tessera.h connect.h > tessera.py

The module has every constant, struct and function of the headers by its own name. A struct made in Python is as the
TESSERA_... initialiser of the header makes it, size included. `load(path)` gives the library with its functions typed.
A handle is a void pointer. What the parser does not understand it refuses, with the line.
"""

import re
import sys
from typing import NamedTuple

CTYPES = {
    "int32_t": "c_int32", "uint32_t": "c_uint32", "int64_t": "c_int64", "uint64_t": "c_uint64",
    "uint8_t": "c_uint8", "size_t": "c_size_t", "double": "c_double", "float": "c_float", "char": "c_char",
}


class Type(NamedTuple):
    """A type of C, for whichever language: `base` with so many stars, and the extents where it is an array."""

    base: str  # a key of CTYPES, "void", or the name of a struct or a handle
    stars: int = 0
    const: bool = False
    extents: tuple = ()  # numbers, or constants with arithmetic
    alias: str = ""  # the typedef by which the header names a scalar, such as tessera_code


class Callback(NamedTuple):
    """A pointer to a function."""

    result: Type
    arguments: list  # of Type


class Headers:
    """All that the headers declare, in their order."""

    def __init__(self):
        self.constants = {}  # name: value
        self.scalars = {name: name for name in CTYPES}  # typedefs too: name: key of CTYPES
        self.enums = {}  # typedef of a scalar: [constant], those that stand right after it
        self.structs = {}  # name: [(field, Type or Callback)]
        self.handles = set()
        self.functions = {}  # name: (result, [(argument, Type)])
        self.libraries = {}  # of functions: the name that was given to read
        self.initialisers = {}  # of structs, by the macro's name
        self._library = self._typedef = None

    def read(self, text, library=None):
        self._library = library
        text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S).replace("\\\n", " ")
        for name, body in re.findall(r"^#define (TESSERA_[A-Z_]+)[ \t]+(\{.*\})[ \t]*$", text, flags=re.M):
            self.initialisers[name] = body
        for name, value in re.findall(r"^#define (TESSERA_VERSION_[A-Z]+) (\d+)$", text, flags=re.M):
            self.constants[name] = int(value)
        text = re.sub(r"^#.*$", "", text, flags=re.M)
        text = text.replace('extern "C" {', "")
        for statement in self.statements(text):
            self.take(" ".join(statement.split()))

    @staticmethod
    def statements(text):
        """Splits at semicolons outside braces."""
        depth, begin = 0, 0
        for at, sign in enumerate(text):
            depth += {"{": 1, "}": -1}.get(sign, 0)
            if sign == ";" and depth == 0:
                yield text[begin:at]
                begin = at + 1
        rest = text[begin:].replace("}", "").strip()
        if rest:
            raise SystemExit(f"make_binding: not understood: {rest}")

    def take(self, statement):
        typedef, self._typedef = self._typedef, None
        if match := re.fullmatch(r"enum \{(.*)\}", statement):
            names = self.take_constants(match[1])
            if typedef:
                self.enums[typedef] = names
        elif match := re.fullmatch(r"typedef struct (\w+) \{(.*)\} \1", statement):
            self.structs[match[1]] = [field for part in self.statements_in(match[2]) for field in self.fields(part)]
        elif match := re.fullmatch(r"typedef struct (\w+) \1|struct (\w+)", statement):
            self.handles.add(match[1] or match[2])
        elif match := re.fullmatch(r"typedef (\w+) (\w+)", statement):
            self.scalars[match[2]] = self.scalars[match[1]]
            self._typedef = match[2]
        elif match := re.fullmatch(r"TESSERA_API (.*?)(\w+)\((.*)\)", statement):
            arguments = [] if match[3] == "void" else [self.argument(part) for part in match[3].split(",")]
            self.functions[match[2]] = (self.type_of(match[1].strip()), arguments)
            self.libraries[match[2]] = self._library
        else:
            raise SystemExit(f"make_binding: not understood: {statement}")

    @staticmethod
    def statements_in(body):
        return [part.strip() for part in body.split(";") if part.strip()]

    def take_constants(self, body):
        names = []
        for part in body.split(","):
            name, _, value = part.partition("=")
            if name.strip():
                names.append(name.strip())
                self.constants[names[-1]] = int(value)
        return names

    def fields(self, declaration):
        if match := re.fullmatch(r"(.+?)\(\*(\w+)\)\((.*)\)", declaration):
            types = [self.argument(part)[1] for part in match[3].split(",")]
            return [(match[2], Callback(self.type_of(match[1].strip()), types))]
        match = re.fullmatch(r"((?:const )?(?:struct )?\w+ ?\**) ?(.+)", declaration)
        whole, named = self.type_of(match[1].strip()), []
        for name in match[2].split(","):
            extents = tuple(re.findall(r"\[([^\]]+)\]", name))
            named.append((name.split("[")[0].strip(), whole._replace(extents=extents)))
        return named

    def argument(self, declaration):
        """Its name and its type; an array is the pointer to its first element."""
        declaration = declaration.strip()
        if match := re.fullmatch(r"(.+?) ?(\w+)\[\d+\]", declaration):
            whole = self.type_of(match[1])
            return match[2], whole._replace(stars=whole.stars + 1)
        match = re.fullmatch(r"(.+?[ *])(\w+)", declaration)
        return match[2], self.type_of(match[1].strip())

    def type_of(self, text):
        base = text.replace("const", "").replace("struct ", "").replace("*", "").strip()
        if base not in self.scalars and base not in self.structs and base not in self.handles and base != "void":
            raise SystemExit(f"make_binding: no such type: {text}")
        plain = self.scalars.get(base, base)
        return Type(plain, text.count("*"), "const" in text, alias=base if base != plain else "")

    def initialiser_of(self, struct):
        """The macro is named as the struct is, but for the library's own name."""
        return self.initialisers.get(struct.upper())


def ctype(headers, whole):
    """A type as ctypes has it."""
    if isinstance(whole, Callback):
        return f"CFUNCTYPE({', '.join(ctype(headers, one) for one in (whole.result, *whole.arguments))})"
    if whole.extents:
        text = ctype(headers, whole._replace(extents=()))
        for extent in reversed(whole.extents):
            text = f"({text}) * ({extent})"
        return text
    stars, name = whole.stars, CTYPES.get(whole.base, whole.base)
    if whole.base == "void":
        return "c_void_p" if stars else "None"
    if whole.base == "char" and stars == 1:
        return "c_char_p" if whole.const else "c_void_p"
    if whole.base in headers.handles:
        stars, name = stars - 1, "c_void_p"
    return "POINTER(" * stars + name + ")" * stars


def values_of(initialiser):
    """The braces of C as a list of Python."""
    return " ".join(initialiser.split()).replace("NULL", "None").replace("{", "[").replace("}", "]")


def write(headers, out):
    out.write('"""The C interface of libtessera-client for Python. Written by make_binding.py from its headers."""\n\n')
    out.write("from ctypes import *  # noqa: F403\n\n")
    for name, value in headers.constants.items():
        out.write(f"{name} = {value}\n")
    out.write('''

def _fill_array(array, values):
    for at, each in enumerate(values):
        if isinstance(each, list):
            _fill_array(array[at], each)
        else:
            array[at] = each


def _fill(struct, values):
    """As the header's initialiser does; what it leaves out is 0."""
    for (name, ctype), value in zip(struct._fields_, values):
        if isinstance(value, list):
            target = getattr(struct, name)
            if isinstance(target, Structure):
                _fill(target, value)
            elif isinstance(target, bytes):  # of characters
                setattr(struct, name, bytes(value).rstrip(b"\\0"))
            else:
                _fill_array(target, value)
        elif value is not None:
            setattr(struct, name, value)


class _Initialised(Structure):
    def __init__(self, **fields):
        super().__init__()
        _fill(self, self._initial_())
        for name, value in fields.items():
            if name not in dict(self._fields_):
                raise AttributeError(f"{type(self).__name__} has no {name}")
            setattr(self, name, value)

    @staticmethod
    def _initial_():
        return []
''')
    for struct, fields in headers.structs.items():
        out.write(f"\n\nclass {struct}(_Initialised):\n    _fields_ = [\n")
        for name, whole in fields:
            out.write(f'        ("{name}", {ctype(headers, whole)}),\n')
        out.write("    ]\n")
        if initialiser := headers.initialiser_of(struct):
            out.write(f"\n    @staticmethod\n    def _initial_():\n        return {values_of(initialiser)}\n")
    out.write("\n\n_FUNCTIONS = {\n")
    for name, (result, arguments) in headers.functions.items():
        types = ", ".join(ctype(headers, whole) for _, whole in arguments)
        out.write(f'    "{name}": ({ctype(headers, result)}, [{types}]),\n')
    out.write('''}


class Error(Exception):
    """A call that did not give TESSERA_OK: `code`, and the line of tessera_last_error."""

    def __init__(self, code, line):
        super().__init__(f"{line} ({code})")
        self.code, self.line = code, line


def load(path):
    """The library with its functions typed; functions that it has not are left out."""
    library = CDLL(path)
    for name, (result, arguments) in _FUNCTIONS.items():
        if hasattr(library, name):
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    return library


def check(library, code):
    """Raises Error unless the code is TESSERA_OK."""
    if code != TESSERA_OK:
        raise Error(code, library.tessera_last_error().decode())
''')


def main():
    headers = Headers()
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            headers.read(file.read())
    write(headers, sys.stdout)


if __name__ == "__main__":
    main()
