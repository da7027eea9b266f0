"""Exports a drawing of the page: PNG, SVG, Python code of the drawing, a test case; and explains its plan."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from topleft import plan, rasterize
from topleft._apps.diagram.pixel_grid import pixel_grid
from topleft._apps.explore.engine import MethodDrawing, drawings_of
from topleft._apps.explore.session import Reply, Request, Session
from topleft.methods import CLASSICS

MAX_FILE_SIDE_PX = 2048
MAX_CELL_PX = 32
SIGNS = ".0123456789abcdefghijklmnopqrstuvwxyz"


def export(_: Session, request: Request) -> Reply:
    """Return a file of a drawing, as bytes: its name, its type, its content; the third part is the picture."""
    (drawing,) = drawings_of(request)
    kind = request.get("kind")
    if kind == "code":
        return as_file("explored.py", "text/x-python", code(drawing).encode())
    if kind == "test":
        return as_file("test_explored.py", "text/x-python", test_case(drawing).encode())
    if kind in ("png", "svg"):
        if len(request["parts"]) < 3:
            raise ValueError("a file needs a picture, got none: the method draws none")
        pixels = np.frombuffer(request["parts"][2], np.uint8).reshape(*drawing.size[::-1], 4)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"explored.{kind}")
            write_grid(drawing, pixels, path)
            return as_file(path.name, {"png": "image/png", "svg": "image/svg+xml"}[kind], path.read_bytes())
    raise ValueError(f"kind must be one of 'png', 'svg', 'code', 'test', got {str(kind)[:20]!r}")


def as_file(name: str, kind: str, content: bytes) -> Reply:
    """The reply that holds a file."""
    return Reply({"name": name, "type": kind}, {"content": content})


def write_grid(drawing: MethodDrawing, pixels: NDArray[np.uint8], path: Path) -> None:
    """Write a picture (H, W, 4), magnified, with the edges over it."""
    cell = max(1, min(MAX_CELL_PX, MAX_FILE_SIDE_PX // max(drawing.size)))
    sampling = None if cell < 8 or drawing.is_coverage else drawing.options.get("sampling", "center")
    points = drawing.vertices[:, :2] - drawing.options["origin"]
    pixel_grid(pixels, points, drawing.triangles, sampling=sampling, cell=cell, edge_color="#1d2733", path=path)


def code(drawing: MethodDrawing) -> str:
    """Return a program of the drawing.

    Its `owners` equal the result of `MethodDrawing.draw`, (H, W) or (H, W, S), or the coverage (H, W).
    """
    lines = ["import numpy as np", "", "import topleft as tl", "", *arrays(drawing), *call(drawing)]
    name = "coverage" if drawing.is_coverage else "owners"
    shown = f"{name}[..., 0]" if "msaa" in drawing.options.get("sampling", "") else name
    sampled = "" if drawing.is_coverage else ', sampling="center"'
    size, points = f"{drawing.size[0]}, {drawing.size[1]}", f"vertices[:, :2] - {drawing.options['origin']}"
    lines += [
        f"print({name}.shape, int(({name} {'> 0' if drawing.is_coverage else '>= 0'}).sum()))",
        f"# The window of {size} pixels, magnified:",
        f'tl.pixel_grid({shown}, {points}, triangles{sampled}, path="explored.svg")',
    ]
    return "\n".join(lines) + "\n"


def arrays(drawing: MethodDrawing) -> list[str]:
    """The lines that create the arrays: numbers exact to the last bit."""
    points = [f"    {row!r}," for row in drawing.vertices.tolist()]
    corners = [f"    {row!r}," for row in drawing.triangles.tolist()]
    columns = drawing.vertices.shape[1]
    return [
        "vertices = np.array([", *points, f"], np.float64).reshape(-1, {columns})",
        "triangles = np.array([", *corners, "], np.int32).reshape(-1, 3)",
    ]  # fmt: skip


def call(drawing: MethodDrawing) -> list[str]:
    """The lines that draw, without options that are the usual ones."""
    usual = {"origin": (0, 0), "method": "auto", "subpixel_bits": 8, "sampling": "center", "cull": "none"}
    options = {name: value for name, value in drawing.options.items() if value != usual[name]}
    arguments = "".join(f", {name}={value!r}" for name, value in options.items())
    size = f"({drawing.size[0]}, {drawing.size[1]})"
    if drawing.is_coverage:
        return [f"coverage = tl.coverage(vertices, triangles, {size}{arguments})"]
    if drawing.options["method"] in CLASSICS:
        return [
            "numbers = np.arange(len(triangles), dtype=np.float32)[:, None]",
            f"drawn = tl.fill(vertices, triangles, numbers, {size}, background=[-1.0]{arguments})",
            "owners = drawn[..., 0].astype(np.int32)",
        ]
    is_tested = drawing.vertices.shape[1] == 3 and drawing.depth_test != "less"
    tested = f', depth_test="{drawing.depth_test}"' if is_tested else ""
    which = "samples_triangle" if "sampling" in options else "triangle"
    return [f"owners = tl.rasterize(vertices, triangles, {size}{tested}{arguments}).{which}"]


def test_case(drawing: MethodDrawing) -> str:
    """Return a test that compares a method with the exact picture, which the test contains."""
    if drawing.options.get("sampling", "center") != "center":
        raise ValueError("a test case is of pixel centres: choose the sampling 'center'")
    options = {**drawing.options, "method": "auto", "subpixel_bits": "exact"}
    exact = rasterize(
        drawing.vertices, drawing.triangles, drawing.size, depth_test=drawing.depth_test, **options
    ).triangle
    lines = ["import numpy as np", "", "import topleft as tl", ""]
    lines += ["# What must show, a sign a pixel: none, or the triangle's number in base 36, z also for those beyond."]
    lines += [f'SIGNS = "{SIGNS}"', "EXPECTED = [", *(f'    "{row}",' for row in rows_of(exact)), "]", "", ""]
    lines += ["def test_picture_is_the_exact_one():"]
    lines += [f"    {line}" for line in (*arrays(drawing), *call(drawing))]
    lines += ['    assert ["".join(SIGNS[min(i, 35) + 1] for i in row) for row in owners] == EXPECTED']
    return "\n".join(lines) + "\n"


def rows_of(owners: NDArray[np.int32]) -> list[str]:
    """Ids as text, a sign a pixel."""
    return ["".join(SIGNS[min(i, 35) + 1] for i in row) for row in owners.tolist()]


def explain(_: Session, request: Request) -> Reply:
    """Return the plan of a drawing, in words."""
    (drawing,) = drawings_of(request)
    if classic := CLASSICS.get(drawing.options["method"]):
        return Reply({"text": f"{classic.name}: {classic.summary}.\n{classic.source}.\n\nA classic needs no plan."})
    outputs = "coverage" if drawing.is_coverage else "triangle"
    drawing_plan = plan(drawing.vertices, drawing.triangles, drawing.size, outputs=outputs, **drawing.options)
    return Reply({"text": drawing_plan.explain()})


HANDLERS = {"pixels.export": export, "pixels.plan": explain}
