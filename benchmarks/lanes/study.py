"""The kernels of each instruction set beside those of scalar, on one core: `python -m benchmarks lanes`.

`scenes.c` draws 22 scenes at 1920x1080 through a table of kernels. It is compiled with each set that runs here (SSE4.1
for vectors of 128 bits on x86-64), and, where compilers and node or qemu are there, for WebAssembly and aarch64. Runs
go in turns, and the least time of a scene counts; of aarch64, instructions do, for an emulator has no time to tell.
"""

from __future__ import annotations

import math
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness.arguments import Options, count, names
from benchmarks.harness.machine import ROOT, describe
from benchmarks.harness.records import Record, Save, tell
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, number, table

HERE = Path(__file__).parent
FLAGS = [
    "-std=c11",
    "-DNDEBUG",
    "-O3",
    "-g0",
    "-ffp-contract=off",
    "-fno-fast-math",
    "-fno-math-errno",
    "-D_GNU_SOURCE",
]
SSE41 = "-msse4.1 -mpopcnt -mno-mmx"
AVX2 = "-mavx2 -mfma -mbmi -mbmi2 -mlzcnt -mpopcnt"
AVX512 = f"{AVX2} -mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx512cd -mprefer-vector-width=512"
WASM = "clang --target=wasm32-wasi --sysroot=/usr -Wl,-z,stack-size=8388608 -Wno-unused-command-line-argument"
NODE = f"node --no-warnings {ROOT / 'tests/portable/run_wasi.mjs'}"


@dataclass(frozen=True)
class Way:
    """A compiled program: a set on a machine; the others of a machine are compared with the first."""

    machine: str
    isa: str
    compiler: str
    runner: str = ""

    @property
    def name(self) -> str:
        return f"{self.machine} {self.isa}"


@dataclass(frozen=True)
class LaneOptions(Options):
    repeats: int = count(9, "--repeats", "calls of a scene in a turn")
    rounds: int = count(3, "--rounds", "turns of each program")
    scenes: Sequence[str] = names("--scene", "all unless given", ("all",))


def ways_here() -> list[Way]:
    """Return the programs that this machine can make and run."""
    import topleft as tl

    is_x86, native = platform.machine() in ("x86_64", "AMD64"), platform.machine()
    flags = {"scalar": "", "simd128": SSE41 if is_x86 else "", "avx2": AVX2, "avx512": AVX512}
    sets = ["scalar", "simd128", *(isa for isa in ("avx2", "avx512") if isa in tl.build_info()["isa_available"])]
    ways = [Way(native, isa, f"gcc {flags[isa]}") for isa in sets]
    ways += [Way("WebAssembly", "scalar", WASM, NODE), Way("WebAssembly", "simd128", f"{WASM} -msimd128", NODE)]
    if native != "aarch64":
        ways += [Way("aarch64", isa, "aarch64-linux-gnu-gcc -static", "qemu-aarch64") for isa in ("scalar", "simd128")]
    found = []
    for way in ways:
        missing = [name for name in (way.compiler.split()[0], *way.runner.split()[:1]) if not shutil.which(name)]
        if missing:
            tell(f"{way.name}: left out, {missing[0]} is not installed")
        else:
            found.append(way)
    return found


def build(way: Way, folder: Path) -> list[str]:
    """Compile a program and return the command that runs it."""
    program = folder / f"{way.machine}-{way.isa}"
    sources = [ROOT / "csrc" / f"isa_{way.isa}.c", HERE / "scenes.c"]
    made = [*way.compiler.split(), *FLAGS, f"-I{ROOT / 'csrc'}", f"-DTL_KERNELS_HERE=tl_kernels_{way.isa}"]
    subprocess.run([*made, *map(str, sources), "-lm", "-o", str(program)], check=True)
    return [*way.runner.split(), str(program)]


def read(text: str) -> dict[str, tuple[float, str]]:
    """Return the figure and the hash of each scene that a program has printed."""
    return {name: (float(figure), made) for name, figure, made in (line.split() for line in text.splitlines())}


