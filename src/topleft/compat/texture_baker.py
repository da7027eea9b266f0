"""The baker of Stable Fast 3D, drawn by topleft: ``from topleft.compat.texture_baker import TextureBaker``.

Has the calls of `texture_baker.TextureBaker`, without building it. Input: tensors of PyTorch, or arrays. Output: the
same kind. Based on: the README of the package, and what its own kernel returns.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import topleft as tl
from topleft.compat._arrays import detached, interpolated, library_of

__all__ = ["TextureBaker"]


class TextureBaker:
    """Lays attributes of vertices out as textures.

    Examples
    --------
    >>> import numpy as np
    >>> from topleft.compat.texture_baker import TextureBaker
    >>> uv = np.array([[0.0, 0], [1, 0], [0, 1]], np.float32)
    >>> baker = TextureBaker()
    >>> rast = baker.rasterize(uv, np.array([[0, 1, 2]]), 4)
    >>> baker.get_mask(rast).astype(int)
    array([[0, 0, 0, 0],
           [1, 0, 0, 0],
           [1, 1, 0, 0],
           [1, 1, 1, 0]])
    >>> baker.interpolate(uv, rast, np.array([[0, 1, 2]]))[2, 1].tolist()
    [0.25, 0.5]
    """

    def rasterize(self, uv: Any, face_indices: Any, bake_resolution: int) -> Any:
        """Return the face that lies under each texel, and the weights of its vertices.

        Parameters
        ----------
        uv : (V, 2) float
            Where the vertices lie, 0 to 1, v up.
        face_indices : (F, 3) integers
        bake_resolution : int
            Texels of a side, N.

        Returns
        -------
        (N, N, 4) float32
            Three weights, 0 where nothing is, and the index of the face, -1 where nothing is. Texel (y, x) is looked at
            in u = x / N, v = 1 - y / N: its upper left corner. Where faces overlap the one of lower index shows.

        Raises
        ------
        ValueError, TypeError, IndexError
            As in `topleft.rasterize`.
        """
        n = int(bake_resolution)
        points, faces = detached(uv).astype(np.float64), detached(face_indices)
        px = points * [n, -n] + [0.5, n + 0.5]
        frags = tl.rasterize(px, faces[::-1], n, subpixel_bits="exact")  # later faces cover earlier ones
        rast = np.empty((n, n, 4), np.float32)
        rast[..., :3] = frags.barycentric()
        rast[..., 3] = np.where(frags.mask, len(faces) - 1 - frags.triangle, -1)
        return library_of(uv).asarray(rast)

    def get_mask(self, rast: Any) -> Any:
        """Where a face lies, (N, N) bool, of what `rasterize` returns."""
        return rast[..., -1] >= 0

    def interpolate(self, attr: Any, rast: Any, face_indices: Any) -> Any:
        """Return attributes of vertices at the texels.

        Parameters
        ----------
        attr : (V, C) float
        rast : (N, N, 4) float32
            Of `rasterize`.
        face_indices : (F, 3) integers

        Returns
        -------
        (N, N, C) float
            0 where nothing is. Of tensors it has gradients by `attr`.
        """
        ids = detached(rast)[..., 3].reshape(-1).astype(np.int64)
        seen = np.flatnonzero(ids >= 0)
        found = interpolated(attr, detached(face_indices)[ids[seen]], rast.reshape((-1, 4))[:, :3], seen)
        return found.reshape((*rast.shape[:2], found.shape[1]))

    def forward(self, attr: Any, uv: Any, face_indices: Any, bake_resolution: int) -> Any:
        """Return a texture of attributes, (N, N, C): `rasterize`, then `interpolate`."""
        return self.interpolate(attr, self.rasterize(uv, face_indices, bake_resolution), face_indices)

    __call__ = forward
