"""Draws files, one after the other, as `topleft render` draws them: the other end of the study's pipe.

In: paths. Out: for each an outcome, the line that was printed, and seconds.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

SIZE = 384
"""Width and height of the picture, pixels."""


def serve(pipe: Connection, picture: Path, up: str) -> None:
    """Draw the files that the pipe names until it says None."""
    warnings.simplefilter("ignore")  # errors are read from the command's own line
    pipe.send({"ready": True})
    while (path := pipe.recv()) is not None:
        pipe.send(draw(path, picture, up))


def draw(path: Path, picture: Path, up: str = "y") -> dict[str, Any]:
    """Draw a file and return its outcome.

    Returns
    -------
    dict
        `outcome`: "drawn", "refused" or "crashed"; `line`: the output of the command, without the name of the file;
        of what is drawn `n_triangles`, `n_points`, `load_s` (`tl.load`), `command_s` (all of `topleft render`), and
        `covered`: the share of the pixels that are not background.
    """
    from topleft._apps.cli import main

    said = io.StringIO()
    picture.unlink(missing_ok=True)
    start = time.perf_counter()
    options = ["--size", f"{SIZE}x{SIZE}", "--up", up, "--background", "none"]
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            status = main(["render", str(path), "-o", str(picture), *options])
    except SystemExit as error:
        status = int(error.code or 0)
    except Exception as error:
        return {"outcome": "crashed", "line": f"{type(error).__name__}: {error}"}
    seconds = time.perf_counter() - start
    line = shortened(said.getvalue(), path)
    if status or not picture.is_file():
        return {"outcome": "refused" if line else "crashed", "line": line, "command_s": round(seconds, 4)}
    row = {"outcome": "drawn", "line": line, "command_s": round(seconds, 4)}
    return row | facts(path) | {"covered": covered(picture)}


def shortened(text: str, path: Path) -> str:
    """A line of the command without the common beginning, and without the folder of the file."""
    line = " ".join(text.split()).removeprefix("topleft: ")
    if not line.startswith("cannot"):  # warnings begin with their file
        line = line.replace(f"{str(path)!r}: ", "")
    return line.replace(str(path), path.name).replace(str(path.parent), "")


def facts(path: Path) -> dict[str, Any]:
    """The contents of a file, and the time of `tl.load`."""
    import topleft as tl

    start = time.perf_counter()
    mesh = tl.load(path)
    load_s = round(time.perf_counter() - start, 4)
    is_mesh = isinstance(mesh, tl.Mesh)
    return {"n_triangles": len(mesh.triangles) if is_mesh else 0,
            "n_points": 0 if is_mesh else len(mesh.positions), "load_s": load_s}  # fmt: skip


def covered(picture: Path) -> float:
    """The share of a picture that is covered."""
    from PIL import Image

    with Image.open(picture) as image:
        alpha = image.convert("RGBA").getchannel("A")
    return round(1 - alpha.histogram()[0] / (alpha.width * alpha.height), 4)
