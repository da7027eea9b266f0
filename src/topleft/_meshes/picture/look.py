"""Prepares the shading kernels' inputs: materials, lights and a camera as numbers, a mesh as rows of float32.

Input: a mesh, its materials, lights, a camera and the size of the whole picture. Output: `ShadingInputs`, which fills
`engine.ShadingTable`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64
from topleft._core.base.cached import cached_property
from topleft._core.base.color import DEFAULT_COLOR, LIGHT_OF_SRGB, Color, light_of
from topleft._core.base.memory import empty
from topleft._core.base.threads import run_parts, threads_of_rows
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.cache import MOST_LOOKS
from topleft._meshes.model.environment import DEFAULT_ENVIRONMENT, Environment
from topleft._meshes.model.light import TO_HEADLIGHT, Fog, Light
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, is_laid
from topleft._meshes.model.normals import (
    box_of_triangles,
    face_normal_rows,
    moved,
    turn_of_normals,
    turned_faces,
    unit_rows,
)
from topleft._meshes.model.texture import Texture

LIGHT_CODES = {"directional": 0, "point": 1, "spot": 3}  # tl_light_kind in csrc/pixels/shading.h

MOST_STRETCHED = 1 << 18
"""Vertices of stretched copies that are kept of a mesh, 40 bytes each and 20 for each of its triangles."""


@dataclass(frozen=True, eq=False)
class CameraRays:
    """The camera's fields of `tl_shading` in csrc/pixels/shading.h, in a shading space with its origin at `center`."""

    has_perspective: bool
    eye: F64  # (3,): where the camera is; without perspective the unit vector to it
    ray: F64
    """(4, 3): of pixel position (0, 0), and its steps per column, per row and, without perspective, along the depth."""
    eye_from: F64  # (3, 3): eye space from shading space is eye_from @ p + origin, up to a scale
    origin: F64  # (3,)
    scale: float  # units of eye space in one of the shading space
    distance_start: float  # along the view: start + scale * w, or start + scale * depth without perspective
    distance_scale: float


class ShadingMesh:
    """A mesh as the shading kernels read it; `positions` (V, 3) are the vertices of the mesh, or stretched.

    `center`: (3,) float64, the middle of the box round the vertices in use: the origin of the space that light is
    computed in, so that float32 is fine enough. `normals`: (N, 4) float32, unit normals of the vertices, then of
    creased corners, 0 where there is none, and 1. `colors`: (V, 4) float32, if any: sRGB of the vertices, 0 to 255, or
    their light, 0 to 1, and opacity, 0 to 1.
    """

    def __init__(self, mesh: Mesh, stretch: F64 | None = None) -> None:
        """`stretch`: an affine matrix (4, 4) that acts on the mesh first."""
        corners = None if mesh.is_faceted else mesh.corner_normals()
        if mesh.is_faceted:  # no kernel reads normals of vertices where every face has a normal
            self.normals = np.ones((len(mesh.vertices), 4), np.float32)
        else:
            normals = mesh.vertex_normals() if corners is None else corners.rows
            self.normals = unit_rows(normals, None if stretch is None else turn_of_normals(stretch))
        self._triangles = mesh.triangles
        self.normal_of_corner = None if corners is None else corners.of_corner
        self.positions = mesh.vertices if stretch is None else moved(mesh.vertices, stretch)
        box = box_of_triangles(self.positions, self._triangles) if len(mesh.triangles) else np.zeros((2, 3))
        low, high = box.astype(self.positions.dtype)
        self.center: F64 = np.asarray(low / 2 + high / 2, np.float64)
        self.colors = None if mesh.colors is None else color_rows(mesh.colors)
        if self.colors is not None and mesh.color_interpolation == "linear":
            self.colors[:, :3] = LIGHT_OF_SRGB[mesh.colors[:, :3]]  # type: ignore[index]
        self.tables: dict[tuple[Surface, bool, bool], engine.ShadingTable] = {}  # see `table_of`

    @cached_property
    def face_normals(self) -> F32:
        """(T, 4): unit normals of the triangles, on the side from which they run counter-clockwise, and 1."""
        return face_normal_rows(self.positions, self._triangles)

    @cached_property
    def is_turned(self) -> npt.NDArray[np.uint8] | None:
        """(T,): 1 where the normals of the corners point to the other side than the triangle; None if none does."""
        turned = turned_faces(self.positions, self._triangles, self.normals, self.normal_of_corner)
        return turned if turned.view(np.bool_).any() else None


def color_rows(colors: npt.NDArray[np.uint8]) -> F32:
    """Rows (N, 4) float32 of colours (N, 3) or (N, 4): red, green, blue, and 1."""
    rows = np.empty((len(colors), 4), np.float32)
    n_threads = threads_of_rows(len(colors))
    run_parts(lambda first, end: engine.color_rows(colors, first, end, rows), len(colors), n_threads)
    return rows


