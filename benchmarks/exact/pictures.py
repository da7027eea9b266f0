"""The exact result of a scene, and how far a picture is from it.

Coverage: three int64 edge functions at every pixel centre of a triangle's box, with the top-left rule written out, on
vertices snapped to 1/256 pixel; NumPy alone, nothing of topleft. Depth: the plane through the snapped vertices, in the
widest float that NumPy has, rounded once to float32. This is slow and simple on purpose.

Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.exact.area import draw_area
from benchmarks.scenes.cases import Scene

SUBPIXELS = 256
AREA_ROUNDING = 1e-9
"""What sums of areas are off by at most."""

CHUNK = 1 << 20
"""Samples looked at together: about 200 MB of temporaries."""

OTHER_SURFACE = 1e-4
"""Window depth: far more than the rounding of any peer's depth buffer."""

Picture = dict[str, NDArray[Any]]
"""What a contestant drew: any of "triangle" (H, W) int32, "depth" float32, "mask" bool, "color" (H, W, 3) uint8."""


@dataclass(frozen=True)
class Error:
    """How far a picture is from the exact one."""

    wrong_px: int
    max_depth_error: float | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"wrong_px": self.wrong_px, "max_depth_error": self.max_depth_error}


def compare(picture: Picture, exact: Picture) -> Error | AreaError:
    """Count wrong pixels: ids where there are ids, else colours, else what is covered; areas: see `area_error`.

    With depth and no ids, a pixel whose depth is off by more than `OTHER_SURFACE` is wrong too: another triangle shows.
    The largest difference of depth is over the pixels that both cover; with ids, over those whose ids agree.
    """
    if "area" in exact:
        return area_error(picture, exact["area"])
    difference = None
    if "depth" in picture and "depth" in exact:
        both = coverage(picture) & exact["mask"]
        difference = np.zeros(both.shape)
        difference[both] = np.abs(picture["depth"][both].astype(np.float64) - exact["depth"][both])
    if "triangle" in picture:
        wrong = picture["triangle"] != exact["triangle"]
    elif "color" in picture:
        wrong = (picture["color"] != exact["color"]).any(axis=-1)
    else:
        wrong = coverage(picture) != exact["mask"]
        if difference is not None:
            wrong |= difference > OTHER_SURFACE
    if difference is None or not both.any():
        return Error(int(wrong.sum()), None)
    if "triangle" in picture:
        both &= ~wrong
    return Error(int(wrong.sum()), float(difference[both].max(initial=0)))


@dataclass(frozen=True)
class AreaError:
    """How far a smooth picture of white triangles that do not overlap is from the areas that they cover."""

    wrong_px: int
    """Pixels that are covered whole and not white: seams."""
    darkest: float
    """Of these, 0 to 1."""
    rms: float | None
    """Over the partly covered pixels, if there are any."""
    worst: float | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"wrong_px": self.wrong_px, "darkest": self.darkest, "rms": self.rms, "worst": self.worst}


def area_error(picture: Picture, area: NDArray[np.float64]) -> AreaError:
    """Compare coverage, as such or as the brightness of the first channel, with exact areas."""
    drawn = picture["area"].astype(np.float64) if "area" in picture else picture["color"][..., 0] / 255
    is_whole = area > 1 - AREA_ROUNDING
    is_part = (area > AREA_ROUNDING) & ~is_whole
    error = np.abs(drawn - area)[is_part]
    rms, worst = (float(np.sqrt((error**2).mean())), float(error.max())) if error.size else (None, None)
    whole = drawn[is_whole]
    return AreaError(int((whole < 1).sum()), float(whole.min(initial=1)), rms, worst)


def coverage(picture: Picture) -> NDArray[np.bool_]:
    """Which pixels a picture covers."""
    if "mask" in picture:
        return picture["mask"].astype(bool)
    if "triangle" in picture:
        return picture["triangle"] >= 0
    return np.isfinite(picture["depth"])


def draw_exact(scene: Scene) -> Picture:
    """The picture that a contestant should draw; nothing where there is no exact one."""
    if scene.task == "smooth-fill":
        is_white = scene.colors is not None and (scene.colors == 255).all()
        return {"area": draw_area(scene.vertices, scene.triangles, scene.size)} if is_white else {}
    width, height = scene.size
    xy_fx, z = snap(scene)
    ids = np.full(width * height, -1, np.int32)
    with_depth = scene.task in ("visibility", "depth-2d")
    depth = np.full(width * height, np.inf, np.float32)
    for pixel, triangle, z_sample in samples(scene, xy_fx, z if with_depth else None):
        if with_depth:
            resolve_nearest(ids, depth, pixel, triangle, z_sample)
        else:
            np.maximum.at(ids, pixel, triangle)  # painter's order
    picture: Picture = {"triangle": ids.reshape(height, width), "mask": (ids >= 0).reshape(height, width)}
    if with_depth:
        picture["depth"] = depth.reshape(height, width)
    if scene.colors is not None:
        palette = np.concatenate([scene.colors, np.zeros((1, scene.colors.shape[1]), scene.colors.dtype)])
        picture["color"] = palette[picture["triangle"]]
    return picture


