"""`topleft doctor`: the facts that a bug report needs, and whether this installation draws the right pixels."""

from __future__ import annotations

import argparse
import platform
import re
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

from topleft import build_info
from topleft._apps.cli.arguments import add_command
from topleft._core.base.threads import available_threads

#: Extras for developers of the library; their packages are not listed.
OWN_EXTRAS = frozenset({"all", "bench", "dev", "docs", "test"})


def run_doctor(_: argparse.Namespace) -> int:
    """Print the facts for a bug report, and check the installation: about three seconds.

    The exit status is 1 when an instruction set draws other pixels than it should.
    """
    from topleft.testing import HARD_SCENES, N_SEEDS, check_instruction_sets  # which the other commands do not need

    info = build_info()
    print(f"topleft {info['version']} in {Path(__file__).parents[2]}")
    print(f"Python {platform.python_version()} ({platform.python_implementation()}), {platform.platform()}")
    print(f"{platform.machine()}, {available_threads()} threads; compiled by {info['compiler']}")
    for name in ("numpy", "pillow"):
        print(f"{name} {version(name)}")
    for line in extras():
        print(line)

    start = time.perf_counter()
    found = check_instruction_sets()
    print(f"instruction sets, {len(HARD_SCENES) * N_SEEDS} scenes on 1 and 2 threads:")
    for name in info["isa_built"]:
        told = found.get(name, "this machine cannot run it")
        print(f"  {name}: {told}{', in use' if name == info['isa'] else ''}")
    for name in info["isa_missing"]:
        print(f"  {name}: not built, though this machine runs it; `TOPLEFT_BUILD_ISA=all pip install ...` does")
    is_right = set(found.values()) == {"right"}
    told = "all is well" if is_right else "PICTURES ARE WRONG, please report this"
    print(f"{told} ({time.perf_counter() - start:.1f} s)")
    return 0 if is_right else 1


def extras() -> Iterator[str]:
    """Yield a line for each optional extra: the packages that it brings, with their versions."""
    try:
        lines = requires("topleft") or []
    except PackageNotFoundError:
        yield "extras: unknown, the package is not installed but read from its source"
        return
    packages: dict[str, list[str]] = {}
    for line in lines:
        found = re.match(r"([\w.-]+)[^;]*;.*extra == ['\"]([\w-]+)['\"]", line)
        if found and found[2] not in OWN_EXTRAS:
            packages.setdefault(found[2], []).append(found[1])
    for extra, names in sorted(packages.items()):
        there = {name: installed(name) for name in names}
        told = ", ".join(f"{name} {there[name] or 'is not installed'}" for name in names)
        missing = " ".join(name for name in names if there[name] is None)
        hint = f" (pip install {missing})" if missing else ""
        if "torch" in missing.split():
            hint = " (pip install torch --index-url with the address that pytorch.org shows for CPU: 0.2 GB, not 5.3)"
        yield f"extra {extra}: {told}{hint}"


def installed(name: str) -> str | None:
    """Return the version of a package, None if it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def add_doctor_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    add_command(commands, "doctor", run_doctor, "check the installation")
