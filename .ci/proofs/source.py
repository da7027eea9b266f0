"""The text that claims are about, and what a step of a proof needs."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

HERE = Path(__file__).resolve().parent
AVX2 = ["-DTL_USE_AVX2", "-mavx2", "-mfma", "-mbmi", "-mbmi2", "-mlzcnt", "-mpopcnt"]
FLAGS = ["-std=c11", "-O2", "-DNDEBUG", "-ffp-contract=off", "-fno-math-errno", "-w"]


class NotProvedError(Exception):
    """A claim does not follow."""


class LeftOutError(Exception):
    """A tool is not installed, which need not be there."""


def need(holds: bool, text: str) -> None:
    """Raise an error unless a step of a proof holds."""
    if not holds:
        raise NotProvedError(text)


def number_of(text: str) -> Fraction:
    """A number as C and Python write it: decimal, or hexadecimal with a power of two."""
    number = text.rstrip("fu") if "p" in text else text if "0x" in text else text.rstrip("fu")
    return Fraction(float.fromhex(number) if "p" in number else int(number, 0) if "0x" in number else Fraction(number))


@dataclass(frozen=True)
class Source:
    """The code that claims are about: names are those in csrc, or begin with `src/`."""

    root: Path

    def lines(self, name: str) -> str:
        """A file as it is."""
        return (self.root / ("" if name.startswith("src/") else "csrc") / name).read_text(encoding="utf-8")

    def text(self, name: str) -> str:
        """A file in one line, without the stars of C comments and the `#:` of Python's."""
        return re.sub(r"\s+", " ", re.sub(r"\n( \* |#: )", "\n", self.lines(name)))

    def says(self, name: str, *sentences: str) -> None:
        """Raise an error unless a file has some sentences or lines of code."""
        for sentence in sentences:
            need(sentence in self.text(name), f"{name} does not say: {sentence}")

    def numbers(self, name: str, pattern: str) -> list[Fraction]:
        """The numbers in the groups of a pattern that a file in one line must match."""
        found = re.search(pattern, self.text(name))
        need(found is not None, f"{name} does not match {pattern}")
        return [number_of(group) for group in found.groups()]  # type: ignore[union-attr]

    def constant(self, name: str, macro: str) -> Fraction:
        """The number of a macro: decimal, hexadecimal with a power of two, or `1 << n`."""
        pattern = rf"^#define {macro} \(?((?:\(int64_t\))?[^\s)]+(?: << \d+)?)"
        line = re.search(pattern, self.lines(name), re.MULTILINE)
        need(line is not None, f"{name} defines no {macro}")
        value, _, shift = line[1].removeprefix("(int64_t)").partition(" << ")  # type: ignore[index]
        return number_of(value) * (1 << int(shift or 0))

    def finest(self) -> int:
        """Sub-pixels of a pixel, at most."""
        (bits,) = self.numbers("src/topleft/_core/base/arrays.py", r"subpixel_bits must be in 0\.\.(\d+)")
        return 1 << int(bits)

    def run(self, *arguments: object, program: str) -> None:
        """Compile a program of .ci/proofs with the code, and run it."""
        has_avx2 = " avx2 " in Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else False
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder, "proof")
            source = HERE / program
            command = [*shlex.split(os.environ.get("CC", "gcc")), *FLAGS, *(AVX2 if has_avx2 else ["-DTL_USE_SCALAR"])]
            built = subprocess.run(
                [*command, f"-I{self.root / 'csrc'}", str(source), "-lm", "-o", str(made)],
                capture_output=True,
                text=True,
            )
            need(built.returncode == 0, f"{program} does not compile: {built.stderr[:500]}")
            done = subprocess.run([str(made), *map(str, arguments)], capture_output=True, text=True)
        need(done.returncode == 0, f"{program}: {done.stdout.strip() or 'a value is wrong'}")


@dataclass(frozen=True)
class Claim:
    """A sentence of a file and its proof."""

    method: str
    name: str
    place: str
    says: str
    proof: Callable[[Source], object]
    is_long: bool = False


def claim(method: str, name: str, place: str, says: str, *, is_long: bool = False) -> Callable[..., Claim]:
    """Make a claim of the function that proves it."""
    return lambda proof: Claim(method, name, place, says, proof, is_long)
