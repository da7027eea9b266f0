"""Makes what Cython and type checkers need to know of the engine; `setup.py` runs it, and git tracks nothing of it.

contract.pxi   the types, constants and functions of the headers in csrc, as Cython declares them
kernels.pyi    the types of the compiled module, from the signatures in `kernels.pyx` and what it includes

Headers may hold structs and enums with a `typedef`, enums without a name, functions, kernels (`TL_KERNEL`), and macros
that are numbers; all else is an error. A signature of Cython says all that a stub does: `-> int` what comes back;
`: Array` the type of a Python object; `or None` that an argument may be None; `#: Array` that of an attribute.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CSRC = ROOT / "csrc"
ENGINE = ROOT / "src/topleft/_core/engine"
STUB = ENGINE / "kernels.pyi"

ENUM = r"enum \{(?P<members>[^}]*)\} ?(?P<enum>\w*);"
STRUCT = r"struct ?\w* ?\{(?P<fields>[^}]*)\} (?P<struct>\w+);"
FUNCTION = r"(?:static inline )?(?P<result>\w[\w ]*?[ *]+)(?P<function>tl_\w+)\((?P<parameters>[^()]*)\);"
DECLARATION = re.compile(rf"(?:typedef )?(?:{ENUM}|{STRUCT})|{FUNCTION}")
CONSTANT = re.compile(r"^#define (TL_\w+) (.+)$", re.MULTILINE)


def headers(name: str, seen: list[str]) -> str:
    """Return the text of a header, in the order of the compiler, with those that it includes and not with comments."""
    seen.append(name)
    text = re.sub(r"/\*.*?\*/", "", CSRC.joinpath(name).read_text(encoding="utf-8"), flags=re.DOTALL)

    def included(match: re.Match[str]) -> str:
        return "" if match[1] in seen else headers(match[1], seen)

    return re.sub(r'#include "([^"]+)"', included, text)


def parameters(text: str) -> str:
    """Return the types of the parameters of a function: Cython does not take every name."""
    found = [re.fullmatch(r"(.*?)(\w*)(\[.*\])?", part.strip()) for part in text.split(",") if part.strip() != "void"]
    return ", ".join(match[1].strip() + " *" * bool(match[3]) if match[1] else match[2] for match in found)


def fields(text: str) -> list[str]:
    """Return the fields of a struct, each on a line of its own."""
    lines = []
    for field in filter(None, map(str.strip, text.split(";"))):
        if function := re.fullmatch(r"(.*?)\(\*(\w+)\)\((.*)\)", field):
            lines.append(f"{function[1]}(*{function[2]})({parameters(function[3])}) noexcept nogil")
        else:
            kind, names = re.fullmatch(r"((?:const )?\w+) ?(.*)", field).groups()
            lines += [f"{kind} {name.strip()}" for name in names.split(",")]
    return lines


def contract() -> str:
    """Return the declarations of all that the headers tell."""
    text = headers("dispatch.h", [])
    constants, numbers, types, functions = [], [], [], []
    for name, value in CONSTANT.findall(text):
        if "int64_t" in value:
            numbers.append(f"int64_t {name}")
        elif "__builtin" not in value:
            constants.append(name)
    text = " ".join(re.sub(r"^#.*$", "", text, flags=re.MULTILINE).split())
    n_bodies = 1
    while n_bodies:  # the innermost first
        text, n_bodies = re.subn(r"\) ?\{[^{}]*\}", ");", text)
    text = re.sub(r"(?<!typedef )\bstruct (?=\w+ \*)", "", text)
    text = re.sub(r"TL_KERNEL\(([^,]+), (\w+), ([^()]*)\)", r"\1(*\2)(\3);", text)
    structs = []
    for found in DECLARATION.finditer(text):
        if found["members"]:
            constants += re.findall(r"(TL_\w+)[^,]*(?:,|$)", found["members"])
            types += [f"ctypedef int {found['enum']}"] * bool(found["enum"])
        elif found["struct"]:
            structs.append(f"ctypedef struct {found['struct']}")
            types += [structs[-1] + ":", *("    " + line for line in fields(found["fields"]))]
        else:
            functions.append(f"{found['result'].strip()} {found['function']}({parameters(found['parameters'])})")
    if unread := DECLARATION.sub("", text).strip():
        raise ValueError(f"headers must hold what packaging/bindings.py reads, got {unread[:200]!r}")
    enum = ["enum:", *("    " + name for name in constants)]
    lines = ("    " + line for line in [*enum, *numbers, *structs, *types, *functions])
    return "\n".join(['cdef extern from "dispatch.h" nogil:', *lines, ""])


NUMBERS = {"float": "F32", "double": "F64"} | {
    f"{sign}int{bits}_t": f"{sign.upper() or 'I'}{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}
MODULE = '''"""The types of the compiled module. What each does stands in kernels.pyx and the .pxi files."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[Any]
F32: TypeAlias = NDArray[np.float32]
F64: TypeAlias = NDArray[np.float64]
I8: TypeAlias = NDArray[np.int8]
I16: TypeAlias = NDArray[np.int16]
I32: TypeAlias = NDArray[np.int32]
I64: TypeAlias = NDArray[np.int64]
U8: TypeAlias = NDArray[np.uint8]
U16: TypeAlias = NDArray[np.uint16]
U32: TypeAlias = NDArray[np.uint32]
U64: TypeAlias = NDArray[np.uint64]
'''
CLASS = r"^cdef class (?P<of>\w+)(?P<base>\(\w+\))?"
DEF = r"^(?P<indent> *)def (?P<name>\w+)\((?P<arguments>.*?)\)(?: -> (?P<returns>[^\n]*))?:(?: *#[^\n]*)?$"
ATTRIBUTE = r"^    cdef readonly (?P<kind>\w+) (?P<attributes>[\w, ]+?)(?: *#: (?P<told>[^\n]*?)| *#[^\n]*)?$"
VALUE = r"^(?P<values>[A-Z][A-Z_, ]+)(?:: (?P<annotation>[^=\n]+?))? = "
DECORATOR = r"^    @(?P<decorator>property|staticmethod)$"
STATEMENT = re.compile("|".join((CLASS, DEF, ATTRIBUTE, VALUE, DECORATOR)), re.MULTILINE | re.DOTALL)


def python_type(kind: str) -> str:
    """Return the type that Python sees of one of Cython: a number, a memoryview, or a class."""
    if view := re.fullmatch(r"(?:const )?(\w+)\[.*\]", kind):
        return NUMBERS[view[1]]
    if kind in ("float", "double"):
        return "float"
    if kind == "bint":
        return "bool"
    return "int" if re.fullmatch(r"(u?int\d*_t|tl_\w+|int|unsigned long)", kind) else kind


def argument(text: str) -> str:
    """Return an argument as a stub has it."""
    name, _, default = (part.strip() for part in re.sub(r"(?<!:)=", " = ", text, count=1).partition(" = "))
    if name in ("self", "*"):
        return name
    name, _, told = name.partition(": ")
    if not told:
        kind, _, name = name.removesuffix(" or None").rpartition(" ")
        may_be_none = text.endswith(" or None") or (bool(kind) and default == "None")
        told = (python_type(kind) if kind else "Any") + " | None" * may_be_none
    return f"{name}: {told}" + " = ..." * bool(default)


def arguments(text: str) -> str:
    """Return the arguments of a function as a stub has them."""
    flat = " ".join(text.split())
    parts, depth = [""], 0
    for sign in flat:
        depth += (sign in "[({") - (sign in "])}")
        if sign == "," and not depth:
            parts.append("")
        else:
            parts[-1] += sign
    return ", ".join(argument(part.strip()) for part in parts if part.strip())


def stub() -> str:
    """Return the stub of the compiled module."""

    def included(match: re.Match[str]) -> str:
        path = ENGINE / match[1]
        return path.read_text(encoding="utf-8") if path.exists() else ""  # `contract.pxi` is made beside the objects

    text = (ENGINE / "kernels.pyx").read_text(encoding="utf-8")
    text = re.sub(r'^include "(\w+\.pxi)"$', included, text, flags=re.MULTILINE)
    lines = []
    for found in STATEMENT.finditer(text):
        if found["of"]:
            lines += [f"class {found['of']}{found['base'] or ''}:", '    """"""']
        elif found["decorator"]:
            lines.append(f"    @{found['decorator']}")
        elif found["values"]:
            lines += [f"{name}: {found['annotation'] or 'int'}" for name in found["values"].split(", ")]
        elif found["attributes"]:
            is_class = found["kind"][0].isupper()
            kind = found["told"] or python_type(found["kind"]) + " | None" * is_class
            lines += [f"    {name}: {kind}" for name in found["attributes"].split(", ")]
        elif not found["name"].startswith("__") or found["name"] in ("__init__", "__cinit__", "__len__"):
            name, returns = found["name"].replace("__cinit__", "__init__"), found["returns"] or "None"
            lines.append(f"{found['indent']}def {name}({arguments(found['arguments'])}) -> {returns}: ...")
    return MODULE + "\n".join(lines) + "\n"


def write_stub() -> None:
    """Write the stub beside the source, where type checkers look, unless it is there."""
    text = stub()
    if not STUB.exists() or STUB.read_text(encoding="utf-8") != text:
        STUB.write_text(text, encoding="utf-8")
