"""Builds of the library with other constants: the kernels' choices for each triangle, against other thresholds.

The sources are copied, a `#define` replaced, the copy is built, and imported beside the library in the same process.
"""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.choices.scenes import Scene
from benchmarks.choices.ways import MSAA, drawing
from benchmarks.harness.machine import ROOT
from benchmarks.harness.ways import Way, Ways

SOURCES = ("csrc", "src", "setup.py", "pyproject.toml", "README.md", "LICENSE")

BUILDS: Mapping[str, tuple[str, str, Mapping[str, str]]] = {
    "boxes to 4x4": ("raster/state.h", "TL_SMALL_BOX", {"none": "2"}),
    "boxes to 16x16": ("raster/state.h", "TL_MIDDLE_BOX", {"to 8x8": "8", "to 12x12": "12"}),
    "boxes to 62x62": ("raster/state.h", "TL_MAX_BOX_PX", {"to 16x16": "16", "to 32x32": "32"}),
}
"""By choice: the file, the constant, and other values by name."""


def with_constant(text: str, name: str, value: str) -> str:
    """Return C with another value of a `#define`.

    Raises
    ------
    ValueError
        If there is not exactly one.
    """
    changed, n = re.subn(rf"(?m)^(#define {name} )(?:\([^)]*\)|\S+)", rf"\g<1>{value}", text)
    if n != 1:
        raise ValueError(f"{name} must be defined once, got {n} times")
    return changed


def build_with(file: str, name: str, value: str, folder: Path) -> None:
    """Copy the library to a folder, with another constant, and build it there."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for source in SOURCES:
        at = ROOT / source
        if at.is_dir():
            shutil.copytree(at, folder / source, ignore=shutil.ignore_patterns("*.so", "__pycache__", "*.egg-info"))
        elif at.exists():
            shutil.copy2(at, folder / source)
    target = folder / "csrc" / file
    target.write_text(with_constant(target.read_text(encoding="utf-8"), name, value), encoding="utf-8")
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace", "--build-temp", "objects"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)


@contextmanager
def imported_from(folder: Path) -> Iterator[ModuleType]:
    """Give the library of a folder; what is called topleft elsewhere stays what it is."""
    own = {name: module for name, module in sys.modules.items() if name.partition(".")[0] == "topleft"}
    for name in own:
        del sys.modules[name]
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module("topleft")
    finally:
        sys.path.remove(str(folder))
        for name in [name for name in sys.modules if name.partition(".")[0] == "topleft"]:
            del sys.modules[name]
        sys.modules.update(own)


def is_concerned(scene: Scene) -> bool:
    """Tell whether limits of boxes could matter to a scene."""
    return scene.verb in ("rasterize", "coverage") and (
        scene.sampling == "center" or (scene.verb == "coverage" and scene.sampling in MSAA)
    )


def load_builds(choice: str, folder: Path) -> dict[str, ModuleType]:
    """Return the library with each other value of a constant, built in a folder unless it has been."""
    file, name, values = BUILDS[choice]
    libraries = {}
    for label, value in values.items():
        own = folder / re.sub(r"\W", "", f"{name}_{value}")
        if not (own / "built").exists():
            build_with(file, name, value, own)
            (own / "built").touch()
        with imported_from(own / "src") as library:
            libraries[label] = library
    return libraries


def ways_with(scene: Scene, libraries: Mapping[str, Any]) -> Ways:
    """Return the library's own way and those of other builds."""
    others = [Way(name, drawing(scene, library=library)) for name, library in libraries.items()]
    return [Way("as it is", drawing(scene)), *others]
