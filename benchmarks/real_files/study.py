"""Draws all files of folders: outcomes, warnings, times.

In: folders of files that are no part of the project. Out: a record.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.harness.arguments import Options, count, option
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, tell
from benchmarks.real_files import drawing, tables
from benchmarks.report.study import Study

SUFFIXES = (
    ".gltf", ".glb", ".vrm", ".obj", ".ply", ".stl", ".stl_ascii", ".off", ".3mf", ".dae", ".zae", ".amf", ".xyz",
    ".svg", ".dxf", ".binvox",
)  # fmt: skip
"""The files that are drawn unless `--suffix` is given."""

START_SECONDS = 60


class Painter(AbstractContextManager["Painter"]):
    """A process that draws files; one that falls, or takes too long, is replaced.

    Parameters
    ----------
    seconds : float
        How long a file may take.
    up : str
        The axis that points up.
    """

    def __init__(self, seconds: float, up: str = "y") -> None:
        self._seconds = seconds
        self._up = up
        self._folder = tempfile.TemporaryDirectory(prefix="topleft-")
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        picture = Path(self._folder.name, "picture.png")
        self._process = context.Process(target=drawing.serve, args=(other, picture, self._up), daemon=True)
        self._process.start()
        other.close()
        if not self._pipe.poll(START_SECONDS) or not self._pipe.recv().get("ready"):
            raise ValueError("the process that draws did not start")

    def draw(self, path: Path) -> dict[str, Any]:
        """The outcome of a file; see `drawing.draw`."""
        self._pipe.send(path)
        try:
            if self._pipe.poll(self._seconds):
                return self._pipe.recv()
            row = {"outcome": "crashed", "line": f"not done after {self._seconds:g} seconds"}
        except (EOFError, OSError):
            self._process.join(1)
            row = {"outcome": "crashed", "line": f"the process ended with status {self._process.exitcode}"}
        self._stop()
        self._start()
        return row

    def _stop(self) -> None:
        self._pipe.close()
        self._process.kill()
        self._process.join()

    def __exit__(self, *_: object) -> None:
        self._stop()
        self._folder.cleanup()


def files_of(folder: Path, suffixes: tuple[str, ...] = SUFFIXES) -> list[Path]:
    """The files of a folder and of those in it that end in one of these, in the order of their names."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in suffixes and path.is_file())


def draw_folder(label: str, folder: Path, painter: Painter, suffixes: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """A row for each file of a folder."""
    paths = files_of(folder, suffixes)
    for i, path in enumerate(paths):
        row = painter.draw(path)
        if i % 20 == 19 or row["outcome"] == "crashed":
            tell(f"{label}: {i + 1} of {len(paths)}: {path.name}: {row['outcome']}")
        yield {"folder": label, "file": path.relative_to(folder).as_posix(), **row}


def folder_of(text: str) -> tuple[str, Path]:
    """`FOLDER` or `LABEL=FOLDER`."""
    label, mark, folder = text.rpartition("=")
    path = Path(folder)
    if not path.is_dir():
        raise argparse.ArgumentTypeError(f"there is no folder {folder!r}")
    return (label if mark else path.name, path)


@dataclass(frozen=True)
class FileOptions(Options):
    folders: Sequence[tuple[str, Path]] = option(
        (), "", "files, in folders within it too", nargs="+", type=folder_of, metavar="[LABEL=]FOLDER"
    )
    seconds: int = count(60, "--seconds", "a file may take", "S")
    suffix: Sequence[str] = option(SUFFIXES, "--suffix", "files that are drawn", nargs="+", metavar=".SUFFIX")
    up: str = option("y", "--up", "the axis that points up (%(default)s)", choices=["y", "z"])


def run(options: FileOptions, _: Save) -> Record:
    """Draw all files of the folders.

    Raises
    ------
    ValueError
        If a folder has none.
    """
    suffixes = tuple(suffix.lower() for suffix in options.suffix)
    for label, folder in options.folders:
        if not files_of(folder, suffixes):
            raise ValueError(f"{label!r} must be a folder with files that end in one of {' '.join(suffixes)}")
    with Painter(options.seconds, options.up) as painter:
        rows = [row for own in options.folders for row in draw_folder(*own, painter, suffixes)]
    return {"kind": "real-files", **describe("pillow", "trimesh"), "size": drawing.SIZE, "files": rows}


STUDY = Study("real-files", "draw all files of folders", FileOptions, run, tables.lines, tables.PARTS)
