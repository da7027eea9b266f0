"""Keeps what all pictures of a mesh in one size and look share: options that are checked, and the sides that show.

Input: a mesh and the options of `render`. Output: `KeptPicture`, which draws and shades it for a camera; None where a
picture takes more than one pass: where something shows through, or materials have holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import U8
from topleft._core.base.memory import FRESH, Memory, empty
from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.snap import source_of
from topleft._core.raster.static_mesh import draw_static
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import View, ViewOptions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.blended import blended_masks
from topleft._meshes.picture.buffers import lent
from topleft._meshes.picture.holes import cuts_of
from topleft._meshes.picture.instances import DrawnScene, PlacedScene
from topleft._meshes.picture.scene_shade import shade_by
from topleft._meshes.picture.shade import NUMBERS, Lit, ShadingOptions, ShownInstance
from topleft._meshes.scene.scene import EYE, scene_of

MOST_KEPT = 64
"""Pictures that are kept of a mesh: by size, look and sides."""


@dataclass(frozen=True, eq=False)
class KeptPicture:
    """The checked options of pictures of a mesh, whatever the camera; they hold no mesh, which holds them."""

    view: View
    options: ShadingOptions

    def draw(self, mesh: Mesh, camera: Camera, rasterizer: Rasterizer | None) -> U8:
        """The picture (H, W, 4) of the mesh, as a camera without a lens sees it."""
        if rasterizer is None:
            return self.draw_in(FRESH, mesh, camera)
        with lent(rasterizer, self.view.size) as memory:
            return self.draw_in(memory, mesh, camera)

    def draw_in(self, memory: Memory, mesh: Mesh, camera: Camera) -> U8:
        """The same; ids and depth lie in this memory."""
        view = self.view.but(transform=camera.clip_from_world(self.view.size), static=mesh)
        n = len(mesh.triangles)
        at_once = self.options.mode not in NUMBERS and choices.draws_at_once(view, n)
        if at_once and (not choices.pays_to_cluster_shaded(n) or mesh.is_drawn_whole()):
            picture = self.draw_at_once(memory, mesh, camera, view)
            if picture is not None:
                return picture
        frags = draw_static(memory, mesh, view, "less", None, None)
        return shade_by(frags, scene_of(mesh), camera, self.options)

    def draw_at_once(self, memory: Memory, mesh: Mesh, camera: Camera, view: View) -> U8 | None:
        """The same by one call of the engine; None where a vertex lies outside of a clip plane, say."""
        n, shape = len(mesh.vertices), view.size[::-1]
        source = source_of(mesh.vertices, view)
        records = memory.scratch("records", (n * engine.VERTEX_BYTES,), np.uint8)
        waiting = engine.WaitingMesh(source, records, None, mesh.triangles, None, view.how, view.engine_viewport())
        lit = Lit([ShownInstance(waiting, mesh, EYE)], camera, view.size, self.options)
        ids, depth = memory.empty("triangle", shape, np.int32), memory.empty("depth", shape, np.float32)
        picture = empty((*shape, 4), np.uint8)
        return picture if lit.scene.draw(engine.Target(Sink.NEAREST, ids, depth, None), picture) else None


def kept_picture(
    mesh: Mesh, size: tuple[int, int], options: dict[str, Any], shading: dict[str, Any]
) -> KeptPicture | None:
    """The picture of a mesh by the options of a view and of `ShadingOptions`, made once; None if it takes passes."""
    try:
        kinds = tuple(map(type, shading["color"])), tuple(map(type, shading["background"]))  # (1.0, 0, 0) is red
        given = options | shading
        key = size, *given.items(), *map(type, given.values()), *kinds
        pictures = mesh.cache.pictures
        if key in pictures:
            return pictures[key]
    except TypeError:  # a list, say, which may change
        return None
    if len(pictures) == MOST_KEPT:
        pictures.clear()
    made = pictures[key] = make_picture(mesh, size, options, shading)
    return made


def make_picture(
    mesh: Mesh, size: tuple[int, int], options: dict[str, Any], shading: dict[str, Any]
) -> KeptPicture | None:
    """The same, made now."""
    look, scene = ShadingOptions.parse(**shading), scene_of(mesh)
    if blended_masks(scene, look) is not None or any(cuts_of(scene, look.material)):
        return None
    view = View.parse(size, cast(ViewOptions, options))
    placed = PlacedScene(DrawnScene(scene, scene, EYE, None), view, with_depth=True, material=look.material)
    own = placed.view_of(0)
    return KeptPicture(own.but(transform=None, static=None, is_split=own.sampling.n_samples > 1), look)
