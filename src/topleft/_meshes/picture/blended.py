"""Draws pictures with blended materials: `alpha_mode="blend"`, and colours with alpha.

Input: `Mesh` or `Scene`, `Camera`. Output: the visibility buffer of opaque triangles; the rest, laid over its picture.

Opaque triangles are drawn as ever. The others are peeled, layers that these hide are left out, the rest is shaded,
each with its own opacity, and laid over it front to back, in linear light: their order in the mesh does not matter.
With several samples a pixel each sample is composited by itself, and the light is averaged.

Based on: Everitt, C., "Interactive Order-Independent Transparency", 2001; Porter, T. and T. Duff, "Compositing Digital
Images", SIGGRAPH 1984.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, U8
from topleft._core.base.cached import cached_property
from topleft._core.base.color import LIGHT_OF_SRGB, LINEAR_ONE, srgb_tables
from topleft._core.base.memory import SCRATCH
from topleft._core.raster.fragments import Fragments, SampleBuffers
from topleft._core.raster.peel import peel_meshes
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, has_opacity, is_laid
from topleft._meshes.picture.fragments import shown_of
from topleft._meshes.picture.placed import Mask, Placed
from topleft._meshes.picture.shade import Lit, ShadingOptions, ShownInstance
from topleft._meshes.scene.scene import Scene, collapsed

BLENDING = ("smooth", "flat", "unlit")
"""Pictures of other shadings show the nearest surface, as if it were opaque."""

LAYERS, MOST_LAYERS = 4, 16
"""Layers of a pixel: as many as most need; and all that are looked at, where some pixel has more."""

CLEAR = (0, 0, 0, 0)

COLORED = Material(alpha_mode="blend")
"""Of a mesh with nothing but colours, which means their alpha."""


def blended_triangles(mesh: Mesh, material: Material | None) -> Mask | None:
    """The blended triangles (T,), by the materials of the mesh or this material; None if there are none."""
    given = mesh.materials if material is None else (material,)
    materials = given or (COLORED,)
    are_blended = [one.alpha_mode == "blend" and has_opacity(one, mesh) for one in materials]
    if not any(are_blended):
        return None
    rows = mesh.material_of_triangle if given is mesh.materials else None
    found = np.full(len(mesh.triangles), are_blended[0]) if rows is None else np.array(are_blended)[rows]
    if all(has_opaque_rest(one, mesh) for one, is_it in zip(materials, are_blended, strict=True) if is_it):
        found &= (mesh.colors[:, 3] < 255)[mesh.triangles].any(axis=1)  # type: ignore[index]
    return found if found.any() else None


def has_opaque_rest(material: Material, mesh: Mesh) -> bool:
    """Whether the material is opaque where the colours of the vertices are."""
    texture = material.texture if is_laid(material.texture, mesh) else None
    return material.opacity == 1 and not (texture is not None and texture.has_alpha)


def mask_of(mesh: Mesh, material: Material | None) -> Mask | None:
    """Which triangles of a mesh blend in a material, from its cache."""
    return mesh.cache.blended.find(material, lambda: blended_triangles(mesh, material))


def blended_masks(scene: Scene, options: ShadingOptions) -> list[Mask | None] | None:
    """The blended triangles of each instance; None where there are none, or the shading ignores them."""
    if options.mode not in BLENDING:
        return None
    material = options.material

    def make() -> list[Mask | None]:
        return [mask_of(one.mesh, one.material if material is None else material) for one in scene]

    masks = scene.cache.blended.find(material, make)
    return None if all(mask is None for mask in masks) else masks


def lay_blended(
    picture: U8, solid: Fragments, placed: Placed, masks: Sequence[Mask | None], options: ShadingOptions
) -> None:
    """Lay the visible blended triangles over the picture of opaque triangles; masks are of drawn triangles."""
    if 0 not in placed.view.size:
        TransparentPass(placed, masks, options).lay_over(picture, solid)


class TransparentPass:
    """The blended triangles of a scene, which are laid over the opaque ones."""

    def __init__(self, placed: Placed, masks: Sequence[Mask | None], options: ShadingOptions) -> None:
        self.placed, self.view, self.masks, self.camera = placed, placed.view, masks, placed.camera
        self.scene = placed.whole  # which has the triangles that ids count
        self.under = options
        self.options = replace(options, background=CLEAR, shows_opacity=True)

    @cached_property
    def blended(self) -> Placed:
        """The blended triangles alone."""
        inverse = [None if mask is None else ~mask for mask in self.masks]
        return self.placed.with_scene(collapsed(self.placed.scene, inverse, keeps_others=False))

    @cached_property
    def snapped(self) -> list[engine.SnappedMesh]:
        """The blended triangles, snapped, to be peeled."""
        return [self.blended.snap(i) for i, mask in enumerate(self.masks) if mask is not None]

    @cached_property
    def lit(self) -> Lit:
        """The blended triangles, with the light that shades them."""
        some = [i for i, mask in enumerate(self.masks) if mask is not None]
        bent, first_ids = self.placed.bent, self.placed.scene.first_ids
        shown = []
        for i, one in zip(some, self.snapped, strict=True):
            mesh = self.scene[i].mesh if bent is None else bent[i].mesh_of(self.scene[i].mesh)
            own = self.scene[i]
            shown.append(ShownInstance(one, mesh, own.transform, int(first_ids[i]), own.material))
        return Lit(shown, self.camera, self.view.size, self.options)

    def lay_over(self, picture: U8, frags: Fragments) -> None:
        """Lay the visible blended triangles over the picture of the opaque ones."""
        positions = self.placed.positions
        opaque = Lit(shown_of(frags, self.scene), self.camera, self.view.size, self.under)
        layers = [self.peel(frags, k) for k in range(len(positions))]
        is_seen = np.logical_or.reduce([ids[0] >= 0 for ids, _ in layers])
        at = np.nonzero(is_seen)
        numbers = np.empty(is_seen.shape, np.int32)
        numbers[at] = np.arange(len(at[0]), dtype=np.int32)
        light, alpha = np.zeros((len(at[0]), 3), np.float32), np.zeros(len(at[0]), np.float32)
        for k, planes in enumerate(layers):
            under = picture
            if len(positions) > 1:
                sample = frags.sample(k).only(*at)
                under = opaque.picture(sample._buffers(), np.array(positions[k], np.int32))
            self.composite(*planes, positions[k], under[at], numbers, light, alpha)
        color = light / np.maximum(alpha, np.float32(1e-20))[:, None]
        steps = np.rint(np.minimum(color, 1) * LINEAR_ONE).astype(np.int64)
        picture[at[0], at[1], :3] = srgb_tables()[1][steps]
        picture[at[0], at[1], 3] = np.rint(alpha * np.float32(255 / len(positions))).astype(np.uint8)

    def peel(self, frags: Fragments, k: int) -> tuple[npt.NDArray[np.int32], F32]:
        """The layers of a sample that nothing opaque hides, planes (K, H, W) of ids and depths."""
        nearest, at = frags.drawn_planes[1][k], self.placed.positions[k]
        for n in (LAYERS, MOST_LAYERS):
            ids, depth = peel_meshes(SCRATCH, [self.snapped], self.view, n, is_farthest=False, at_fx=at)
            for own_ids, own_depth in zip(ids, depth, strict=True):
                if not (own_ids >= 0).any():
                    break
                own_ids[own_depth > nearest] = -1
            if not (ids[-1] >= 0).any():
                break
        return ids, depth

    def composite(
        self,
        ids: npt.NDArray[np.int32],
        depth: F32,
        at_sample: tuple[int, int],
        under: U8,
        numbers: npt.NDArray[np.int32],
        light: F32,
        alpha: F32,
    ) -> None:
        """Add a sample's colours to light times opacity (P, 3), and to opacity (P,); `numbers` (H, W) names the pixels.

        `under` (P, 4): the colours of the opaque picture.
        """
        through = np.ones(len(under), np.float32)
        for k in range(len(ids)):
            if not (ids[k] >= 0).any():
                break
            seen = ids[k] >= 0
            layer = SampleBuffers.of(ids[k : k + 1], depth[k : k + 1])
            own, pixels = self.lit.picture(layer, np.array(at_sample, np.int32))[seen], numbers[seen]
            share = through[pixels] * (own[:, 3] / np.float32(255))
            light[pixels] += share[:, None] * LIGHT_OF_SRGB[own[:, :3]]
            through[pixels] -= share
        share = through * (under[:, 3] / np.float32(255))
        light += share[:, None] * LIGHT_OF_SRGB[under[:, :3]]
        alpha += 1 - through + share
