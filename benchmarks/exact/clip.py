"""The exact picture of triangles in clip space: no divide, no cut, nothing snapped, nothing rounded.

In: (V, 4) vertices. Out: which triangle each pixel centre shows and how many cover it. A pixel is a ray; its weights
in a triangle are 3x3 determinants of x, y and w, and what lies before the near or beyond the far plane is told at the
point that the ray meets. Also here: the picture of what the rules of the library leave after clip and snap.

Based on: M. Olano, T. Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.reference.integers import ExactPicture, WidePoints, draw_points

Row = tuple[int, int, int]


def draw_clip(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], size: tuple[int, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the last triangle at each pixel centre (-1: none) and the count, both (H, W), for -w <= z <= w, w > 0."""
    width, height = size
    ratios = [[x.as_integer_ratio() for x in row] for row in vertices.tolist()]
    unit = max(d for row in ratios for _, d in row)
    points = [[n * (unit // d) for n, d in row] for row in ratios]
    # A centre times (width * height): NDC with y up, and 1.
    columns = np.array([(2 * j + 1 - width) * height for j in range(width)], object)
    rows = np.array([(height - 2 * i - 1) * width for i in range(height)], object)
    ids, count = np.full((height, width), -1, np.int32), np.zeros((height, width), np.int32)
    for index, triangle in enumerate(triangles.tolist()):
        a, b, c = ([points[k][0], points[k][1], points[k][3]] for k in triangle)
        normals = [cross(b, c), cross(c, a), cross(a, b)]
        turn = sum(x * n for x, n in zip(a, normals[0], strict=True))
        if turn == 0:
            continue
        sign = 1 if turn > 0 else -1
        is_inside = np.ones((height, width), bool)
        weights = []
        for normal in normals:
            nx, ny, nw = (sign * x for x in normal)
            value = np.add.outer(ny * rows + nw * width * height, nx * columns)
            is_owner = nx > 0 or (nx == 0 and ny < 0)  # left; top, since y points up here
            is_inside &= (value >= 0 if is_owner else value > 0).astype(bool)
            weights.append(value)
        zs, ws = ([points[k][n] for k in triangle] for n in (2, 3))
        for distances in ([z + w for z, w in zip(zs, ws, strict=True)], [w - z for z, w in zip(zs, ws, strict=True)]):
            depth: Any = sum(value * d for value, d in zip(weights, distances, strict=True))
            is_inside &= (depth >= 0).astype(bool)
        ids[is_inside] = index
        count += is_inside
    return ids, count


def cross(p: list[int], q: list[int]) -> Row:
    """Return the cross product."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def pieces_picture(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], size: tuple[int, int], bits: int
) -> ExactPicture:
    """Return the exact picture of what the reference's clip and snap leave; ids are those of the input triangles."""
    from topleft.methods import reference

    pieces = reference.pieces(vertices, triangles, size, subpixel_bits=bits)
    xy = [(2 * v.xy_fx[0], 2 * v.xy_fx[1]) for piece in pieces for v in piece.vertices]
    corners = np.arange(len(xy), dtype=np.int32).reshape(-1, 3)
    picture = draw_points(WidePoints(xy, bits + 1), corners, size)
    names = np.array([piece.triangle for piece in pieces] + [-1], np.int32)
    return ExactPicture(names[picture.triangle], picture.count, picture.is_edge)