def shading_mesh_of(mesh: Mesh, stretch: F64 | None) -> ShadingMesh:
    """The shading mesh of a mesh in object space, or stretched, from its cache."""
    cache = mesh.cache
    if stretch is None:
        if cache.shading is None:
            cache.shading = ShadingMesh(mesh)
        return cache.shading
    key = stretch.tobytes()
    found = cache.stretched.get(key)
    if found is None:
        found = ShadingMesh(mesh, stretch)
        n_kept = len(cache.stretched) + (cache.shading is not None)
        if n_kept * len(mesh.vertices) > MOST_STRETCHED:
            cache.stretched.clear()
        cache.stretched[key] = found
    return found


def is_full(material: Material) -> bool:
    """Whether a surface has more than a colour, a texture and a highlight."""
    texture = material.texture
    return (
        material.is_metallic_rough
        or any(material.emission)
        or material.occlusion_texture is not None
        or material.normal_texture is not None
        or (texture is not None and (texture.uv_set == 1 or texture.transform is not None))
    )


def full_part(material: Material, mesh: Mesh) -> tuple[Any, ...]:
    """The fields of `tl_material` that only a full material has."""
    metallic, roughness = (1.0 if value is None else value for value in (material.metallic, material.roughness))
    maps = (
        material.metallic_roughness_texture if material.is_metallic_rough else None,
        material.occlusion_texture,
        material.normal_texture,
        material.emission_texture if any(material.emission) else None,
    )
    compiled_maps = [one.compiled if one is not None and is_laid(one, mesh) else None for one in maps]
    numbers = material.is_metallic_rough, metallic, roughness, material.occlusion_strength, material.normal_scale
    return (*numbers, material.emission, *compiled_maps)


@dataclass(frozen=True, eq=False)
class Surface:
    """The materials of a mesh in every view; tables are kept by it."""

    materials: Sequence[Material]
    is_by_triangle: bool
    """Whether the triangles of the mesh name theirs; otherwise all have the first."""
    is_flat: bool = False
    is_unlit: bool = False
    all_full: bool = False
    """For an environment that lights them all, or their opacity; others are full where they need it."""

    @cached_property
    def is_metallic(self) -> bool:
        """Whether a material is metallic and rough."""
        return any(one.is_metallic_rough for one in self.materials)


def table_of(
    own: ShadingMesh, mesh: Mesh, surface: Surface, *, is_mirrored: bool, projection_mirrors: bool
) -> engine.ShadingTable:
    """The kernels' inputs of a mesh, without a view; the last ones are kept.

    `is_mirrored`: the picture shows the mesh in a mirror; `projection_mirrors`: by the projection, of which the shading
    mesh knows nothing: the kernels take the side of normals from the turn of triangles in the picture.
    """
    key = surface, is_mirrored, projection_mirrors
    kept = own.tables.get(key)
    if kept is not None:
        return kept
    is_flat = surface.is_flat or mesh.is_faceted
    face_normals, is_turned = (own.face_normals, None) if is_flat else (None, own.is_turned)
    if projection_mirrors and face_normals is not None:
        face_normals = face_normals * np.array([-1, -1, -1, 1], np.float32)
    elif projection_mirrors:
        is_turned = np.ones(len(mesh.triangles), np.uint8) if is_turned is None else 1 - is_turned
    table = engine.ShadingTable(
        own.normals,
        own.center.tolist(),
        own.normal_of_corner,
        own.normals,
        face_normals,
        own.positions,
        is_turned,
        mesh.uv,
        mesh.uv1,
        own.colors,
        mesh.has_alpha,
        -1.0 if is_mirrored else 1.0,
        mesh.material_of_triangle if surface.is_by_triangle else None,
        None if mesh.color_interpolation == "linear" else LIGHT_OF_SRGB,
    )
    back_side = 1.0 if is_mirrored else -1.0
    table.set_materials([material_row(one, mesh, surface, back_side) for one in surface.materials])
    if len(own.tables) == MOST_LOOKS:
        own.tables.clear()
    own.tables[key] = table
    return table


def material_row(one: Material, mesh: Mesh, surface: Surface, back_side: float) -> tuple[Any, ...]:
    """A material as a row of `ShadingTable.set_materials`."""
    texture = one.texture if is_laid(one.texture, mesh) else None
    has_colors = texture is not None or mesh.colors is not None
    color = (*light_of(one.color or ((255, 255, 255) if has_colors else DEFAULT_COLOR))[:3], one.opacity)
    back = light_of(one.back_color or (0, 0, 0))[:3]
    side = 0.0 if one.back_color is None else back_side
    shininess = one.shininess if one.specular > 0 else 0.0
    cutoff = (one.alpha_cutoff or 0.0) if one.alpha_mode == "mask" else 0.0
    full = full_part(one, mesh) if surface.all_full or is_full(one) else None
    compiled = None if texture is None else texture.compiled_cut_at(cutoff / max(one.opacity, cutoff or 1.0))
    return color, back, side, (one.specular,) * 3, shininess, surface.is_unlit or one.unlit, cutoff, compiled, full


