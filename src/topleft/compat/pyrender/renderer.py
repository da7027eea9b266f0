"""Draws a scene of pyrender: colours, depth, ids of nodes.

Input: `Scene`, flags. Output: arrays as `pyrender.OffscreenRenderer` returns them.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, U8, dots_along, light_of_bytes, over, product, srgb_bytes, view_of
from topleft.compat.pyrender.graph import Node, Scene
from topleft.compat.pyrender.meshes import Primitive, material_drawn
from topleft.compat.pyrender.values import GLTF, DirectionalLight, Light, RenderFlags, SpotLight

F32 = npt.NDArray[np.float32]

MOST_LIGHTS = 4
"""Of each kind, as in pyrender: the lights nearest to the first mesh."""

FALLOFF = 1e12
"""Light of a point falls off as 1 / (d^2 + 1 / FALLOFF): as 1 / d^2, but for what is nearer than a millionth."""

GAMMA = np.rint(255 * light_of_bytes() ** (1 / 2.2)).astype(np.uint8).tobytes()
"""What pyrender shows, the power 1 / 2.2 of light, for each sRGB byte."""

AS_IT_IS = bytes(range(256))

NOT_DRAWN = {
    RenderFlags.SHADOWS_ALL: "shadows",
    RenderFlags.ALL_WIREFRAME | RenderFlags.FLIP_WIREFRAME: "wireframes",
    RenderFlags.VERTEX_NORMALS | RenderFlags.FACE_NORMALS: "normals as lines",
}
NOTHING = tl.Environment(sky=(0, 0, 0), ground=(0, 0, 0))
"""Surroundings that send no light: pyrender has none."""


class OffscreenRenderer:
    """Draws scenes into arrays, without OpenGL, a display or a GPU.

    Parameters
    ----------
    viewport_width, viewport_height : int
        Pixels.
    point_size : float
        Side of the square of a point, pixels.

    Examples
    --------
    >>> import numpy as np
    >>> from topleft.compat import pyrender
    >>> scene = pyrender.Scene(ambient_light=[0.3, 0.3, 0.3])
    >>> triangle = pyrender.Primitive([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> pose = np.eye(4)
    >>> pose[2, 3] = 3
    >>> _ = scene.add(pyrender.Mesh([triangle])), scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=pose)
    >>> color, depth = pyrender.OffscreenRenderer(64, 48).render(scene)
    >>> color.shape, round(float(depth[24, 32]), 5), float(depth[0, 0])
    ((48, 64, 3), 3.0, 0.0)
    """

    def __init__(self, viewport_width: int, viewport_height: int, point_size: float = 1.0) -> None:
        self.viewport_width, self.viewport_height = int(viewport_width), int(viewport_height)
        self.point_size = float(point_size)

    def render(
        self, scene: Scene, flags: int = RenderFlags.NONE, seg_node_map: Mapping[Node, Any] | None = None
    ) -> Any:
        """Draw what the main camera of a scene sees.

        Parameters
        ----------
        scene : Scene
        flags : int
            Of `RenderFlags`.
        seg_node_map : mapping of Node to (3,) or int of 0 to 255, optional
            With `RenderFlags.SEG`: the colour of each node; others are not drawn.

        Returns
        -------
        color : (H, W, 3) uint8, with `RenderFlags.RGBA` (H, W, 4)
        depth : (H, W) float32
            Distance along the view, 0 where nothing is. With `RenderFlags.DEPTH_ONLY` it is returned alone.

        Raises
        ------
        ValueError
            If the scene has no camera.
        """
        for mask, word in NOT_DRAWN.items():
            if flags & mask:
                warnings.warn(f"topleft.compat.pyrender draws no {word}", stacklevel=2)
        if scene.main_camera_node is None:
            raise ValueError("scene must have a camera")
        return Shot(scene, (self.viewport_width, self.viewport_height), self.point_size, flags).draw(seg_node_map)

    def delete(self) -> None:
        """Do nothing: there is no context to free."""


class Shot:
    """What one call draws."""

    def __init__(self, scene: Scene, size: tuple[int, int], point_size: float, flags: int) -> None:
        node = scene.main_camera_node
        assert node is not None
        assert node.camera is not None
        self.scene, self.size, self.point_size, self.flags = scene, size, point_size, flags
        self.camera = tl.Camera(view_of(scene.get_pose(node)), node.camera.get_projection_matrix(*size))
        self.background = np.rint(255 * np.clip(scene.bg_color, 0, 1)).astype(np.uint8)
        self.cull: Any = "none" if flags & RenderFlags.SKIP_CULL_FACES else None

    def draw(self, seg_node_map: Mapping[Node, Any] | None) -> Any:
        """The arrays that `OffscreenRenderer.render` returns."""
        is_seg = bool(self.flags & RenderFlags.SEG)
        placed = [one for one in self.scene.placed() if not is_seg or one[0] in (seg_node_map or {})]
        triangles = [one for one in placed if one[1].mode >= GLTF.TRIANGLES and len(one[1].triangles())]
        clouds = [one for one in placed if one[1].mode < GLTF.TRIANGLES and len(one[1].positions)]
        has_color = not is_seg and not self.flags & RenderFlags.DEPTH_ONLY
        layers = ("color", "depth") if has_color else ("instance", "depth") if is_seg else ("depth",)
        if not triangles:
            color, depth = self._nothing(is_seg)
        if triangles:
            found = self._of_triangles(triangles, layers)
            depth, color = found["depth"], np.empty(0, np.uint8)
            if has_color:
                color = over(found["color"], AS_IT_IS if self.flags & RenderFlags.FLAT else GAMMA, self.background)
            elif is_seg:
                shown = [np.broadcast_to((seg_node_map or {})[node], 3) for node, _, _ in triangles]
                palette = np.array([*shown, (0, 0, 0)], np.uint8)
                color = np.dstack([palette[found["instance"]], np.full(depth.shape, 255, np.uint8)])
        for node, own, pose in clouds:
            found = self._of_points(own, pose, layers)
            is_nearer = found["depth"] < depth
            depth = np.where(is_nearer, found["depth"], depth)
            if has_color:
                color[is_nearer] = found["color"][is_nearer]
            elif is_seg:
                color[is_nearer, :3] = (seg_node_map or {})[node]
        distance = self._distance(depth)
        if self.flags & RenderFlags.DEPTH_ONLY:
            return distance
        return color if self.flags & RenderFlags.RGBA else color[..., :3], distance

    def _distance(self, depth: F32) -> F32:
        """The distances along the view of window depths; 0 of +inf."""
        a, b = self.camera.projection[2, 2:].astype(np.float32)
        ndc = 2 * depth - np.float32(1)
        if self.camera.projection[3, 2]:
            return b / (ndc + a) + np.float32(0)  # which is 0 behind everything, and not -0
        distance = (b - ndc) / a
        np.copyto(distance, 0, where=np.isinf(depth))
        return distance

    def _nothing(self, is_seg: bool) -> tuple[U8, F32]:
        """The picture and the depths of a scene without anything."""
        color = np.empty((*self.size[::-1], 4), np.uint8)
        color[:] = (0, 0, 0, 255) if is_seg else self.background
        return color, np.full(self.size[::-1], np.inf, np.float32)

    def _of_triangles(self, placed: list[tuple[Node, Primitive, F64]], layers: tuple[str, ...]) -> Any:
        is_flat = bool(self.flags & RenderFlags.FLAT)
        instances = [
            tl.Instance(own.drawn(), pose, material=material_drawn(own.material, flat=is_flat))  # type: ignore[arg-type]
            for _, own, pose in placed
        ]
        look: dict[str, Any] = {}
        if "color" in layers:
            look = self._look(placed[0][2][:3, 3], is_flat)
        return tl.render_layers(tl.Scene(instances), self.camera, self.size, layers=layers, cull=self.cull, **look)

    def _look(self, near: F64, is_flat: bool) -> dict[str, Any]:
        if is_flat:
            return {"shading": "unlit", "background": "transparent", "sampling": "msaa4"}
        return {
            "background": "transparent",
            "sampling": "msaa4",
            "lights": self._lights(near),
            "ambient": float(self.scene.ambient_light.mean()),
            "environment": NOTHING,
        }

    def _lights(self, near: F64) -> list[tl.Light]:
        """The lights of the scene, at most four of each kind, the nearest to a point."""
        kinds: dict[type, list[tuple[float, int, Light, F64]]] = {}
        for k, node in enumerate(self.scene._parents):
            if node.light is not None:
                pose = self.scene.get_pose(node)
                away = float(((pose[:3, 3] - near) ** 2).sum())
                kinds.setdefault(type(node.light), []).append((away, k, node.light, pose))
        return [
            light_drawn(light, pose)
            for found in kinds.values()
            for _, _, light, pose in sorted(found, key=lambda one: one[0])[:MOST_LIGHTS]
        ]

    def _of_points(self, own: Primitive, pose: F64, layers: tuple[str, ...]) -> Any:
        camera = tl.Camera(product(self.camera.view, pose), self.camera.projection)
        if own.mode == GLTF.POINTS:
            cloud = own.drawn()
            assert isinstance(cloud, tl.Points)
            sized = tl.Points(cloud.positions, cloud.colors, size=self.point_size, shape="square")
        else:  # a pixel wide
            dots, _ = dots_along(own.segments(), camera.clip_from_world(self.size), self.size)
            sized = tl.Points(dots[:, :3], srgb_bytes(dots[:, 3:]), size=1, shape="square")
        return tl.render_layers(sized, camera, self.size, layers=layers)


def light_drawn(light: Light, pose: F64) -> tl.Light:
    """A light as topleft has it; its node's -z is the way of the light."""
    strongest = float(light.color.max())
    color = srgb_bytes(light.color / strongest) if strongest > 0 else np.zeros(3, np.uint8)
    intensity = max(light.intensity, 0.0) * strongest / math.pi  # a matt surface sends 1 / pi of it to the eye
    if isinstance(light, DirectionalLight):
        return tl.Light(pose[:3, 2], color=color, intensity=intensity)
    spot: dict[str, Any] = {}
    if isinstance(light, SpotLight):
        inner, outer = math.degrees(light.innerConeAngle), math.degrees(light.outerConeAngle)
        spot = {"direction": -pose[:3, 2], "inner_deg": inner, "outer_deg": outer}
    kind: Any = "spot" if spot else "point"
    return tl.Light(pose[:3, 3], kind=kind, color=color, intensity=intensity * FALLOFF, falloff=FALLOFF, **spot)
