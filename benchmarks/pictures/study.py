"""Pictures of topleft beside those of OpenGL on llvmpipe: how much they differ, where, and why.

In: the scenes of `scenes.py`. Out: a record of counts and grey levels, and sheets of pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import Options, names, option, refuse_unknown
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, tell
from benchmarks.pictures import tables
from benchmarks.pictures.scenes import SCENES, SIZE, PictureScene, draw
from benchmarks.report.study import Study

SNAP_PX = 2.0**-8
"""Either renderer moves a corner by half of 2^-8 px in x and in y, 0.71 of 2^-8 px in all; the rest is for float32."""

CONTRAST = 64
GAP_PX = 6
N_VIEWS = 100


class Drawn(NamedTuple):
    """A picture (H, W, 3) uint8 and the triangle (H, W) int32 that each pixel shows, -1 for none."""

    color: np.ndarray
    triangle: np.ndarray


def run_pictures(scenes: Sequence[str], folder: Path | None = None) -> Record:
    """Draw and compare scenes, all unless named, and write their sheets into the folder.

    Raises
    ------
    ValueError
        If a scene is unknown.
    ImportError, RuntimeError
        If there is no OpenGL on llvmpipe.
    """
    from benchmarks.pictures.opengl import ENVIRONMENT, OpenGL

    refuse_unknown("--scene", scenes, SCENES)
    facts = describe("moderngl")
    peer = OpenGL()
    rows = []
    for name in scenes or SCENES:
        scene = SCENES[name]()
        ours, theirs = Drawn(*draw(scene)), Drawn(*peer.draw(scene))
        rows.append({"scene": name, "what": scene.what, "n_triangles": len(scene.mesh.triangles)})
        rows[-1] |= compare(ours, theirs, partial(outline_px, scene))
        tell(f"{name}: mean {rows[-1]['mean']}, {rows[-1]['n_unexplained']} pixels unexplained")
        if folder is not None:
            write_sheet(sheet_path(folder, name), ours.color, theirs.color)
    return {
        "kind": "pictures",
        **facts,
        "renderer": peer.renderer,
        "environment": ENVIRONMENT,
        "size": list(SIZE),
        "scenes": rows,
        "outlines": compare_outlines(peer.draw),
    }


def compare_outlines(draw_peer: Callable[[PictureScene], tuple[np.ndarray, np.ndarray]]) -> dict[str, Any]:
    """Count the pixels of outlines as `compare` does, over views of the `headlight` scene from all sides."""
    first = SCENES["headlight"]()
    cameras = tl.viewpoints(first.mesh, N_VIEWS, aspect=SIZE[0] / SIZE[1])
    rows = []
    n_outline = 0
    for camera in cameras:
        scene = replace(first, camera=camera)
        ours = Drawn(*draw(scene))
        rows.append(compare(ours, Drawn(*draw_peer(scene)), partial(outline_px, scene)))
        n_outline += count_outline(ours.triangle >= 0)
    sums = {key: sum(row[key] for row in rows) for key in ("n_coverage", "n_triangle", "n_unexplained")}
    worst = {key: max(row[key] for row in rows) for key in ("mean", "max_distance_px")}
    return {"n_views": N_VIEWS, "n_outline": n_outline, **sums, **worst}


def count_outline(is_covered: np.ndarray) -> int:
    """Covered pixels with a neighbour, of four, that is not."""
    all_around = np.ones_like(is_covered)
    for axis in range(2):
        for step in (1, -1):
            all_around &= np.roll(is_covered, step, axis)
    return int((is_covered & ~all_around).sum())


def outline_px(scene: PictureScene, triangle: int) -> np.ndarray:
    """The corners (N, 2) float64 of a triangle in pixels, not snapped, after the near plane."""
    mesh, (width, height) = scene.mesh, SIZE
    clip = np.c_[mesh.vertices[mesh.triangles[triangle]], np.ones(3)] @ scene.camera.clip_from_world(SIZE).T
    distance = clip[:, 2] + clip[:, 3]
    corners = []
    for a, b, at_a, at_b in zip(clip, np.roll(clip, -1, axis=0), distance, np.roll(distance, -1), strict=True):
        if at_a >= 0:
            corners.append(a)
        if (at_a < 0) != (at_b < 0):
            corners.append(a + at_a / (at_a - at_b) * (b - a))
    x, y, _, w = np.array(corners).T
    return np.stack([(x / w + 1) * width / 2, (1 - y / w) * height / 2], -1)


def compare(ours: Drawn, theirs: Drawn, outline_of: Callable[[int], np.ndarray]) -> dict[str, Any]:
    """Count the differences.

    Parameters
    ----------
    ours, theirs : Drawn
    outline_of : function
        The corners (N, 2) float64 of a triangle, pixels.

    Returns
    -------
    dict
        `n_inside`: pixels that show the same triangle in both, with no background among them and their eight
        neighbours. There `mean` and `max`: grey levels of 0 to 255, of all channels; `n_other`: pixels that have a
        channel that differs. `n_coverage`: pixels that one covers and the other does not. `n_triangle`: pixels that
        both cover, with different triangles. `max_distance_px`: of all these, the largest distance of a centre to the
        edges of the triangles that it shows. `n_unexplained`: how many lie further off than the snap moves edges.
    """
    is_inside = inside(ours.triangle, theirs.triangle)
    difference = np.abs(ours.color.astype(int) - theirs.color)[is_inside]
    distance = np.array(
        [
            min(distance_to_edges(np.array([column, row]) + 0.5, outline_of(i)) for i in pair if i >= 0)
            for row, column, *pair in differing(ours.triangle, theirs.triangle)
        ]
    )
    n_coverage = int(((ours.triangle < 0) != (theirs.triangle < 0)).sum())
    return {
        "n_inside": int(is_inside.sum()),
        "mean": round(float(difference.mean()), 4),
        "max": int(difference.max()),
        "n_other": int(difference.any(axis=1).sum()),
        "n_coverage": n_coverage,
        "n_triangle": len(distance) - n_coverage,
        "max_distance_px": round(float(distance.max(initial=0.0)), 6),
        "n_unexplained": int((distance > SNAP_PX).sum()),
    }


def differing(ours: np.ndarray, theirs: np.ndarray) -> list[list[int]]:
    """Row, column and both triangles of the pixels that show different ones."""
    rows, columns = np.nonzero(ours != theirs)
    return np.stack([rows, columns, ours[rows, columns], theirs[rows, columns]], -1).tolist()


def inside(*ids: np.ndarray) -> np.ndarray:
    """Where all (H, W) show the same triangle and cover the eight neighbours; the border of the picture is not in."""
    is_covered = np.pad(np.logical_and.reduce([one >= 0 for one in ids]), 1)
    height, width = ids[0].shape
    windows = [is_covered[i : i + height, j : j + width] for i in range(3) for j in range(3)]
    return np.logical_and.reduce([*windows, *(one == ids[0] for one in ids[1:])])


def distance_to_edges(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance of a point (2,) to the nearest edge of a polygon (N, 2)."""
    along = np.roll(corners, -1, axis=0) - corners
    to_point = point - corners
    share = np.clip((to_point * along).sum(-1) / np.maximum((along**2).sum(-1), np.finfo(float).tiny), 0, 1)
    return float(np.linalg.norm(to_point - share[:, None] * along, axis=-1).min())


