"""Chart (c): which of two nearly coplanar sheets is seen, by the format that depth is kept in.

The frame is cut into cells, and each holds two triangles: one anywhere between the near and the far plane, tilted, and
the same one scaled away from the eye by 1 + 2**-bits. So they have the same corners in the picture, and the second lies
behind the first at every pixel. Corners are on quarters of a pixel and distances have 12 bits, so that all these
numbers are exact in float64: no picture is needed to know the truth. In half of the cells the one behind comes first.

Out: `depth` of a record: how many of the covered pixels show the sheet behind.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.options import AccuracyOptions

F64 = NDArray[np.float64]
BOOL = NDArray[np.bool_]

FRAME_PX, CELL_PX = 512, 16
NEAR = 1.0
RATIOS = (100, 10_000, 1_000_000)
"""Far over near."""
BITS = tuple(range(2, 31))
DISTANCE_BITS = 12
"""With 11 bits of a quarter of a pixel and 30 of the gap: 53, as float64 has."""


@dataclass(frozen=True)
class Sheets:
    """Pairs of triangles: corners in pixels (N, 3, 2), distance w of those in front (N, 3), and how far behind."""

    corners_px: F64
    front_w: F64
    bits: int
    far: float
    is_behind_first: BOOL

    @property
    def behind_w(self) -> F64:
        """Distance of the corners behind, exact."""
        return self.front_w * (1 + 2.0**-self.bits)


Pixels = tuple[NDArray[np.int64], F64]
"""The cell of each covered pixel, and the weights of its corners (M, 3)."""
Count = Callable[[Sheets, int, Pixels], int]
"""How many pixels of the frame show the sheet behind."""


def make_sheets(bits: int, ratio: float, frame_px: int = FRAME_PX, seed: int = 7) -> Sheets:
    """Return a pair in each cell of the frame; distances are spread evenly over the logarithm."""
    rng = np.random.default_rng(seed)
    n_across = frame_px // CELL_PX
    n = n_across**2
    cell = np.stack([np.arange(n) % n_across, np.arange(n) // n_across], axis=-1)
    angle = rng.uniform(0, 2 * np.pi, (n, 1)) + np.array([0, 2, 4]) * np.pi / 3
    corners = (cell[:, None] + 0.5) * CELL_PX + 7 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    low, high = NEAR * 1.25, NEAR * ratio / 2
    w = low * (high / low) ** rng.uniform(0, 1, (n, 1)) * rng.uniform(0.8, 1.25, (n, 3))
    fraction, exponent = np.frexp(w)
    w = np.ldexp(np.rint(np.ldexp(fraction, DISTANCE_BITS)), exponent - DISTANCE_BITS)
    return Sheets(np.rint(corners * 4) / 4, w, bits, NEAR * ratio, rng.random(n) < 0.5)


def standard_z(w: F64, far: float) -> F64:
    """Window depth: 0 at the near plane, 1 at the far plane."""
    return (far - NEAR * far / w) / (far - NEAR)


def reversed_z(w: F64, far: float) -> F64:
    """1 at the near plane, 0 at the far plane."""
    return (NEAR * far / w - NEAR) / (far - NEAR)


def shows_behind(sheets: Sheets, frame_px: int, **options: Any) -> int:
    """Return how many pixels show the sheet behind, as topleft draws them."""
    import topleft as tl

    frags = tl.rasterize(*clip_scene(sheets, frame_px, bool(options)), (frame_px, frame_px), threads=1, **options)
    ids = frags.triangle[frags.triangle >= 0]
    is_first = ids % 2 == 0
    return int((is_first == sheets.is_behind_first[ids // 2]).sum())


def clip_scene(sheets: Sheets, frame_px: int, is_reversed: bool) -> tuple[F64, NDArray[np.int32]]:
    """Return clip-space vertices and triangles, the pair of cell i at 2 i and 2 i + 1 in the order they are drawn."""
    pairs = []
    for w in (sheets.front_w, sheets.behind_w):
        ndc = sheets.corners_px * (2 / frame_px) * [1, -1] + [-1, 1]
        far = sheets.far
        z = reversed_z(w, far) * w if is_reversed else ((far + NEAR) * w - 2 * far * NEAR) / (far - NEAR)
        pairs.append(np.stack([ndc[..., 0] * w, ndc[..., 1] * w, z, w], axis=-1))
    front, behind = pairs
    flip = sheets.is_behind_first[:, None, None]
    vertices = np.stack([np.where(flip, behind, front), np.where(flip, front, behind)], axis=1).reshape(-1, 4)
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)


def shows_behind_as(keep: Callable[[F64, F64], NDArray[Any]]) -> Count:
    """Return the count for a format: `keep` turns screen weights (M, 3) and corner depths (M, 3) into kept numbers."""

    def count(sheets: Sheets, frame_px: int, pixels: Pixels) -> int:  # noqa: ARG001
        i_cell, weights = pixels
        front, behind = (keep(weights, standard_z(w, sheets.far)[i_cell]) for w in (sheets.front_w, sheets.behind_w))
        is_wrong = (behind < front) | ((behind == front) & sheets.is_behind_first[i_cell])
        return int(is_wrong.sum())

    return count


def covered(sheets: Sheets, frame_px: int) -> Pixels:
    """Return the cell of each covered pixel and the weights of its corners; exact but for the division."""
    import topleft as tl

    triangles = np.arange(3 * len(sheets.corners_px), dtype=np.int32).reshape(-1, 3)
    ids = tl.rasterize(sheets.corners_px.reshape(-1, 2), triangles, (frame_px, frame_px), threads=1).triangle
    row, column = np.nonzero(ids >= 0)
    i_cell = ids[row, column].astype(np.int64)
    center = np.stack([column, row], axis=-1) + 0.5
    corners = sheets.corners_px[i_cell]
    edges = []
    for k in range(3):
        p, q = corners[:, (k + 1) % 3], corners[:, (k + 2) % 3]
        edges.append((q[:, 0] - p[:, 0]) * (center[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (center[:, 0] - p[:, 0]))
    weights = np.stack(edges, axis=-1)
    return i_cell, weights / weights.sum(axis=-1, keepdims=True)


def as_integer(n_bits: int) -> Callable[[F64, F64], NDArray[Any]]:
    """Depth in float64, then rounded to an integer of so many bits."""
    return lambda weights, z: np.rint((weights * z).sum(axis=-1) * (2**n_bits - 1)).astype(np.int64)


def in_float32(weights: F64, z: F64) -> NDArray[Any]:
    """Depth as many renderers have it: corners, weights and sum in float32."""
    w, z32 = weights.astype(np.float32), z.astype(np.float32)
    return (w[:, 0] * z32[:, 0] + w[:, 1] * z32[:, 1]) + w[:, 2] * z32[:, 2]


FORMATS: dict[str, Count] = {
    "topleft, reversed": lambda sheets, frame_px, _: shows_behind(
        sheets, frame_px, depth_test="greater", clip_depth="zero_to_one"
    ),
    "topleft": lambda sheets, frame_px, _: shows_behind(sheets, frame_px),
    "24-bit integer": shows_behind_as(as_integer(24)),
    "16-bit integer": shows_behind_as(as_integer(16)),
    "float32 arithmetic": shows_behind_as(in_float32),
}
"""The library draws the first two, float32 that is rounded once; the others are made by NumPy."""


def measure_depth(options: AccuracyOptions) -> dict[str, Any]:
    """Return `depth`: a row for each format, near/far ratio and distance between the sheets."""
    frame_px = min(FRAME_PX, options.frame_px)
    pixels = covered(make_sheets(0, RATIOS[0], frame_px), frame_px)  # the same ones for all gaps and ratios
    rows = []
    for ratio in RATIOS:
        for bits in BITS:
            sheets = make_sheets(bits, ratio, frame_px)
            for name, count in FORMATS.items():
                wrong = count(sheets, frame_px, pixels)
                rows.append({"format": name, "ratio": ratio, "bits": bits, "wrong_px": wrong, "n_px": len(pixels[0])})
    return {"depth": rows}
