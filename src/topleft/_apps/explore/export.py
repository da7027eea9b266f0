"""Writes what a state shows: PNG, SVG, Python code that draws the same, a test case."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from topleft._apps.diagram.pixel_grid import pixel_grid
from topleft._apps.explore.pixels import EXACT, draw, picture
from topleft._apps.explore.session import Reply, Request, Session
from topleft._apps.explore.state import PixelState, parse_state
from topleft.methods import CLASSICS
from topleft.typing import SamplesOption

MAX_FILE_SIDE_PX = 2048
MAX_CELL_PX = 32
SIGNS = ".0123456789abcdefghijklmnopqrstuvwxyz"


def export(_: Session, request: Request) -> Reply:
    """Return a file of a state, as bytes: its name, its type, its content."""
    state = parse_state(request.get("state"))
    kind = request.get("kind")
    if kind == "code":
        return as_file("explored.py", "text/x-python", code(state).encode())
    if kind == "test":
        return as_file("test_explored.py", "text/x-python", test_case(state).encode())
    if kind in ("png", "svg"):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"explored.{kind}")
            grid(state, str(path))
            return as_file(path.name, {"png": "image/png", "svg": "image/svg+xml"}[kind], path.read_bytes())
    raise ValueError(f"kind must be one of 'png', 'svg', 'code', 'test', got {str(kind)[:20]!r}")


def as_file(name: str, kind: str, content: bytes) -> Reply:
    """A file as an answer."""
    return Reply({"name": name, "type": kind}, {"content": content})


def grid(state: PixelState, path: str) -> None:
    """Write the first picture, magnified, with the edges over it."""
    shown = picture(state, draw(state, state.method))
    points = state.vertices[:, :2] - state.origin
    sampling: Any = state.sampling if state.sampling in get_args(SamplesOption) else None
    cell = max(1, min(MAX_CELL_PX, MAX_FILE_SIDE_PX // max(state.size)))
    dots = sampling if cell >= 8 else None
    pixel_grid(shown, points, state.triangles, sampling=dots, cell=cell, edge_color="#1d2733", path=path)


def code(state: PixelState) -> str:
    """Return a program that draws the same.

    Its `owners` are what `draw` gives, (H, W) or (H, W, S), or the coverage (H, W) of areas and squares.
    """
    lines = ["import numpy as np", "", "import topleft as tl", "", *arrays(state), *call(state)]
    name = "coverage" if is_coverage(state) else "owners"
    shown = f"{name}[..., 0]" if state.sampling.startswith("msaa") and state.method not in CLASSICS else name
    sampled = "" if is_coverage(state) else ', sampling="center"'
    size = f"{state.size[0]}, {state.size[1]}"
    lines += [
        f"print({name}.shape, int(({name} {'> 0' if is_coverage(state) else '>= 0'}).sum()))",
        f"# The window of {size} pixels, magnified:",
        f'tl.pixel_grid({shown}, vertices[:, :2] - {state.origin}, triangles{sampled}, path="explored.svg")',
    ]
    return "\n".join(lines) + "\n"


def is_coverage(state: PixelState) -> bool:
    """Whether a picture knows coverage alone."""
    return state.options(state.method).get("sampling") in ("area", "outer", "inner")


def arrays(state: PixelState) -> list[str]:
    """The lines that make the arrays: numbers as they are, to the last bit."""
    points = [f"    {row!r}," for row in state.vertices.tolist()]
    corners = [f"    {row!r}," for row in state.triangles.tolist()]
    columns = state.vertices.shape[1]
    return [
        "vertices = np.array([", *points, f"], np.float64).reshape(-1, {columns})",
        "triangles = np.array([", *corners, "], np.int32).reshape(-1, 3)",
    ]  # fmt: skip


def call(state: PixelState) -> list[str]:
    """The lines that draw."""
    options = state.options(state.method)
    given = "".join(f", {name}={value!r}" for name, value in options.items() if (name, value) != ("method", "auto"))
    size = f"({state.size[0]}, {state.size[1]})"
    if is_coverage(state):
        return [f"coverage = tl.coverage(vertices, triangles, {size}{given})"]
    if state.method in CLASSICS:
        return [
            "numbers = np.arange(len(triangles), dtype=np.float32)[:, None]",
            f"drawn = tl.fill(vertices, triangles, numbers, {size}, background=[-1.0]{given})",
            "owners = drawn[..., 0].astype(np.int32)",
        ]
    tested = f', depth_test="{state.depth_test}"' if state.has_depth and state.depth_test != "less" else ""
    which = "samples_triangle" if state.sampling.startswith("msaa") else "triangle"
    return [f"owners = tl.rasterize(vertices, triangles, {size}{tested}{given}).{which}"]


def test_case(state: PixelState) -> str:
    """Return a test that holds a method to the exact picture, which stands in it."""
    if state.sampling != "center":
        raise ValueError("a test case is of pixel centres: choose the sampling 'center'")
    exact = draw(state, EXACT).owners[..., 0]
    lines = ["import numpy as np", "", "import topleft as tl", ""]
    lines += ["# What must show, a sign a pixel: none, or the triangle's number in base 36, z also for those beyond."]
    lines += [f'SIGNS = "{SIGNS}"', "EXPECTED = [", *(f'    "{row}",' for row in rows_of(exact)), "]", "", ""]
    lines += ["def test_picture_is_the_exact_one():"]
    lines += [f"    {line}" for line in (*arrays(state), *call(state))]
    lines += ['    assert ["".join(SIGNS[min(i, 35) + 1] for i in row) for row in owners] == EXPECTED']
    return "\n".join(lines) + "\n"


def rows_of(owners: NDArray[np.int32]) -> list[str]:
    """Owners as text, a sign a pixel."""
    return ["".join(SIGNS[min(i, 35) + 1] for i in row) for row in owners.tolist()]


HANDLERS = {"pixels.export": export}