def sheet_path(folder: Path, name: str) -> Path:
    """Where the sheet of a scene is."""
    return folder / f"pictures-{name}.png"


def write_sheet(path: Path, ours: np.ndarray, theirs: np.ndarray) -> None:
    """Write both pictures and `CONTRAST` times their difference, side by side; pixels as they are."""
    from PIL import Image

    difference = np.minimum(CONTRAST * np.abs(ours.astype(int) - theirs), 255).astype(np.uint8)
    gap = np.full((len(ours), GAP_PX, 3), 255, np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.hstack([ours, gap, theirs, gap, difference])).save(path, optimize=True)


def read_sheet(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The pictures (H, W, 3) uint8 of topleft and of llvmpipe that a sheet holds."""
    from PIL import Image

    with Image.open(path) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    width = (pixels.shape[1] - 2 * GAP_PX) // 3
    return pixels[:, :width], pixels[:, width + GAP_PX : 2 * width + GAP_PX]


@dataclass(frozen=True)
class PictureOptions(Options):
    scenes: Sequence[str] = names("--scene", "scenes; all unless given")
    sheets: Path | None = option(
        None, "--sheets", "write them side by side with their difference, PNG", type=Path, metavar="FOLDER"
    )


def run(options: PictureOptions, _: Save) -> Record:
    """Draw and compare."""
    try:
        return run_pictures(options.scenes, options.sheets)
    except (ImportError, RuntimeError) as error:
        raise ValueError(str(error)) from error


STUDY = Study("pictures", "compare pictures with OpenGL on llvmpipe", PictureOptions, run, tables.lines, tables.PARTS)
