"""The house rules of csrc: a ladder of folders, intrinsics in one of them, files that compile alone, a complete map."""

import functools
import os
import re
import subprocess
from pathlib import Path

import pytest
from toolchain import FLAGS_OF_ISA, compiler

CSRC = Path(__file__).resolve().parents[2] / "csrc"
FILES = sorted(path.relative_to(CSRC).as_posix() for path in CSRC.rglob("*.[ch]"))
FOLDERS = sorted({name.rpartition("/")[0] for name in FILES})

#: From the lowest floor to the highest. A folder includes its files, those of lower floors, and topleft.h.
LADDER = (
    ("base",), ("lanes",), ("vertex",), ("clusters", "exact", "mesh"), ("sink",), ("raster",), ("area", "points"),
    ("pixels",), ("blend", "grad", "lines", "polygons", "shade", "tiles"), ("grid",),
)  # fmt: skip
FLOORS = {folder: floor for floor, folders in enumerate(LADDER) for folder in folders}

#: Where lower files declare functions of higher ones: a sink is compiled into the walkers.
HOOKS = "sink/hooks.h"


def text_of(name: str) -> str:
    """Return the text of a file."""
    return (CSRC / name).read_text(encoding="utf-8")


def code_of(name: str) -> str:
    """Return the text of a file without its comments."""
    return re.sub(r"/\*.*?\*/", " ", text_of(name), flags=re.DOTALL)


def includes_of(name: str) -> list[str]:
    """Return the files of csrc that a file includes."""
    return re.findall(r'^#include "([^"]+)"', text_of(name), flags=re.MULTILINE)


def may_include(name: str, other: str) -> bool:
    """Tell whether the ladder lets a file include another one."""
    folder, other_folder = name.rpartition("/")[0], other.rpartition("/")[0]
    if not other_folder:
        return not folder or other == "topleft.h"
    if not folder:
        return name.startswith("unit_") or (name == "dispatch.h" and other.endswith(".h"))
    return folder == other_folder or FLOORS[other_folder] < FLOORS[folder]


def test_each_folder_has_a_floor():
    assert sorted(["", *FLOORS]) == FOLDERS


@pytest.mark.parametrize("name", FILES)
def test_includes_go_down_the_ladder(name):
    assert [other for other in includes_of(name) if other not in FILES] == []
    assert [other for other in includes_of(name) if not may_include(name, other)] == []


def test_includes_of_folders_have_no_circle():
    below = {name: [other for other in includes_of(name) if "/" in other] for name in FILES}
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, " -> ".join((*path, name))
        if name not in done:
            for other in below[name]:
                visit(other, (*path, name))
            done.add(name)

    for name in FILES:
        visit(name, ())


@pytest.mark.parametrize("name", [name for name in FILES if "/" in name and name != HOOKS])
def test_functions_are_defined_before_they_are_called(name):
    """A declaration without a body would be a call upwards."""
    assert re.findall(r"^(?:static|TL_INLINE|extern)[^;{}=]*\)\s*;", code_of(name), flags=re.MULTILINE) == []


@pytest.mark.parametrize("name", [name for name in FILES if not name.startswith("lanes/")])
def test_intrinsics_are_in_lanes_alone(name):
    assert re.findall(r"\b_mm\w*|\b__m(?:128|256|512|mask)\w*|\w*(?:intrin|neon|wasm_simd128)\.h", code_of(name)) == []


def check_syntax(path: str | Path, flags: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    """Parse a file with the compiler."""
    command = [*compiler(), "-std=c11", "-fsyntax-only", f"-I{CSRC}", *flags, "-x", "c", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@functools.cache
def has_instructions(isa: str) -> bool:
    """Whether the compiler knows an instruction set."""
    command = [*compiler(), "-fsyntax-only", *FLAGS_OF_ISA[isa], "-x", "c", os.devnull]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize("name", FILES)
def test_file_compiles_alone(name):
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    isa = Path(name).stem.rpartition("_")[2]
    if isa in FLAGS_OF_ISA and not has_instructions(isa):
        pytest.skip(f"{compiler()[0]} does not know {isa}")
    result = check_syntax(CSRC / name, FLAGS_OF_ISA.get(isa, ()))
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("name", ["tests/portable/pictures.c", "tests/portable/lanes.c", "benchmarks/lanes/scenes.c"])
def test_program_compiles_with_what_the_headers_declare(name):
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    table = "tl_kernels_scalar"
    flags = (
        "-D_GNU_SOURCE",
        f"-DTL_KERNELS={table}",
        f"-DTL_KERNELS_HERE={table}",
        "-DTL_USE_SCALAR",
        "-Wall",
        "-Werror",
    )
    result = check_syntax(CSRC.parent / name, flags)
    assert result.returncode == 0, result.stderr


def test_map_lists_the_folders():
    listed = re.findall(r"^- `([^`]+)/`", (CSRC / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(name for name in FOLDERS if name)


@pytest.mark.parametrize("path", sorted(CSRC.rglob("*.[chm]*")), ids=lambda path: path.relative_to(CSRC).as_posix())
def test_lines_have_at_most_120_columns(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [f"{i}: {line}" for i, line in enumerate(lines, 1) if len(line) > 120] == []


#: What reads the indices of triangles, which may be the caller's memory and change: each once, and looks at them then.
READERS_OF_INDICES = {
    "vertex/corners.h", "raster/state.h", "lines/edges.c", "mesh/creases.c", "mesh/nearest.c", "pixels/planes.c",
    "pixels/runs.c", "pixels/weights_one.c", "tiles/corners.c",
}  # fmt: skip


def test_indices_are_read_in_few_places():
    first_looks = r"(first_bad_row|fetch_rows|fetch_listed)\([^;]*;"  # checks of all, and mere prefetches
    named = r"(snapped|mesh|fans|\bs|\bc)(->|\.)triangles\b(?!\s*=)"
    assert {name for name in FILES if re.search(named, re.sub(first_looks, "", code_of(name)))} == READERS_OF_INDICES


def test_unit_of_webassembly_compiles_with_what_the_headers_declare():
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    unit = CSRC.parent / "src/topleft/_apps/explore/wasm/web.c"
    builtins = ("-D__builtin_wasm_memory_size(i)=0", "-D__builtin_wasm_memory_grow(i,n)=0")  # compilers here have none
    result = check_syntax(unit, ("-Wno-attributes", *builtins))
    assert result.returncode == 0, result.stderr
