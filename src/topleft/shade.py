"""Shading: from the visibility buffer to colours, in NumPy, for the pixels in which a triangle shows.

Input: `Fragments`, the mesh and the camera they were made with. Output: a picture (H, W, 4) uint8, sRGB with alpha.

Light is added up in linear light: colours are decoded from sRGB, lit, and encoded again, so that a surface that gets
half the light is half as bright on a screen. Alpha of a mesh is not looked at: triangles are opaque.

Based on: Phong, B. T., "Illumination for Computer Generated Pictures", Communications of the ACM 18(6), 1975 (normals
interpolated, light computed in the pixel); Mitchell, J., G. McTaggart and C. Green, "Shading in Valve's Source Engine",
SIGGRAPH 2006 courses (the half-Lambert fall-off, there with the power 2).
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.camera import Camera
from topleft.fragments import Fragments
from topleft.mesh import Mesh, face_normals, unit_or_zero
from topleft.models import parse

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
Color = tuple[int, ...]


class Shading(StrEnum):
    """What the colour of a pixel tells."""

    SMOOTH = "smooth"
    FLAT = "flat"
    IDS = "ids"
    DEPTH = "depth"
    NORMALS = "normals"


DEFAULT_COLOR = (224, 222, 217)
"""sRGB of a mesh without colours: a light warm grey, in which light and shadow both have room."""

TO_LIGHT = np.array([-0.35, 0.45, 1.0]) / np.linalg.norm([-0.35, 0.45, 1.0])
"""Direction of the headlight in eye space: from over the viewer's left shoulder, so that up and left read as lit."""

AMBIENT = 0.03
"""Share of the light, in linear light, that reaches a surface from all sides."""

WRAP_POWER = 3
"""The headlight falls off as ((1 + n . l) / 2)**3 and so reaches 0 smoothly, at the far side of a sphere. Lambert's
max(0, n . l) ends in a line, which on coarse meshes reads as a seam."""

GREY_OF_NEAREST, GREY_OF_FARTHEST = 224, 32
"""Greys of the depth picture: neither black nor white, so that it shows on both."""

_LINEAR_OF_SRGB = np.where(
    np.arange(256) <= 10,  # 0.04045 of 255
    np.arange(256) / 255 / 12.92,
    ((np.arange(256) / 255 + 0.055) / 1.055) ** 2.4,
).astype(np.float32)
# 2**14 steps: at the dark end, where sRGB is steepest, a step is a fifth of a level of eight bits.
_LINEAR_STEPS = 2**14
_ramp = np.arange(_LINEAR_STEPS + 1) / _LINEAR_STEPS
_SRGB_OF_LINEAR = np.rint(
    255 * np.where(_ramp <= 0.0031308, 12.92 * _ramp, 1.055 * _ramp ** (1 / 2.4) - 0.055)
).astype(np.uint8)


def shade(
    frags: Fragments,
    mesh: Mesh,
    camera: Camera,
    *,
    shading: str = "smooth",
    color: Color = DEFAULT_COLOR,
    background: Color = (255, 255, 255, 255),
    depth_range: tuple[float, float] | None = None,
) -> U8:
    """The picture (H, W, 4) uint8 of a visibility buffer: sRGB, alpha 255 where a triangle shows.

    Parameters
    ----------
    frags : Fragments
        What `rasterize` returned for the mesh.
    mesh : Mesh
        Its colours are used by "smooth" and "flat" if it has any.
    camera : Camera
        The camera of `frags`.
    shading : {"smooth", "flat", "ids", "depth", "normals"}
        "smooth": interpolated vertex normals, lit in the pixel by a headlight and ambient light. "flat": the same with
        the normals of the faces. Both light the side that is seen, whichever it is. "ids": a colour for each triangle.
        "depth": grey, bright is near, over a range of distances. "normals": the smooth normal in
        eye space, x, y, z from -1..1 as red, green, blue; what faces the viewer is light blue.
    color : (3,) of 0 to 255
        sRGB colour of a mesh without colours.
    background : (4,) of 0 to 255
        sRGB and alpha where nothing shows.
    depth_range : (float, float), optional
        Distances along the view that are the brightest and the darkest grey of "depth", world units; unless given,
        those of the picture.

    Raises
    ------
    ValueError
        If `shading` is unknown or a colour is none.
    """
    mode = parse(Shading, "shading", shading)
    color = as_color("color", color, 3)
    picture = np.empty((*frags.triangle.shape, 4), dtype=np.uint8)
    picture[...] = as_color("background", background, 4)
    seen = frags.mask
    if not seen.any():
        return picture
    ids = frags.triangle[seen]
    if mode is Shading.IDS:
        rgb = id_colors(ids)
    elif mode is Shading.DEPTH:
        rgb = _grey_of_distance(eye_distance(frags.depth[seen], camera), depth_range)[:, None]
    else:
        normals = eye_normals(frags, mesh, camera, is_smooth=mode is not Shading.FLAT)
        if mode is Shading.NORMALS:
            rgb = np.rint(127.5 * normals + 127.5).astype(np.uint8)
        else:
            rgb = _lit(_surface_colors(frags, mesh, seen, color), normals)
    picture[seen, :3] = rgb
    picture[seen, 3] = 255
    return picture


