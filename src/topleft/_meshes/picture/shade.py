"""Shades the visible pixels of one mesh, resolves several samples a pixel, gives distances and normals.

Input: `Fragments`, the mesh and the camera they were made with. Output: a picture (H, W, 4) uint8, sRGB with alpha.

Light is added up in linear light: colours are decoded from sRGB, lit, and encoded again, so that a surface that gets
half the light is half as bright on a screen. The kernel is csrc/shade/shade.c.

Based on: Phong, B. T., "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975 (normals
interpolated, light computed in the pixel); Blinn, J. F., "Models of Light Reflection for Computer Synthesized
Pictures", SIGGRAPH 1977 (highlights).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32, U8
from topleft._core.base.arrays import shown
from topleft._core.base.color import (
    DEFAULT_COLOR,
    LINEAR_ONE,
    WHITE,
    Color,
    ColorLike,
    as_color,
    id_colors,
    srgb_tables,
)
from topleft._core.base.memory import empty
from topleft._core.base.options import parse
from topleft._core.base.threads import count_threads, parse_threads, run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.sampling import sample_positions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.environment import Environment
from topleft._meshes.model.light import AMBIENT, Fog, Light, as_not_negative
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.texture import Texture
from topleft._meshes.picture.look import ShadingInputs
from topleft.typing import ShadingOption

Places = tuple[npt.NDArray[np.intp], ...]

MIN_PX_PER_THREAD = 1 << 14
"""Pixels whose light is worth a thread: a tenth of a millisecond. A scene is shaded instance by instance."""


class Shading(StrEnum):
    """What the colour of a pixel tells."""

    SMOOTH = "smooth"
    FLAT = "flat"
    UNLIT = "unlit"
    MATCAP = "matcap"
    IDS = "ids"
    DEPTH = "depth"
    NORMALS = "normals"


SHOW_CODES = {Shading.NORMALS: 1, Shading.MATCAP: 2}  # tl_show in csrc/shading.h; light: 0
GREY_OF_NEAREST, GREY_OF_FARTHEST = 224, 32
"""Greys of the depth picture: neither black nor white, so that it shows on both."""


class LookOptions(TypedDict, total=False):
    """The options of `shade` that `render` passes on."""

    lights: Light | Sequence[Light] | None
    ambient: float | None
    material: Material | None
    matcap: Texture | None
    fog: Fog | None
    environment: Environment | None


@dataclass(frozen=True, eq=False)
class ShadingOptions:
    """The options of `topleft.shade`, checked."""

    mode: Shading
    color: Color
    background: Color
    depth_range: tuple[float, float] | None
    lights: Sequence[Light] | None
    ambient: float
    material: Material | None
    matcap: Texture | None
    fog: Fog | None
    environment: Environment | None
    threads: int | None
    shows_opacity: bool = False
    """Whether the picture's alpha is the opacity of the surface."""

    @classmethod
    def parse(
        cls,
        shading: ShadingOption = "smooth",
        color: ColorLike = DEFAULT_COLOR,
        background: ColorLike = WHITE,
        depth_range: tuple[float, float] | None = None,
        lights: Light | Sequence[Light] | None = None,
        ambient: float | None = None,
        material: Material | None = None,
        matcap: Texture | None = None,
        fog: Fog | None = None,
        environment: Environment | None = None,
        threads: int | None = None,
    ) -> ShadingOptions:
        """Check the options of a call."""
        mode = parse(Shading, "shading", shading)
        lights = (lights,) if isinstance(lights, Light) else lights
        if lights is not None and (not isinstance(lights, Iterable) or isinstance(lights, np.ndarray | str | dict)):
            raise TypeError(f"lights must be a Light or a sequence of them, got {shown(lights)}")
        _check_types(lights=(lights or ()), material=material, matcap=matcap, fog=fog, environment=environment)
        if mode is Shading.MATCAP and matcap is None:
            raise ValueError("matcap must be a Texture for shading 'matcap', got None")
        if environment is not None:  # which lights by itself
            lights, ambient = lights or (), ambient or 0.0
        return cls(
            mode,
            as_color("color", color, 3),
            as_color("background", background, 4),
            depth_range,
            lights,
            AMBIENT if ambient is None else as_not_negative("ambient", ambient),
            material,
            matcap,
            fog,
            environment,
            parse_threads(threads),
        )


@lru_cache(maxsize=64)
def plain_material(color: Color | None) -> Material:
    """The material of a mesh that has none; checking one takes a hundredth of a small picture."""
    return Material(color)


