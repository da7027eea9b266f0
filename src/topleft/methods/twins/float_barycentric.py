"""Float barycentric in NumPy: the three weights of the whole bounding box, in the float type of the variant.

In: vertices as they are.  Out: counts.  Source: see float_barycentric.h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture


def cross(a: Any, b: Any, x: Any, y: Any) -> Any:
    """Return twice the signed area of a, b and (x, y), rounded five times."""
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])


def overdraw(vertices: Any, triangles: Any, size: Pixel, variant: str = "") -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    real: Any = np.float64 if variant == "float64" else np.float32
    counts, _ = new_picture(size)
    with np.errstate(all="ignore"):  # a triangle that overflows covers nothing
        for corners in corners_of(vertices, triangles):
            a, b, c = np.array(corners, real)
            area = cross(a, b, *c)
            if area == 0:
                continue
            inv_area = real(1) / area
            box = np.array([a, b, c])
            first_x, first_y = (int(v) for v in np.clip(np.floor(box.min(axis=0)), 0, size))
            last_x, last_y = (int(v) for v in np.clip(np.floor(box.max(axis=0)), -1, np.array(size) - 1))
            x = np.arange(first_x, last_x + 1).astype(real) + real(0.5)
            y = np.arange(first_y, last_y + 1).astype(real)[:, None] + real(0.5)
            weights = [cross(p, q, x, y) * inv_area for p, q in ((b, c), (c, a), (a, b))]
            is_inside = np.all([w >= 0 for w in weights], axis=0)
            counts[first_y : first_y + len(y), first_x : first_x + len(x)] += is_inside
    return counts