def eye_normals(frags: Fragments, mesh: Mesh, camera: Camera, *, is_smooth: bool) -> F32:
    """Unit normals (P, 3) float32 in eye space of the visible pixels in row order, on the side that is seen.

    A triangle seen from behind has its normals turned round as a whole, never pixel by pixel: so a mesh whose faces are
    inverted looks like one whose faces are not, and no edge of light runs through a triangle.
    """
    seen = frags.mask
    ids = frags.triangle[seen]
    linear = camera.view[:3, :3]
    points_eye = mesh.vertices @ linear.T + camera.view[:3, 3]
    faces = face_normals(points_eye, mesh.triangles)
    if camera.projection[3, 2] != 0:
        to_viewer = -points_eye[mesh.triangles[:, 0]]  # the eye is the origin
    else:
        to_viewer = np.broadcast_to([0.0, 0.0, 1.0], faces.shape)
    faces[(faces * to_viewer).sum(axis=1) < 0] *= -1
    if not is_smooth:
        return faces.astype(np.float32)[ids]
    vertex_normals = unit_or_zero(mesh.vertex_normals() @ np.linalg.inv(linear))
    a, b, c = mesh.triangles.T
    is_turned = ((vertex_normals[a] + vertex_normals[b] + vertex_normals[c]) * faces).sum(axis=1) < 0
    if is_turned[ids].any():
        sign = np.where(is_turned, -1, 1)[:, None, None]
        normals = frags.interpolate(sign * vertex_normals[mesh.triangles])[seen]
    else:
        normals = frags.interpolate(vertex_normals)[seen]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # Normals that cancel (or were never there) leave the one of the face.
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), faces.astype(np.float32)[ids])


def eye_distance(depth: F32, camera: Camera) -> F64:
    """Distance along the view, world units, of window depths in [0, 1]: `-z` in eye space."""
    (a, b), (c, d) = camera.projection[2:, 2:]
    ndc = 2.0 * depth.astype(np.float64) - 1
    return (ndc * d - b) / (ndc * c - a)


def id_colors(ids: npt.NDArray[np.integer[Any]]) -> U8:
    """A bright colour (N, 3) uint8 for each id: the hue turns by the golden angle, so neighbours differ most."""
    ids = ids.astype(np.uint64)
    hue = (ids * np.uint64(0x9E3779B97F4A7C15) >> np.uint64(40)).astype(np.float32) / 2**24
    tint = (ids * np.uint64(0xD1B54A32D192ED03) >> np.uint64(40)).astype(np.float32) / 2**24
    value, saturation = 0.65 + 0.35 * tint, 0.80 - 0.40 * ((5 * tint) % 1)
    ramp = np.abs((6 * hue[:, None] + np.array([0, 4, 2], dtype=np.float32)) % 6 - 3) - 1
    rgb = value[:, None] * (1 - saturation[:, None] * (1 - np.clip(ramp, 0, 1)))
    return np.rint(255 * rgb).astype(np.uint8)


def as_color(name: str, color: Color, n_channels: int) -> Color:
    """The colour as whole numbers of 0 to 255; RGB becomes opaque where RGBA is asked for.

    Raises
    ------
    ValueError
        If it has another number of channels or a channel outside its range.
    """
    channels = tuple(int(channel) for channel in color)
    if n_channels == 4 and len(channels) == 3:
        channels = (*channels, 255)
    if len(channels) != n_channels or not all(0 <= channel <= 255 for channel in channels):
        raise ValueError(f"{name} must be {n_channels} numbers of 0 to 255, got {color!r}")
    return channels


def _surface_colors(frags: Fragments, mesh: Mesh, seen: npt.NDArray[np.bool_], color: Color) -> F32:
    """Linear colours: (P, 3) of the mesh, or (1, 3) that holds for all pixels."""
    if mesh.colors is None:
        return _LINEAR_OF_SRGB[np.array([color])]
    srgb = frags.interpolate(mesh.colors[:, :3].astype(np.float32))[seen]
    return _LINEAR_OF_SRGB[np.rint(srgb).astype(np.uint8)]


def _lit(linear: F32, normals: F32) -> U8:
    wrapped = (0.5 + 0.5 * (normals @ TO_LIGHT.astype(np.float32))) ** WRAP_POWER
    light = AMBIENT + (1 - AMBIENT) * wrapped
    steps = linear * (_LINEAR_STEPS * light[:, None])
    return _SRGB_OF_LINEAR[np.minimum(np.rint(steps).astype(np.int32), _LINEAR_STEPS)]


def _grey_of_distance(distance: F64, depth_range: tuple[float, float] | None) -> U8:
    nearest, farthest = depth_range or (distance.min(), distance.max())
    share = np.clip((distance - nearest) / max(farthest - nearest, np.finfo(np.float64).tiny), 0, 1)
    return np.rint(GREY_OF_NEAREST + (GREY_OF_FARTHEST - GREY_OF_NEAREST) * share).astype(np.uint8)
