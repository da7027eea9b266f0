"""Writes how big the project is into README.md: lines, seconds to build, size of the wheel, minutes of the tests.

`python packaging/size.py` counts lines alone; `--build` also builds a wheel, `--tests` also runs all tests, each timed
on an idle machine with every core. In: the sources. Out: the section "Size" of README.md, whose numbers that were not
measured again stay. `tests/house/test_readme.py` fails when the lines are more than 500 off.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
#: The suffixes of the files of each language; C that Cython makes is not counted.
LANGUAGES = {"C": (".c", ".h"), "Python and Cython": (".py", ".pyx", ".pxi")}
#: The numbers of the section, by name.
NUMBERS = {
    "C": r"([\d,]+) lines of C,",
    "Python and Cython": r"([\d,]+) lines of Python and Cython",
    "seconds": r"builds in (\d+) seconds",
    "cores": r"on (\d+) cores",
    "MB": r"a wheel of ([\d.]+) MB",
    "minutes": r"tests take (\d+) minutes",
}


def lines() -> dict[str, int]:
    """The lines of csrc and src in each language, in whole hundreds."""
    files = [path for folder in ("csrc", "src") for path in (ROOT / folder).rglob("*")]
    files = [path for path in files if path.suffix != ".c" or not path.with_suffix(".pyx").exists()]
    return {
        language: round(sum(len(path.read_bytes().splitlines()) for path in files if path.suffix in suffixes), -2)
        for language, suffixes in LANGUAGES.items()
    }


def build() -> dict[str, float]:
    """Seconds that a wheel with every instruction set takes to build, and its MB."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.monotonic()
        command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, ROOT]
        subprocess.run(command, env=os.environ | {"TOPLEFT_BUILD_ISA": "all"}, check=True)
        seconds = time.monotonic() - start
        (wheel,) = Path(folder).glob("*.whl")
        return {"seconds": round(seconds), "MB": round(wheel.stat().st_size / 1e6, 1)}


def run_tests() -> dict[str, float]:
    """Minutes that the tests of the README's command take."""
    start = time.monotonic()
    subprocess.run([sys.executable, "-m", "pytest", "-n", "auto"], cwd=ROOT, check=True)
    return {"minutes": round((time.monotonic() - start) / 60)}


def stated(text: str) -> dict[str, float]:
    """The numbers that a README states."""
    return {name: float(re.search(pattern, text)[1].replace(",", "")) for name, pattern in NUMBERS.items()}


def rewritten(text: str, numbers: dict[str, float]) -> str:
    """A README with other numbers."""
    for name, number in numbers.items():
        match = re.search(NUMBERS[name], text)
        text = text[: match.start(1)] + f"{number:,}" + text[match.end(1) :]
    return text


def main() -> None:
    """Measure what the command line asks for, and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", action="store_true", help="build a wheel, timed")
    parser.add_argument("--tests", action="store_true", help="run all tests, timed")
    options = parser.parse_args()
    measured = (build() if options.build else {}) | (run_tests() if options.tests else {})
    if measured:
        measured["cores"] = os.cpu_count()
    README.write_text(rewritten(README.read_text(encoding="utf-8"), lines() | measured), encoding="utf-8")


if __name__ == "__main__":
    main()
