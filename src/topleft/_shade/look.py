"""Looks: materials, lights and a camera as numbers for the shading kernels.

Input: a mesh, its materials, lights and a camera. Output: `Look`, which fills `_engine.ShadingTable`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.color import DEFAULT_COLOR, LIGHT_OF_SRGB, Color, light_of
from topleft._camera.camera import Camera
from topleft._model.light import TO_HEADLIGHT, Fog, Light, LightKind, LightSpace
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.texture import Texture
from topleft._shade.frame import frame_of, is_similarity
from topleft._shade.surface import Surface, surface_of

LIGHT_CODES = {LightKind.DIRECTIONAL: 0, LightKind.POINT: 1}  # tl_light_kind in csrc/shading.h
WRAPPED_LIGHT = 2


F64 = npt.NDArray[np.float64]


class Look:
    """The numbers of one picture, as the kernels read them."""

    def __init__(
        self,
        scene: _engine.SnappedMesh,
        mesh: Mesh,
        camera: Camera,
        size: tuple[int, int],
        material_of: npt.NDArray[np.int32] | None,
        *,
        is_flat: bool,
    ) -> None:
        in_eye_space = not is_similarity(camera.view)
        self.surface = Surface(mesh, camera.view) if in_eye_space else surface_of(mesh)
        viewport = size if scene.viewport is None else scene.viewport.size
        self.frame = frame_of(camera, viewport, self.surface.center, in_eye_space=in_eye_space)
        self.view = camera.view
        self.back_side = -1.0 if np.linalg.det(camera.view[:3, :3]) > 0 else 1.0
        self.is_in_eye_space = in_eye_space
        self.uv = mesh.uv
        normals = self.surface.normals
        if scene.viewport is not None and self.frame.has_perspective:
            normals = np.empty_like(normals)
            _engine.set_inverse_w(scene, self.surface.normals, normals)
        self.shading = _engine.ShadingTable(
            normals,
            self.surface.face_normals if is_flat else None,
            self.surface.positions,
            None if is_flat else self.surface.is_turned,
            mesh.uv,
            self.surface.colors,
            material_of,
            LIGHT_OF_SRGB,
        )

    def set_materials(self, mesh: Mesh, materials: Sequence[Material], *, is_unlit: bool) -> None:
        """Take the materials; a row that several triangles name may be one for all."""
        rows = []
        for one in materials:
            texture = one.texture if mesh.uv is not None else None
            has_colors = texture is not None or mesh.colors is not None
            color = one.color or ((255, 255, 255) if has_colors else DEFAULT_COLOR)
            back = light_of(one.back_color or (0, 0, 0))[:3]
            side = 0.0 if one.back_color is None else self.back_side
            shininess = one.shininess if one.specular > 0 else 0.0
            cutoff = one.alpha_cutoff or 0.0
            engine = None if texture is None else texture.engine
            rows.append(
                (light_of(color), back, side, (one.specular,) * 3, shininess, is_unlit or one.unlit, cutoff, engine)
            )
        self.shading.set_materials(rows)

    def set_lights(self, lights: Sequence[Light] | None, ambient: float) -> None:
        """Take the lights, in shading space."""
        if lights is None:
            at = self.frame.eye_from.T @ TO_HEADLIGHT
            rows: list[tuple[Any, ...]] = [(WRAPPED_LIGHT, at, (max(0.0, 1 - ambient),) * 3, 0.0)]
        else:
            rows = [self._light(light) for light in lights]
        self.shading.set_lights(rows, (ambient,) * 3)

    def _light(self, light: Light) -> tuple[Any, ...]:
        frame, at = self.frame, np.array(light.at)
        in_eye_space = light.space is LightSpace.EYE
        if light.kind is LightKind.DIRECTIONAL:
            if in_eye_space or self.is_in_eye_space:
                at = at if in_eye_space else self.view[:3, :3] @ at
                at = frame.eye_from.T @ at
            at = at / np.linalg.norm(at)
        elif in_eye_space:
            at = frame.eye_from.T @ (at - frame.origin) / frame.scale
        else:
            at = (self.view[:3, :3] @ at + self.view[:3, 3] if self.is_in_eye_space else at) - self.surface.center
        rgb = light_of(light.color)[:3]
        return LIGHT_CODES[LightKind(light.kind)], at, tuple(light.intensity * c for c in rgb), light.falloff

    def set_view(self, show: int, matcap: Texture | None, background: Color) -> None:
        """Take what the picture tells, and its background."""
        frame = self.frame
        engine = None if matcap is None else replace(matcap, filter="bilinear", wrap="clamp").engine
        eyes = frame.eye_from.tolist(), frame.has_perspective, frame.eye.tolist(), frame.ray.tolist()
        self.shading.set_view(show, engine, *eyes, light_of(background), background)

    def set_turn(self, show: int, turn: F64) -> None:
        """Take what is told, in a space that the matrix (3, 3) takes eye space to."""
        frame = self.frame
        rows = (turn @ frame.eye_from).tolist()
        eyes = rows, frame.has_perspective, frame.eye.tolist(), frame.ray.tolist()
        self.shading.set_view(show, None, *eyes, (0, 0, 0, 0), (0, 0, 0, 0))

    def set_fog(self, fog: Fog | None) -> None:
        """Take the depth cue, if there is one."""
        if fog is not None:
            frame = self.frame
            scale = 1 / (fog.far - fog.near)
            self.shading.set_fog(light_of(fog.color), fog.near, scale, frame.distance_start, frame.distance_scale)