def snap(scene: Scene) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Vertices in fixed point (V, 2) and their depth (V,), each operation rounded as the rules say."""
    vertices = scene.vertices
    if scene.transform is None:
        z = vertices[:, 2] if vertices.shape[1] > 2 else np.zeros(len(vertices))
        return np.rint(vertices[:, :2].astype(np.float64) * SUBPIXELS).astype(np.int64), z.astype(np.float64)
    matrix = scene.transform.astype(vertices.dtype)
    x, y, z = vertices.T
    clip = [((row[0] * x + row[1] * y) + row[2] * z) + row[3] for row in matrix]
    ndc_x, ndc_y, ndc_z = (np.float64(c) / np.float64(clip[3]) for c in clip[:3])
    width, height = scene.size
    xy_px = np.stack([(ndc_x + 1) * (width / 2), (1 - ndc_y) * (height / 2)], axis=1)
    return np.rint(xy_px * SUBPIXELS).astype(np.int64), (ndc_z + 1) / 2


def samples(
    scene: Scene, xy_fx: NDArray[np.int64], z: NDArray[np.float64] | None
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float32] | None]]:
    """Covered samples, a chunk at a time: flat pixel index, triangle id, depth rounded to float32."""
    width, height = scene.size
    corners = xy_fx[scene.triangles]
    area = cross(corners[:, 0], corners[:, 1], corners[:, 2])
    half = SUBPIXELS // 2
    low = np.maximum(-((half - corners.min(axis=1)) // SUBPIXELS), 0)  # first centre at or beyond the minimum
    high = np.minimum((corners.max(axis=1) - half) // SUBPIXELS, np.array([width - 1, height - 1]))
    extent = np.maximum(high - low + 1, 0)
    n_samples = extent.prod(axis=1)
    keep = (area != 0) & (n_samples > 0)
    if scene.cull == "back":
        keep &= area < 0  # front: counter-clockwise with y up
    kept = np.flatnonzero(keep)
    ends = np.cumsum(n_samples[kept])
    first = 0
    while first < len(kept):
        done = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, done + CHUNK, side="right")), first + 1)
        rows = kept[first:last]
        first = last
        counts = n_samples[rows]
        of = np.repeat(np.arange(len(rows)), counts)
        offset = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        box_width = extent[rows, 0][of]
        column, row = low[rows, 0][of] + offset % box_width, low[rows, 1][of] + offset // box_width
        sample = np.stack([column, row], axis=1) * SUBPIXELS + half
        # Positive inside, whatever the winding: two corners change places where the area is negative.
        a, b, c = corners[rows].swapaxes(0, 1)
        turned = (area[rows] < 0)[:, None]
        b, c = np.where(turned, c, b), np.where(turned, b, c)
        weights = [cross(p[of], q[of], sample) for p, q in ((b, c), (c, a), (a, b))]
        accept = [owns_border(q - p)[of] for p, q in ((b, c), (c, a), (a, b))]
        inside = np.logical_and.reduce([(w > 0) | ((w == 0) & own) for w, own in zip(weights, accept, strict=True)])
        z_sample = None
        if z is not None:
            corner_z = z[scene.triangles[rows]].astype(np.longdouble)
            za, zb, zc = corner_z.T
            zb, zc = np.where(turned[:, 0], zc, zb), np.where(turned[:, 0], zb, zc)
            mine = of[inside]
            w0, w1, w2 = (w[inside].astype(np.longdouble) for w in weights)
            offset_z = (w1 * (zb - za)[mine] + w2 * (zc - za)[mine]) / (w0 + w1 + w2)
            z_sample = (za[mine] + offset_z).astype(np.float32)
        yield (row * width + column)[inside], rows[of[inside]].astype(np.int32), z_sample


def cross(a: NDArray[np.int64], b: NDArray[np.int64], c: NDArray[np.int64]) -> NDArray[np.int64]:
    """Twice the signed area, positive clockwise on the screen (y down)."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def owns_border(edge: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether samples on the edge are inside: top edges run right, left edges run up (clockwise, y down)."""
    return ((edge[:, 1] == 0) & (edge[:, 0] > 0)) | (edge[:, 1] < 0)


def resolve_nearest(
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    pixel: NDArray[np.int64],
    triangle: NDArray[np.int32],
    z: NDArray[np.float32] | None,
) -> None:
    """Keep the nearest sample of each pixel, of equals the one with the lowest id. Ids of a chunk are all higher."""
    order = np.lexsort((triangle, z, pixel))
    pixel, triangle, z = pixel[order], triangle[order], z[order]
    leads = np.ones(len(pixel), bool)
    leads[1:] = pixel[1:] != pixel[:-1]
    pixel, triangle, z = pixel[leads], triangle[leads], z[leads]
    nearer = z < depth[pixel]
    ids[pixel[nearer]], depth[pixel[nearer]] = triangle[nearer], z[nearer]