def light_rows(lights: Sequence[Light]) -> F64:
    """Rows (N, 14) as `ShadingTable.set_lights` takes them."""
    rows = []
    for one in lights:
        color = [one.intensity * c for c in light_of(one.color)[:3]]
        spot = *(one.direction or (0.0, 0.0, 0.0)), *one.cone
        rows.append((LIGHT_CODES[one.kind], *one.at, one.falloff, *color, *spot, one.space == "eye"))
    return np.array(rows, np.float64).reshape(-1, 14)


class ShadingInputs:
    """The numbers of instances in a picture, as the kernels read them, a table each.

    `shown`: of each the mesh snapped, as drawn, the mesh itself, and its surface; `places` (N, 4, 4): where it stands
    in the world. `finds_inverse_w`: whether 1/w is found for the vertices that show, where it can be; otherwise for
    all.

    Light needs angles and lengths as they are in eye space. A mesh whose matrix to it changes angles, or mirrors, is
    stretched first, by a triangular matrix that leaves a rotation of the other. That comes from the products of its
    columns, rounded to 40 bits, so that it stays wherever the instance and the camera turn.
    """

    def __init__(
        self,
        shown: Sequence[tuple[engine.SnappedMesh, Mesh, Surface]],
        camera: Camera,
        places: F64,
        size: tuple[int, int],
        *,
        finds_inverse_w: bool,
    ) -> None:
        columns = engine.product(camera.view, places.transpose(1, 0, 2).reshape(4, -1))
        views = np.ascontiguousarray(columns.reshape(4, -1, 4).transpose(1, 0, 2))
        self.camera, self.places, self.views, kept = camera, places, views, []
        for k, (is_mirrored, stretch) in enumerate(engine.stretches(views)):
            _, mesh, surface = shown[k]
            turns = camera.projection_mirrors
            own = shading_mesh_of(mesh, stretch)
            kept.append(table_of(own, mesh, surface, is_mirrored=is_mirrored != turns, projection_mirrors=turns))
            if stretch is not None:
                back = engine.inverse(stretch)
                views[k], places[k] = engine.product(views[k], back), engine.product(places[k], back)
        meshes = [snapped for snapped, _, _ in shown]
        viewport = meshes[0].viewport
        frame = size if viewport is None else viewport.size
        has_w = viewport is not None and any(camera.projection[3, :3].tolist())
        clip_from_eye = camera.clip_from_eye(frame)
        self.tables = engine.see(meshes, kept, clip_from_eye, views, has_w, finds_inverse_w, *frame, empty)

    def rays(self, k: int) -> CameraRays:
        """How the camera sees the shading space of an instance."""
        has_perspective, rows, scale = self.tables[k].camera_rays
        if has_perspective:
            start, way = 0.0, 1.0 / -float(self.camera.projection[3, 2])
        else:
            near, far = self.camera.distance_of(np.array([0.0, 1.0])).tolist()
            start, way = near, far - near
        return CameraRays(has_perspective, rows[0], rows[1:5], rows[5:8], rows[8], scale, start, way)

    def set_lights(self, lights: F64 | None, ambient: float) -> None:
        """Take `light_rows`, or the headlight."""
        engine.light_all(self.tables, lights, TO_HEADLIGHT, ambient, self.places)

    def set_environment(self, k: int, environment: Environment | None) -> None:
        """Have an instance take the environment, or the default one, which only metallic surfaces mirror."""
        own = DEFAULT_ENVIRONMENT if environment is None else environment
        rows = self.rays(k).eye_from
        if own.space == "world":
            rows = engine.product(engine.inverse(self.views[k, :3, :3]), rows)
            rows = engine.product(self.places[k, :3, :3], rows)
        rows = engine.product(own.axes, rows / engine.cube_root(abs(engine.determinant(rows))))
        texels, table = own.levels or (None, None)
        diffuse = 0.0 if environment is None else 1.0
        self.tables[k].set_surroundings(engine.Surroundings(texels, table, *own.colors, diffuse, rows.tolist()))

    def set_picture(
        self, show: int, matcap: Texture | None, background: Color, fog: Fog | None = None, *, has_opacity: bool = False
    ) -> None:
        """Take the kind of picture, its matcap, its background and the depth cue.

        `has_opacity`: the picture's alpha is the opacity of the surfaces; all materials are full.
        """
        compiled = None if matcap is None else replace(matcap, filter="bilinear", wrap="clamp").compiled
        light = light_of(background)
        for k, table in enumerate(self.tables):
            table.set_picture(show, compiled, light, background, has_opacity)
            if fog is not None:
                rays, scale = self.rays(k), 1 / (fog.far - fog.near)
                table.set_fog(light_of(fog.color), fog.near, scale, rays.distance_start, rays.distance_scale)

    def set_turn(self, show: int, turn: F64) -> None:
        """Take the kind of picture, in a space that the matrix (3, 3) takes eye space to."""
        self.set_picture(show, None, (0, 0, 0, 0))
        for k, table in enumerate(self.tables):
            table.set_turn(engine.product(turn, self.rays(k).eye_from).tolist())
