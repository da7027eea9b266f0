"""The house rules of csrc: a ladder of folders, intrinsics in one of them, files that compile alone, a complete map."""

import os
import re
import subprocess
from pathlib import Path

import pytest
from toolchain import FLAGS_OF_ISA, compiler

from topleft._core.base.options import Sink
from topleft.methods import METHODS

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


def test_includes_go_down_the_ladder():
    pairs = [(name, other) for name in FILES for other in includes_of(name)]
    assert [pair for pair in pairs if pair[1] not in FILES] == []
    assert [pair for pair in pairs if not may_include(*pair)] == []


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


def found_in(pattern: str, names: list[str]) -> list[tuple[str, str]]:
    """Return what a pattern finds in the code of some files, each with its file."""
    return [(name, found) for name in names for found in re.findall(pattern, code_of(name), flags=re.MULTILINE)]


def test_functions_are_defined_before_they_are_called():
    """A declaration without a body would be a call upwards."""
    names = [name for name in FILES if "/" in name and name != HOOKS]
    assert found_in(r"^(?:static|TL_INLINE|extern)[^;{}=]*\)\s*;", names) == []


def test_intrinsics_are_in_lanes_alone():
    names = [name for name in FILES if not name.startswith("lanes/")]
    assert found_in(r"\b_mm\w*|\b__m(?:128|256|512|mask)\w*|\w*(?:intrin|neon|wasm_simd128)\.h", names) == []


def check_syntax(path: str | Path, flags: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    """Parse a file with the compiler."""
    command = [*compiler(), "-std=c11", "-fsyntax-only", f"-I{CSRC}", *flags, "-x", "c", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def has_instructions(isa: str) -> bool:
    """Whether the compiler knows an instruction set."""
    return check_syntax(os.devnull, FLAGS_OF_ISA[isa]).returncode == 0


def test_each_file_compiles_alone():
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    unknown = {isa for isa in FLAGS_OF_ISA if not has_instructions(isa)}
    for name in FILES:
        isa = Path(name).stem.rpartition("_")[2]
        if isa not in unknown:
            result = check_syntax(CSRC / name, FLAGS_OF_ISA.get(isa, ()))
            assert result.returncode == 0, f"{name}: {result.stderr}"


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


def test_numbers_of_python_are_those_of_the_header():
    numbers = {name: int(n) for name, n in re.findall(r"TL_(\w+) = (\d+)[, ]", text_of("topleft.h"))}
    assert {f"SINK_{sink.name}": sink.value for sink in Sink}.items() <= numbers.items()
    assert {f"METHOD_{name.upper()}": method.code for name, method in METHODS.items()}.items() <= numbers.items()


def test_map_lists_the_folders():
    listed = re.findall(r"^- `([^`]+)/`", (CSRC / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(name for name in FOLDERS if name)


def test_lines_have_at_most_120_columns():
    texts = {path: path.read_text(encoding="utf-8").splitlines() for path in CSRC.rglob("*.[chm]*")}
    assert [f"{path.name}: {line}" for path, lines in texts.items() for line in lines if len(line) > 120] == []


#: What reads the indices of triangles, which may be the caller's memory and change: each once, and looks at them then.
READERS_OF_INDICES = {
    "vertex/corners.h", "raster/state.h", "lines/edges.c", "mesh/creases.c", "mesh/nearest.c", "pixels/planes.c",
    "pixels/runs.c", "pixels/weights_one.c", "tiles/corners.c",
}  # fmt: skip


def test_indices_are_read_in_few_places():
    first_looks = r"(first_bad_row|fetch_rows?|fetch_listed)\([^;]*;"  # checks of all, and mere prefetches
    named = r"(snapped|mesh|fans|\bs|\bc)(->|\.)triangles\b(?!\s*=)"
    assert {name for name in FILES if re.search(named, re.sub(first_looks, "", code_of(name)))} == READERS_OF_INDICES


def test_unit_of_webassembly_compiles_with_what_the_headers_declare():
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    unit = CSRC.parent / "src/topleft/_apps/explore/wasm/web.c"
    builtins = ("-D__builtin_wasm_memory_size(i)=0", "-D__builtin_wasm_memory_grow(i,n)=0")  # compilers here have none
    result = check_syntax(unit, ("-Wno-attributes", *builtins))
    assert result.returncode == 0, result.stderr
