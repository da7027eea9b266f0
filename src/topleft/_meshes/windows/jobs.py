"""Windows of a raster as jobs for other processes.

Input: a painter, and the payload of a window. Output: objects that are called and return pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

from topleft._core.base.array_types import I32, Array
from topleft._core.base.arrays import as_aligned
from topleft._meshes.windows.ahead import kept_memory
from topleft._meshes.windows.blocks import Triangles
from topleft._meshes.windows.drawing import Crop, Painter, Payload


@dataclass(frozen=True)
class SentJob:
    """A window with all that it needs."""

    painter: Painter
    payload: Payload
    crop: Crop

    def __call__(self) -> Array:
        """Draw it."""
        return self.painter.window(self.payload, self.crop)


@dataclass(frozen=True)
class MappedJob:
    """A window of a mesh in files: it carries their names and the indices of its triangles."""

    triangles: Triangles
    painter: Painter
    which: I32
    crop: Crop

    def __call__(self) -> Array:
        """Draw it."""
        which = as_aligned(self.which)  # bytes that were received lie anywhere
        payload = self.painter.gather(self.triangles, which, kept_memory())
        return self.painter.window(payload, self.crop)
