"""Layers: what a view of a mesh shows besides its colours, by name.

Input: a mesh, a camera and the options of `render`. Output: an array for each name asked for; nothing else is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.api import Rasterizer
from topleft.camera import Camera
from topleft.fragments import Fragments
from topleft.mesh import Mesh
from topleft.render import default_camera, rasterize_mesh, render
from topleft.shade import eye_normals

__all__ = ["LAYERS", "Shot", "check_layers", "draw_layers"]

Array = npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class Shot:
    """A view that layers are taken of: `options` are those of `render`.

    What layers hold may lie in the memory of `rasterizer`, which the next picture overwrites.
    """

    mesh: Mesh
    camera: Camera | None
    size: tuple[int, int]
    options: Mapping[str, Any] = field(default_factory=dict)
    rasterizer: Rasterizer | None = None

    @cached_property
    def eye(self) -> Camera:
        """The camera, or the one that `render` takes where none is given."""
        return default_camera(self.mesh, self.size) if self.camera is None else self.camera

    @cached_property
    def frags(self) -> Fragments:
        """The visibility buffer, drawn when the first layer needs it."""
        shared = {name: self.options[name] for name in ("cull", "threads") if name in self.options}
        return rasterize_mesh(self.mesh, self.eye, self.size, rasterizer=self.rasterizer, **shared)


def color(shot: Shot) -> Array:
    """The picture (H, W, 4) uint8 of `render`."""
    return render(shot.mesh, shot.eye, shot.size, rasterizer=shot.rasterizer, **shot.options)


def alpha(shot: Shot) -> Array:
    """255 where the mesh is, 0 elsewhere: (H, W) uint8."""
    return shot.frags.mask.view(np.uint8) * np.uint8(255)


def depth(shot: Shot) -> Array:
    """Window depth (H, W) float32: 0 near, 1 far, +inf where nothing is."""
    return shot.frags.depth


def triangle(shot: Shot) -> Array:
    """Index of the triangle that shows, (H, W) int32, -1 where nothing is."""
    return shot.frags.triangle


def normals(shot: Shot) -> Array:
    """Unit normals in eye space (x right, y up, z to the viewer), (H, W, 3) float32, 0 where nothing is."""
    frags = shot.frags
    directions = np.zeros((*frags.triangle.shape, 3), np.float32)
    directions[frags.mask] = eye_normals(frags, shot.mesh, shot.eye, is_smooth=True)
    return directions


LAYERS: Mapping[str, Callable[[Shot], Array]] = MappingProxyType(
    {"color": color, "alpha": alpha, "depth": depth, "id": triangle, "normals": normals}
)
"""The only list of layers: the command line, batches and files read it."""


def check_layers(names: Iterable[str]) -> tuple[str, ...]:
    """Return names of layers, each once.

    Raises
    ------
    ValueError
        If there is no such layer.
    """
    if isinstance(names, str):
        names = (names,)
    checked = tuple(dict.fromkeys(names))
    for name in checked:
        if name not in LAYERS:
            raise ValueError(f"layers must be some of {', '.join(LAYERS)}, got {name!r}")
    return checked


def draw_layers(names: Iterable[str], shot: Shot) -> dict[str, Array]:
    """Return arrays by name, in the order asked for.

    Raises
    ------
    ValueError
        If there is no such layer, or an option is unknown.
    """
    # `color` may draw its visibility buffer over the one of the others, in the same memory: it is the same one.
    return {name: LAYERS[name](shot) for name in check_layers(names)}
