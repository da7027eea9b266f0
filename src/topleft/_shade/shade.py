"""Shading: from the visibility buffer to colours, for the pixels in which a triangle shows.

Input: `Fragments`, the mesh and the camera they were made with. Output: a picture (H, W, 4) uint8, sRGB with alpha.

Light is added up in linear light: colours are decoded from sRGB, lit, and encoded again, so that a surface that gets
half the light is half as bright on a screen. The kernel is csrc/shade.c.

Based on: Phong, B. T., "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975 (normals
interpolated, light computed in the pixel); Blinn, J. F., "Models of Light Reflection for Computer Synthesized
Pictures", SIGGRAPH 1977 (highlights).
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import TypedDict

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.color import DEFAULT_COLOR, Color, as_color, id_colors
from topleft._base.options import parse
from topleft._base.threads import count_threads, parse_threads, run_parts
from topleft._camera.camera import Camera
from topleft._model.light import AMBIENT, Fog, Light, as_not_negative
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.texture import Texture
from topleft._raster.fragments import Fragments
from topleft._raster.sampling import sample_positions
from topleft._render.scene_fragments import BentFragments
from topleft._shade.eye import distances, eye_distance
from topleft._shade.look import Look
from topleft._shade.multisample import shade_samples

__all__ = ["DEFAULT_COLOR", "LookOptions", "Shading", "as_color", "eye_distance", "id_colors", "shade"]

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]


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

    lights: Sequence[Light] | None
    ambient: float | None
    material: Material | None
    matcap: Texture | None
    fog: Fog | None


def shade(
    frags: Fragments,
    mesh: Mesh,
    camera: Camera,
    *,
    shading: str = "smooth",
    color: Color = DEFAULT_COLOR,
    background: Color = (255, 255, 255, 255),
    depth_range: tuple[float, float] | None = None,
    lights: Sequence[Light] | None = None,
    ambient: float | None = None,
    material: Material | None = None,
    matcap: Texture | None = None,
    fog: Fog | None = None,
    threads: int | None = None,
) -> U8:
    """The picture (H, W, 4) uint8 of a visibility buffer: sRGB, alpha 255 where a triangle shows.

    Parameters
    ----------
    frags : Fragments
        What `rasterize` returned for the mesh. With several samples a pixel a triangle is shaded once in a pixel, at
        the first of the samples that see it, and the picture is the mean of the light of the samples.
    mesh : Mesh
        Its materials, and its colours, are used if it has any.
    camera : Camera
        The camera of `frags`.
    shading : {"smooth", "flat", "unlit", "matcap", "ids", "depth", "normals"}
        "smooth": interpolated vertex normals, lit in the pixel. "flat": the same with the normals of the faces. Both
        light the side that is seen, whichever it is. "unlit": colours and textures as they are. "matcap": the colour
        that `matcap` has for the normal. "ids": a colour for each triangle. "depth": grey, bright is near, over a range
        of distances. "normals": the smooth normal in eye space, x, y, z from -1..1 as red, green, blue; what
        faces the viewer is light blue.
    color : (3,) of 0 to 255
        sRGB colour of a mesh without colours and materials.
    background : (4,) of 0 to 255
        sRGB and alpha where nothing shows.
    depth_range : (float, float), optional
        Distances along the view that are the brightest and the darkest grey of "depth", world units; unless given,
        those of the picture.
    lights : sequence of Light, optional
        Lambert's cosine for each of them. Unless given: one headlight over the viewer's left shoulder, whose light
        wraps round the mesh.
    ambient : float, optional
        Light from all sides, not negative, 0.03 unless given.
    material : Material, optional
        For all triangles, instead of those of the mesh.
    matcap : Texture, optional
        A picture of a lit sphere, for "matcap". It is clamped, so the rim holds where normals turn away.
    fog : Fog, optional
        The depth cue.
    threads : int, optional
        How many threads shade; never changes a bit.

    Raises
    ------
    ValueError
        If the mesh has other numbers of vertices or triangles than what was drawn, `shading` is unknown, a colour is
        none, a number is outside its range, or "matcap" has no matcap.
    TypeError
        If `frags`, the mesh, a light, material or texture is none.
    """
    _check_drawn(frags, mesh)
    mode = parse(Shading, "shading", shading)
    if isinstance(frags, BentFragments) and mode not in (Shading.IDS, Shading.DEPTH):
        # The kernels read what was drawn, triangle by triangle.
        mesh, camera, frags = frags.mesh_of_parts(mesh), camera.straightened(), frags.parts
    own_color = as_color("color", color, 3)
    behind = as_color("background", background, 4)
    n_threads = count_threads(parse_threads(threads), len(mesh.triangles))
    _check_types(lights=(lights or ()), material=material, matcap=matcap, fog=fog)
    if mode is Shading.MATCAP and matcap is None:
        raise ValueError("matcap must be a Texture for shading 'matcap', got None")
    share = AMBIENT if ambient is None else as_not_negative("ambient", ambient)
    n_samples = frags.samples_triangle.shape[-1]
    if mode in (Shading.IDS, Shading.DEPTH) or not len(mesh.triangles) or 0 in frags.triangle.shape:
        ends = depth_range or distances(frags, camera) if mode is Shading.DEPTH else None

        def number_one(sample: Fragments) -> U8:
            return picture_of_numbers(sample, camera, ends, behind)

        return number_one(frags) if n_samples == 1 else shade_samples(frags, number_one, behind)
    picture = np.empty((*frags.triangle.shape, 4), dtype=np.uint8)
    scene = frags._snapped
    plain = Material(own_color if mesh.colors is None else None)
    own = (material,) if material is not None else mesh.materials or (plain,)
    rows = mesh.material_of_triangle if own is mesh.materials and len(own) > 1 else None
    look = Look(scene, mesh, camera, picture.shape[1::-1], rows, is_flat=mode is Shading.FLAT)
    look.set_materials(mesh, own, is_unlit=mode is Shading.UNLIT)
    look.set_lights(lights, share)
    look.set_view(SHOW_CODES.get(mode, 0), matcap, behind)
    look.set_fog(fog)
    planes = frags.samples_triangle.transpose(2, 0, 1), frags.samples_depth.transpose(2, 0, 1)
    kinds = np.int32, np.float32
    ids, depth = (np.require(array, kind, ["C", "A"]) for array, kind in zip(planes, kinds, strict=True))

    positions = None if n_samples == 1 else sample_positions(n_samples, scene.subpixel_bits)

    def shade_rows(first: int, end: int) -> None:
        part = picture, first, end - first
        if positions is None:
            _engine.shade(scene, look.shading, ids[0], depth[0], *part)
        else:
            _engine.shade_samples(scene, look.shading, positions, ids, depth, *part)

    run_parts(shade_rows, len(picture), n_threads)
    return picture


def picture_of_numbers(
    frags: Fragments, camera: Camera, depth_range: tuple[float, float] | None, background: Color
) -> U8:
    """The picture (H, W, 4) of ids, or of distances when they have a range."""
    picture = np.empty((*frags.triangle.shape, 4), dtype=np.uint8)
    picture[...] = background
    seen = frags.mask
    if not seen.any():
        return picture
    if depth_range is None:
        picture[seen, :3] = id_colors(frags.triangle[seen])
    else:
        nearest, farthest = depth_range
        distance = eye_distance(frags.depth[seen], camera)
        share = np.clip((distance - nearest) / max(farthest - nearest, np.finfo(np.float64).tiny), 0, 1)
        grey = GREY_OF_NEAREST + (GREY_OF_FARTHEST - GREY_OF_NEAREST) * share
        picture[seen, :3] = np.rint(grey).astype(np.uint8)[:, None]
    picture[seen, 3] = 255
    return picture


def _check_drawn(frags: Fragments, mesh: Mesh) -> None:
    """Raise an error unless the mesh can be the one that was drawn: the kernels index its arrays by the fragments."""
    if not isinstance(frags, Fragments):
        raise TypeError(f"frags must be Fragments, got {type(frags).__name__}")
    if not isinstance(mesh, Mesh):
        raise TypeError(f"mesh must be a Mesh, got {type(mesh).__name__}")
    drawn, given = (frags._n_vertices, frags._n_triangles), (len(mesh.vertices), len(mesh.triangles))
    if drawn != given:
        raise ValueError(
            f"mesh must be the one that was drawn, with {drawn[0]} vertices and {drawn[1]} triangles, "
            f"got {given[0]} and {given[1]}"
        )


def _check_types(lights: Sequence[Light], material: object, matcap: object, fog: object) -> None:
    for light in lights:
        if not isinstance(light, Light):
            raise TypeError(f"lights must be of Light, got {type(light).__name__}")
    for name, value, kind in (("material", material, Material), ("matcap", matcap, Texture), ("fog", fog, Fog)):
        if value is not None and not isinstance(value, kind):
            raise TypeError(f"{name} must be a {kind.__name__}, got {type(value).__name__}")
