"""Check kernels compiled for x86-64, `check_units.py OBJECT...`: one visible function, no slow instruction.

Reads with `nm` and `objdump`. An instruction is slow if a processor that people own runs it as microcode:
`llvm-mca -mcpu=znver1 -instruction-info` gives it a latency of 100. Nothing here needs such a processor.
"""

import re
import subprocess
import sys
from fnmatch import fnmatchcase
from pathlib import Path

#: What no function of a set may have: sets, the instruction as `objdump` writes it, the processors, and the cure.
#: Two stay with AVX-512: `pdep` in `vi_prefix_count`, for all processors with that set take 3 cycles; and gathers, 25
#: cycles for 16 numbers, for nobody has compared loads on such a processor.
FORBIDDEN = (
    (("scalar", "simd128", "avx2"), r"(pdep|pext)\b", "18 to 290 cycles on Zen 1 and 2: take a table"),
    (
        ("scalar", "simd128", "avx2"),
        r"v(p?gather)",
        "microcode on Zen 1 and 2, and on Intel's Skylake to Tiger Lake with the cure of Downfall: `vi_gather` loads",
    ),
    (("avx2",), r"vp?maskmov\w+ +%\w+,%\w+,.*\)", "20 cycles on AMD before Zen 4: load, blend and store whole"),
    (("avx512",), r"vp?compress\w+ .*\)(\{|$)", "microcode on Zen 4: compress to a register, store it whole"),
)

END = "once a row, its last vector: a whole store would leave the row"
#: Masked stores that stay, by function, with the reason; AVX-512 has masked stores without that price.
ALLOWED = {
    "draw*": "samples at the end of the buffer, where a whole vector has no room; `has_room` takes blends before it",
    "put_*": "as `draw*`: the sinks that `draw_rows` and `draw_middle` call",
    "walk_wide": "as `draw*`",
    "peel_lanes": "as `draw*`",
    "count_spans": "as `draw*`",
    "clear": END,
    "flush_atlas": END,
    "blend_*": "cells at the end of the strip; `has_room` takes blends before it",
    "mix_*": "pixels at the end of the buffer; `has_room` takes blends before it",
    "label_*": "rows of less than a vector",
    "share_polygons": END,
    "shade_*": END,
    "cut_out": "pixels of another thread may lie beside those of an instance with an alpha texture",
    "mean_flat": "pixels of mixed samples are written by another loop",
    "mark_silhouettes": "the last vector of all triangles: another thread may write those that follow",
    "grad_sides": "as `mark_silhouettes`",
    "grad_texels_vjp": "made by the compiler, of a sum that is left out where a texel has no weight",
}


def code_of(path: Path) -> list[tuple[str, str]]:
    """Return the instructions of an object, each with its function, without what the compiler adds to the name."""
    command = ["objdump", "-d", "--no-show-raw-insn", str(path)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    function, found = "", []
    for line in text.splitlines():
        if head := re.fullmatch(r"[0-9a-f]+ <(\w+).*>:", line):
            function = head[1]
        elif code := re.fullmatch(r" +[0-9a-f]+:\t(.*)", line):
            found.append((function, code[1]))
    return found


def slow_code(path: Path, isa: str) -> list[str]:
    """Return a line for each function with an instruction that its set may not have."""
    rules = [(re.compile(pattern), reason) for sets, pattern, reason in FORBIDDEN if isa in sets]
    found = {}
    for function, code in code_of(path):
        for slow, reason in rules:
            is_allowed = "maskmov" in code and any(fnmatchcase(function, name) for name in ALLOWED)
            if slow.match(code) and not is_allowed:
                found[f"{path.name}: {function} has {code.split()[0]}: {reason}"] = True
    return list(found)


def extra_symbols(path: Path) -> list[str]:
    """Return a line if a unit defines more than its function: symbols of a wider set could answer for the baseline."""
    text = subprocess.run(["nm", "-g", "--defined-only", str(path)], capture_output=True, text=True, check=True).stdout
    names = [line.split()[-1] for line in text.splitlines()]
    wanted = f"tl_set_{path.stem.removeprefix('unit_')}"
    return [] if names == [wanted] else [f"{path.name} must define {wanted} alone, got {names}"]


def main(paths: list[Path]) -> None:
    problems = []
    for path in paths:
        problems += [*extra_symbols(path), *slow_code(path, path.stem.rpartition("_")[2])]
    if problems:
        sys.exit("\n".join(problems))


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
