"""Pictures of topleft beside those of OpenGL on llvmpipe: how much they differ, where, and why.

In: the scenes of `pictures_scenes.py`. Out: a record of counts and grey levels, and sheets of pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np

import topleft as tl
from benchmarks import machine
from benchmarks.pictures_scenes import SCENES, SIZE, PictureScene, draw

SNAP_PX = 2.0**-8
"""Either renderer moves a corner by half a sub-pixel of 2^-8 in x and in y, 0.71 of 2^-8 px; the rest is for float32."""

CONTRAST = 16
GAP_PX = 6


class Drawn(NamedTuple):
    """A picture (H, W, 3) uint8 and the triangle (H, W) int32 that each pixel shows, -1 for none."""

    color: np.ndarray
    triangle: np.ndarray


def run_pictures(log: TextIO, names: list[str], folder: Path | None = None) -> dict[str, Any]:
    """Draw and compare scenes, all unless named, and write their sheets into the folder.

    Raises
    ------
    ValueError
        If a scene is unknown.
    ImportError, RuntimeError
        If there is no OpenGL on llvmpipe.
    """
    from benchmarks.pictures_opengl import ENVIRONMENT, OpenGL

    if unknown := [name for name in names if name not in SCENES]:
        raise ValueError(f"--scene must be some of {', '.join(SCENES)}, got {', '.join(unknown)}")
    peer = OpenGL()
    rows = []
    for name in names or SCENES:
        scene = SCENES[name]()
        ours, theirs = Drawn(*draw(scene)), Drawn(*peer.draw(scene))
        rows.append({"scene": name, "what": scene.what, "n_triangles": len(scene.mesh.triangles)})
        rows[-1] |= compare(ours, theirs, pixel_corners(scene)) | {"bound": scene.bound}
        print(f"{name}: mean {rows[-1]['mean']}, {rows[-1]['n_unexplained']} pixels unexplained", file=log)
        if folder is not None:
            write_sheet(sheet_path(folder, name), ours.color, theirs.color)
    return {
        "kind": "pictures",
        "machine": machine.describe_machine(),
        "versions": {"topleft": tl.build_info()["version"], "moderngl": machine.version_of("moderngl")},
        "renderer": peer.renderer,
        "environment": ENVIRONMENT,
        "date": machine.now(),
        **machine.describe_commit(),
        "size": list(SIZE),
        "scenes": rows,
    }


def pixel_corners(scene: PictureScene) -> np.ndarray:
    """Where the corners of the triangles lie, in pixels, not snapped: (T, 3, 2) float64."""
    return scene.camera.project(scene.mesh.vertices, SIZE)[scene.mesh.triangles][..., :2]


def compare(ours: Drawn, theirs: Drawn, corners_px: np.ndarray) -> dict[str, Any]:
    """Count what differs.

    Parameters
    ----------
    ours, theirs : Drawn
    corners_px : (T, 3, 2) float64
        The triangles in pixels.

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
    rows, cols = np.nonzero(ours.triangle != theirs.triangle)
    pairs = ours.triangle[rows, cols], theirs.triangle[rows, cols]
    centers = np.stack([cols, rows], -1) + 0.5
    distance = np.min([distance_to_edges(centers, ids, corners_px) for ids in pairs], axis=0)
    n_coverage = int(((ours.triangle < 0) != (theirs.triangle < 0)).sum())
    return {
        "n_inside": int(is_inside.sum()),
        "mean": round(float(difference.mean()), 4),
        "max": int(difference.max()),
        "n_other": int(difference.any(axis=1).sum()),
        "n_coverage": n_coverage,
        "n_triangle": len(rows) - n_coverage,
        "max_distance_px": round(float(distance.max(initial=0.0)), 6),
        "n_unexplained": int((distance > SNAP_PX).sum()),
    }


def inside(*ids: np.ndarray) -> np.ndarray:
    """Where all (H, W) show the same triangle and cover the eight neighbours; the border of the picture is not in."""
    is_covered = np.pad(np.logical_and.reduce([one >= 0 for one in ids]), 1)
    height, width = ids[0].shape
    windows = [is_covered[i : i + height, j : j + width] for i in range(3) for j in range(3)]
    return np.logical_and.reduce([*windows, *(one == ids[0] for one in ids[1:])])


def distance_to_edges(points: np.ndarray, ids: np.ndarray, corners_px: np.ndarray) -> np.ndarray:
    """Distance (P,) of points (P, 2) to the nearest edge of the triangle that each names; infinite for -1."""
    a = corners_px[ids]
    b = np.roll(a, -1, axis=1)
    along, to_point = b - a, points[:, None] - a
    length2 = (along**2).sum(-1)
    share = np.clip((to_point * along).sum(-1) / np.maximum(length2, np.finfo(float).tiny), 0, 1)
    distance = np.linalg.norm(to_point - share[..., None] * along, axis=-1).min(axis=1)
    return np.where(ids < 0, np.inf, distance)


def sheet_path(folder: Path, name: str) -> Path:
    """Where the sheet of a scene is."""
    return folder / f"pictures-{name}.png"


def write_sheet(path: Path, ours: np.ndarray, theirs: np.ndarray) -> None:
    """Write both pictures and their difference, `CONTRAST` times and from black on, side by side; pixels as they are."""
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