def shade_mesh(
    frags: Fragments, mesh: Mesh, camera: Camera, options: ShadingOptions, world_from_mesh: F64 | None = None
) -> U8:
    """Shade the triangles that show, all samples of them: the picture (H, W, 4) uint8.

    `world_from_mesh`: (4, 4) of an instance of a scene; the camera is the one in the space of its mesh.
    The kernel reads the mesh triangle by triangle, so it has to be the one that was drawn: of a lens its parts.
    """
    picture = empty((*frags.triangle.shape, 4), np.uint8)
    if not len(mesh.triangles) or 0 in frags.triangle.shape:
        picture[...] = options.background
        return picture
    scene = frags._snapped
    split = frags._split
    several = (split.ids[None], split.depth[None]) if split is not None else frags._sampled()[1]
    planes = several or (frags.id[None], frags.depth[None])
    ids, depth = as_read(planes[0], np.int32), as_read(planes[1], np.float32)
    own = (options.material,) if options.material is not None else mesh.materials
    own = own or (plain_material(options.color if mesh.colors is None else None),)
    rows = mesh.material_of_triangle if own is mesh.materials and len(own) > 1 else None
    look = ShadingInputs(scene, mesh, camera, picture.shape[1::-1], rows, is_flat=options.mode is Shading.FLAT)
    all_full = options.environment is not None or options.shows_opacity
    look.set_materials(mesh, own, is_unlit=options.mode is Shading.UNLIT, all_full=all_full)
    look.set_lights(options.lights, options.ambient, world_from_mesh)
    if options.environment is not None or any(one.is_metallic_rough for one in own):
        look.set_environment(options.environment, world_from_mesh)
    if options.shows_opacity:
        look.set_opacity()
    look.set_view(SHOW_CODES.get(options.mode, 0), options.matcap, options.background)
    look.set_fog(options.fog)
    n_samples = len(ids) if split is None else len(split.positions)
    positions = None if n_samples == 1 else sample_positions(n_samples, scene.subpixel_bits)

    def shade_rows(first: int, end: int) -> None:
        part = picture, first, end - first
        if positions is None:
            engine.shade(scene, look.shading, ids[0], depth[0], *part)
        else:
            listed = None if split is None else split.split
            engine.shade_samples(scene, look.shading, positions, ids, depth, listed, *part)

    n_px = picture.shape[0] * picture.shape[1]
    n_threads = min(count_threads(options.threads, len(mesh.triangles)), n_px // MIN_PX_PER_THREAD)
    run_parts(shade_rows, len(picture), n_threads)
    return picture


def as_read(planes: npt.NDArray[Any], kind: type) -> npt.NDArray[Any]:
    """Planes as kernels read them: as they are, if that is so."""
    return planes if planes.dtype == kind and planes.flags.carray else np.require(planes, kind, ["C", "A"])


def shade_numbers(frags: Fragments, camera: Camera, options: ShadingOptions) -> U8:
    """Colour each triangle by its id, or by its distance: the picture (H, W, 4) uint8."""
    ends = options.depth_range or distances(frags, camera) if options.mode is Shading.DEPTH else None

    def picture_one(sample: Fragments) -> U8:
        picture = empty((*sample.id.shape, 4), np.uint8)
        picture[...] = options.background
        at = np.nonzero(sample.mask)
        picture[at] = color_at(sample, at)
        return picture

    def color_at(sample: Fragments, at: Places) -> U8:
        return colors_of_numbers(sample.id[at], sample.depth[at], camera, ends)

    return shade_samples(frags, picture_one, options.background, color_at)


def colors_of_numbers(ids: I32, depth: F32, camera: Camera, depth_range: tuple[float, float] | None) -> U8:
    """The colours (P, 4) of ids, or of distances when they have a range."""
    colors = np.full((len(ids), 4), 255, np.uint8)
    if depth_range is None:
        colors[:, :3] = id_colors(ids)
    elif len(depth):
        nearest, farthest = depth_range
        distance = eye_distance(depth, camera)
        share = np.clip((distance - nearest) / max(farthest - nearest, np.finfo(np.float64).tiny), 0, 1)
        grey = GREY_OF_NEAREST + (GREY_OF_FARTHEST - GREY_OF_NEAREST) * share
        colors[:, :3] = np.rint(grey).astype(np.uint8)[:, None]
    return colors


def eye_distance(depth: F32, camera: Camera) -> F64:
    """Distance along the view, world units, of window depths in [0, 1]: `-z` in eye space."""
    (a, b), (c, d) = camera.projection[2:, 2:]
    ndc = 2.0 * depth.astype(np.float64) - 1
    return (ndc * d - b) / (ndc * c - a)


def distances(frags: Fragments, camera: Camera) -> tuple[float, float] | None:
    """The least and the greatest distance along the view of what any sample shows; None where there is nothing."""
    depth = frags.samples_depth[frags.samples_triangle >= 0]
    if not depth.size:
        return None
    ends = eye_distance(np.array([depth.min(), depth.max()]), camera)
    return float(ends[0]), float(ends[1])


def shade_samples(
    frags: Fragments,
    shade_one: Callable[[Fragments], U8],
    background: tuple[int, ...],
    color_at: Callable[[Fragments, Places], U8] | None = None,
) -> U8:
    """Return the mean colour of the samples, (H, W, 4) uint8: light is averaged, alpha as it is.

    `shade_one` gives the picture of one sample; pixels whose triangle an earlier sample has shown are left out of it.
    `color_at` gives the colours (P, 4) of pixels alone, where there is a quicker way to them.
    """
    if frags.samples_depth.shape[-1] == 1:
        return shade_one(frags)
    ids = [frags.sample(k).id for k in range(frags.samples_depth.shape[-1])]
    picture = shade_one(frags.sample(0))  # of the first sample; right wherever one triangle has all samples
    is_split = np.zeros(ids[0].shape, np.bool_)
    for other in ids[1:]:
        is_split |= other != ids[0]
    at = np.nonzero(is_split)
    split = np.stack([own[at] for own in ids])  # (S, P)
    decode, encode = srgb_tables()
    light, alpha = np.zeros((split.shape[1], 3), np.int64), np.zeros(split.shape[1], np.int64)

    def add(colors: U8, share: npt.NDArray[np.int64]) -> None:
        weight = share * colors[:, 3]
        light[...] += weight[:, None] * decode[colors[:, :3]]
        alpha[...] += weight

    ground = np.broadcast_to(np.array(background, np.uint8), (split.shape[1], 4))
    add(ground, (split < 0).sum(0))
    for k, own in enumerate(split):
        is_new = (own >= 0) & (split[:k] != own).all(0)
        share = (split == own).sum(0) * is_new
        if k == 0:
            add(picture[at], share)
        elif is_new.any():
            where, sample = (at[0][is_new], at[1][is_new]), frags.sample(k)
            colors = np.zeros((split.shape[1], 4), np.uint8)
            colors[is_new] = color_at(sample, where) if color_at else shade_one(sample.only(*where))[where]
            add(colors, share)
    steps = (2 * light + alpha[:, None]) // np.maximum(2 * alpha, 1)[:, None]  # to nearest, of at most LINEAR_ONE
    mean = np.empty((split.shape[1], 4), np.uint8)
    mean[:, :3] = encode[np.minimum(steps, LINEAR_ONE)]
    mean[:, 3] = np.rint(alpha / len(ids))  # exact sixteenths
    picture[at] = mean
    return picture


def shade_normals(frags: Fragments, mesh: Mesh, camera: Camera, turn: F64, *, threads: int | None = None) -> F32:
    """Unit normals (H, W, 3) float32 of the visible pixels, on the side that is seen, 0 where nothing is.

    Parameters
    ----------
    frags, mesh, camera
        As in `topleft.shade`.
    turn : (3, 3) float64
        From eye space to where the normals are wanted.
    threads : int, optional
        Never changes a bit.

    Notes
    -----
    A triangle seen from behind has its normals turned round as a whole, never pixel by pixel: so a mesh whose faces are
    inverted looks like one whose faces are not, and no edge of light runs through a triangle. Where those of the
    corners cancel, or there are none, it is the normal of the face.
    """
    ids = np.require(frags.triangle, np.int32, ["C", "A"])
    if not len(mesh.triangles) or 0 in ids.shape:
        return np.zeros((*ids.shape, 3), np.float32)
    out = empty((*ids.shape, 3), np.float32)
    scene = frags._snapped
    look = ShadingInputs(scene, mesh, camera, ids.shape[::-1], None, is_flat=False)
    look.set_turn(SHOW_CODES[Shading.NORMALS], turn)
    n_threads = threads_for(threads, len(mesh.triangles))

    def shade_rows(first: int, end: int) -> None:
        engine.shade_normals(scene, look.shading, ids, out, first, end - first)

    run_parts(shade_rows, len(ids), n_threads)
    return out


def _check_types(lights: Sequence[Light], material: object, matcap: object, fog: object, environment: object) -> None:
    for light in lights:
        if not isinstance(light, Light):
            raise TypeError(f"lights must be of Light, got {type(light).__name__}: a direction is Light((0, 1, 0))")
    kinds = (
        ("material", material, Material), ("matcap", matcap, Texture), ("fog", fog, Fog),
        ("environment", environment, Environment),
    )  # fmt: skip
    for name, value, kind in kinds:
        if value is not None and not isinstance(value, kind):
            article = "an" if kind is Environment else "a"
            raise TypeError(f"{name} must be {article} {kind.__name__}, got {type(value).__name__}")
