"""The rasterizer of Hunyuan3D, drawn by topleft: ``from topleft.compat import custom_rasterizer``.

Has `rasterize` and `interpolate` of the package `custom_rasterizer`, without CUDA and without building it. Input:
tensors of PyTorch, or arrays. Output: the same kind. Based on: what the package's own kernel returns.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import topleft as tl
from topleft.compat._arrays import detached, interpolated, library_of

__all__ = ["interpolate", "rasterize"]


def rasterize(pos: Any, tri: Any, resolution: tuple[int, int]) -> tuple[Any, Any]:
    """Return the nearest face of each pixel, and the weights of its vertices.

    Parameters
    ----------
    pos : (1, V, 4) float
        Clip space; what lies before the near plane, z < -w, is cut, and nothing beyond the far plane.
    tri : (F, 3) integers
    resolution : (height, width)
        Pixels.

    Returns
    -------
    findices : (H, W) int32
        Index of the face, counted from 1; 0 where nothing is.
    barycentric : (H, W, 3) float32
        Weights in space; 0 where nothing is.

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `topleft.rasterize`.

    Notes
    -----
    Row 0 is that of y = -1, and the last that of y = 1; centres of columns go from x = -1 to x = 1 likewise. A centre
    on an edge belongs to one face, by the top-left rule; in Hunyuan3D to each that has the edge.

    Examples
    --------
    >>> from topleft.compat import custom_rasterizer as cr
    >>> pos = [[[-1.0, -1, 0, 1], [1, -1, 0, 1], [-1, 1.5, 0, 1]]]
    >>> findices, barycentric = cr.rasterize(pos, [[0, 1, 2]], (2, 3))
    >>> findices
    array([[1, 1, 0],
           [1, 0, 0]], dtype=int32)
    """
    height, width = resolution
    of = library_of(pos)
    # centres at -1 and 1 are half a pixel within the picture; y goes down
    inwards = [(width - 1) / width, (1 - height) / height, 1, 1]
    clip, faces = detached(pos)[0].astype(np.float64) * inwards, detached(tri)
    frags = tl.rasterize(clip, faces, (width, height), subpixel_bits="exact", far_clip=False)
    return of.asarray(frags.triangle + 1), of.asarray(frags.barycentric())


def interpolate(col: Any, findices: Any, barycentric: Any, tri: Any) -> Any:
    """Return an attribute of the vertices at each pixel.

    Parameters
    ----------
    col : (1, V, C) float
    findices, barycentric
        Of `rasterize`.
    tri : (F, 3) integers

    Returns
    -------
    (1, H, W, C) float
        0 where nothing is. Of tensors it has gradients by `col` and `barycentric`.

    Examples
    --------
    >>> import numpy as np
    >>> from topleft.compat import custom_rasterizer as cr
    >>> pos = np.array([[[-1.0, -1, 0, 1], [1, -1, 0, 1], [-1, 1.5, 0, 1]]])
    >>> findices, barycentric = cr.rasterize(pos, [[0, 1, 2]], (2, 3))
    >>> cr.interpolate(pos, findices, barycentric, [[0, 1, 2]])[0, 1, 0].round(6)
    array([-1.,  1.,  0.,  1.])
    """
    shown = detached(findices)
    seen = np.flatnonzero(shown)
    corners = detached(tri)[shown.reshape(-1)[seen] - 1]
    found = interpolated(col[0], corners, barycentric.reshape((-1, 3)), seen)
    return found.reshape((1, *shown.shape, found.shape[1]))
