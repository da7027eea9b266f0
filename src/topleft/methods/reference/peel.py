"""The exact reference of depth peeling and of compositing.

In: scenes, as in `reference`; colours of layers.  Out: the sorted layers of each pixel, and the colour through them.

Based on: C. Everitt, Interactive Order-Independent Transparency, 2001;
T. Porter, T. Duff, Compositing Digital Images, 1984.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from math import inf
from typing import Any

import numpy as np

from topleft.methods import reference
from topleft.methods.reference import Point, round_to_float32


def layers(
    vertices: Any, triangles: Any, size: Point, n_layers: int, *, depth_test: str = "less", **view: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return ids, int32 (H, W, K), and depths, float32 (H, W, K), of the layers of each pixel.

    All fragments of a pixel are sorted by the depth that a buffer would hold, rounded to float32, then by index.

    Examples
    --------
    >>> vertices = [[0, 0, 5], [4, 0, 5], [0, 4, 5], [0, 0, 0], [2, 0, 2], [0, 2, 2]]
    >>> layers(vertices, [[0, 1, 2], [3, 4, 5]], (3, 1), 2)[0].tolist()
    [[[1, 0], [0, -1], [0, -1]]]
    """
    sign = -1 if depth_test == "greater" else 1
    fragments_of: dict[Point, list[tuple[float, int]]] = defaultdict(list)
    for fragment in reference.fragments(vertices, triangles, size, **view):
        depth = round_to_float32(fragment.depth()) if np.shape(vertices)[1] > 2 else 0.0
        fragments_of[fragment.row, fragment.column].append((sign * depth, fragment.piece.triangle))
    shape = (size[1], size[0], n_layers)
    ids, depths = np.full(shape, -1, np.int32), np.full(shape, sign * inf, np.float32)
    for pixel, keys in fragments_of.items():
        for k, (key, triangle) in enumerate(sorted(keys)[:n_layers]):
            ids[pixel][k], depths[pixel][k] = triangle, sign * key
    return ids, depths


def over(colors: Sequence[Sequence[Fraction]], background: Sequence[Fraction] | None) -> list[Fraction]:
    """Return the composite of straight colours, the nearest first, alpha last and 1 for opaque: straight again.

    `background` lies behind all layers; None is nothing. The result is zeros where nothing is visible.

    Examples
    --------
    >>> half_white, black = [Fraction(1), Fraction(1, 2)], [Fraction(0), Fraction(1)]
    >>> over([half_white], black), over([half_white], None)
    ([Fraction(1, 2), Fraction(1, 1)], [Fraction(1, 1), Fraction(1, 2)])
    """
    layers = [*colors, *([] if background is None else [background])]
    n = len(layers[0]) - 1 if layers else 0
    light, alpha = [Fraction(0)] * n, Fraction(0)
    for *color, alpha_of_layer in layers:
        share = (1 - alpha) * alpha_of_layer
        light = [seen + share * c for seen, c in zip(light, color, strict=True)]
        alpha += share
    return [c / alpha if alpha else Fraction(0) for c in light] + [alpha]