def time_scenes(command: list[str], scene: str, repeats: int) -> dict[str, tuple[float, str]]:
    """Return the least milliseconds of each scene."""
    done = subprocess.run([*command, scene, str(repeats)], capture_output=True, text=True, check=True)
    return read(done.stdout)


def count_scene(command: list[str], plugin: Path, scene: str) -> tuple[float, str]:
    """Return the millions of instructions of the second call of a scene: of two calls less those of one."""
    counts, made = [], ""
    for repeats in ("1", "2"):
        counted = [command[0], "-plugin", str(plugin), *command[1:], scene, repeats]
        done = subprocess.run(counted, capture_output=True, text=True, check=True)
        counts.append(int(done.stderr.split()[-1]))
        made = read(done.stdout)[scene][1]
    return (counts[1] - counts[0]) / 1e6, made


def run(options: LaneOptions, save: Save) -> Record:
    """Measure."""
    record: Record = {"kind": "lanes", **describe(), "ways": [], "rows": []}
    rows: dict[tuple[str, str, str], list] = {}
    with tempfile.TemporaryDirectory() as folder:
        programs = {}
        for way in ways_here():
            tell(f"{way.name}: compiling")
            programs[way] = build(way, Path(folder))
            record["ways"].append([way.machine, way.isa])

        def keep(way: Way, scene: str, figure: float, made: str) -> None:
            row = rows.setdefault((scene, way.machine, way.isa), [scene, way.machine, way.isa, figure, made])
            row[3] = min(row[3], figure)
            record["rows"] = list(rows.values())

        for _ in range(options.rounds):
            for way, command in programs.items():
                for scene in options.scenes if way.runner != "qemu-aarch64" else ():
                    for name, found in time_scenes(command, scene, options.repeats).items():
                        keep(way, name, *found)
            save(record)
        plugin, names = Path(folder, "instructions.so"), list(dict.fromkeys(scene for scene, *_ in rows))
        for way, command in programs.items():
            if way.runner != "qemu-aarch64":
                continue
            subprocess.run(
                ["gcc", "-O2", "-shared", "-fPIC", str(HERE / "instructions.c"), "-o", str(plugin)], check=True
            )
            tell(f"{way.name}: counting")
            for name in names:
                keep(way, name, *count_scene(command, plugin, name))
            save(record)
    return record


def lines(record: Record) -> Iterator[str]:
    """How many times as fast as scalar; of a machine's scalar the figure itself."""
    found = {(scene, machine, isa): (figure, made) for scene, machine, isa, figure, made in record["rows"]}
    scenes = list(dict.fromkeys(scene for scene, *_ in record["rows"]))
    ways = [tuple(way) for way in record["ways"]]
    unit = {way: "M instructions" if way[0] == "aarch64" and ways[0][0] != "aarch64" else "ms" for way in ways}
    yield facts_text(record)
    yield ""
    shown, logs = [], {way: [] for way in ways}
    for scene in scenes:
        row = [scene]
        for way in ways:
            base, figure = found[scene, way[0], "scalar"][0], found[scene, *way][0]
            row.append(number(figure) if way[1] == "scalar" else f"{base / figure:.2f}")
            logs[way].append(math.log(base / figure))
        shown.append(row)
    shown.append(["geometric mean", *("" if way[1] == "scalar" else f"{mean_of(logs[way]):.2f}" for way in ways)])
    yield from table(
        ["scene", *(f"{' '.join(way)}{', ' + unit[way] if way[1] == 'scalar' else ''}" for way in ways)], shown
    )
    for scene in scenes:
        made = {row[4] for row in record["rows"] if row[0] == scene}
        if len(made) > 1:
            yield f"{scene}: other bits, {', '.join(sorted(made))}"


def mean_of(logs: list[float]) -> float:
    """The geometric mean, of logarithms."""
    return math.exp(sum(logs) / len(logs))


STUDY = Study("lanes", "kernels of each instruction set beside scalar's, without Python", LaneOptions, run, lines)
