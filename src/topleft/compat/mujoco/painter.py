"""Draws scenes of MuJoCo: colours, window depth, and which geom is seen.

Input: an `MjModel`, and an `MjvScene` that MuJoCo has updated. Output: arrays, row 0 on top.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, SHOWN_AS_LIGHT, U8, over
from topleft.compat.mujoco import shapes
from topleft.compat.mujoco.looks import Looks, lights_of

SAMPLES = ((16, "msaa16"), (8, "msaa8"), (4, "msaa4"), (2, "msaa2"))
"""Samples of a pixel of a model's quality, and the sampling with as many."""

BEHIND = 0.3
"""Opacity of a plane that is seen from below."""


class Painter:
    """Draws scenes of one model; meshes, materials and scenes are kept from picture to picture.

    Parameters
    ----------
    model : mujoco.MjModel
    """

    def __init__(self, model: Any) -> None:
        import mujoco

        self.model, self._flags = model, mujoco.mjtRndFlag
        self._assets = Assets(model)
        self._sampling: Any = next((word for n, word in SAMPLES if model.vis.quality.offsamples >= n), "center")
        self._scenes: dict[tuple[Any, ...], tl.Scene] = {}
        self._sky: tuple[Any, Any] = (None, None)

    def colors(self, scene: Any, size: tuple[int, int]) -> U8:
        """The picture (H, W, 3)."""
        camera, eye = camera_of(scene.camera, size)
        sky = self._sky_seen(scene, camera, size)
        lights, ambient, gloss = lights_of(scene)
        subject = self._subject(scene, [*scene.geoms[: scene.ngeom]], eye, gloss)
        if subject is None:
            return np.broadcast_to(np.asarray(sky, np.uint8), (*size[::-1], 4))[..., :3].copy()
        look: dict[str, Any] = {"background": "transparent", "lights": lights, "ambient": ambient}
        picture = tl.render(subject, camera, size, sampling=self._sampling, **look)
        return over(picture, SHOWN_AS_LIGHT, sky)[..., :3]

    def depth(self, scene: Any, size: tuple[int, int], geoms: list[Any]) -> F64:
        """Window depth (H, W) of some geoms: 1 at the near plane, 0 at the far one, where float32 is fine."""
        camera, _ = camera_of(scene.camera, size)
        subject = self._subject(scene, geoms)
        if subject is None:
            return np.zeros(size[::-1])
        projection = camera.projection.copy()
        projection[2] = -projection[2]
        upside = tl.Camera(camera.view, projection)
        drawn = tl.rasterize_mesh(subject, upside, size, depth_test="greater", background_depth=0.0)
        return drawn.depth.astype(np.float64)

    def geoms(self, scene: Any, size: tuple[int, int]) -> tuple[list[Any], npt.NDArray[np.intp]]:
        """The geoms that have ids, and which of them each pixel (H, W) shows, -1 where none."""
        geoms = segmented(scene)
        subject = self._subject(scene, geoms)
        if subject is None:
            return geoms, np.full(size[::-1], -1, np.intp)
        frags = tl.rasterize_mesh(subject, camera_of(scene.camera, size)[0], size)
        assert isinstance(frags, tl.SceneFragments)
        number = [k for k, geom in enumerate(geoms) for _ in self._assets.meshes_of(geom, scene)]
        return geoms, np.array([*number, -1], np.intp)[frags.instance]

    def _subject(self, scene: Any, geoms: list[Any], eye: F64 | None = None, gloss: float = 1.0) -> tl.Scene | None:
        """The scene of these geoms; None of none. With colours: who sees planes from behind, strength of highlights."""
        meshes, places, looks = [], [], []
        culls = bool(scene.flags[self._flags.mjRND_CULL_FACE])
        for geom in geoms:
            for mesh in self._assets.meshes_of(geom, scene):
                meshes.append(mesh)
                places.append(geom)
                is_flat_side = geom.type in (shapes.PLANE, shapes.TRIANGLE)
                is_below = eye is not None and geom.type == shapes.PLANE and is_behind(geom, eye)
                is_double = not culls or is_flat_side
                own = self._assets.looks
                opacity = BEHIND if is_below else 1.0
                is_lit = eye is not None
                looks.append(own.of(geom, opacity, gloss, is_double=is_double) if is_lit else own.plain[is_double])
        if not meshes:
            return None
        poses = np.zeros((len(places), 4, 4))
        poses[:, 3, 3] = 1
        is_global = [geom.type in (shapes.FLEX, shapes.SKIN) for geom in places]
        poses[:, :3, :3] = [np.eye(3) if own else geom.mat for own, geom in zip(is_global, places, strict=True)]
        poses[:, :3, 3] = [(0, 0, 0) if own else geom.pos for own, geom in zip(is_global, places, strict=True)]
        poses[:, :3, :3] = orthonormal(poses[:, :3, :3])
        key = (tuple(map(id, meshes)), tuple(map(id, looks)))
        if key not in self._scenes:
            if len(self._scenes) >= 8:
                self._scenes.clear()
            pairs = zip(meshes, looks, strict=True)
            self._scenes[key] = tl.Scene([tl.Instance(mesh, material=look) for mesh, look in pairs])
        return self._scenes[key].with_transforms(poses)

    def _sky_seen(self, scene: Any, camera: tl.Camera, size: tuple[int, int]) -> Any:
        """What is behind everything, (H, W, 4) uint8, or black; kept while the camera looks the same way."""
        sky = self._assets.looks.sky
        if sky is None or not scene.flags[self._flags.mjRND_SKYBOX]:
            return (0, 0, 0, 255)
        key = size, camera.view[:3, :3].tobytes(), camera.projection.tobytes()
        if self._sky[0] != key:
            turned = np.eye(4)
            turned[:3, :3] = camera.view[:3, :3]
            picture = tl.render(sky, tl.Camera(turned, camera.projection), size, background="black")
            self._sky = key, over(picture, SHOWN_AS_LIGHT, (0, 0, 0, 255))
        return self._sky[1]


def segmented(scene: Any) -> list[Any]:
    """The geoms of a scene that have ids."""
    return [geom for geom in scene.geoms[: scene.ngeom] if geom.segid >= 0]


class Assets:
    """The meshes and materials of a model, made when a scene first shows them."""

    def __init__(self, model: Any) -> None:
        self.model, self.looks = model, Looks(model)
        self.quality = int(model.vis.quality.numslices), int(model.vis.quality.numstacks)
        self.made: dict[tuple[Any, ...], tuple[tl.Mesh, ...]] = {}

    def meshes_of(self, geom: Any, scene: Any) -> tuple[tl.Mesh, ...]:
        """What is drawn for a geom: one mesh, or none."""
        kind, data = int(geom.type), int(geom.dataid)
        if kind in (shapes.FLEX, shapes.SKIN):
            return deformed(self.model, geom, scene)
        size = tuple(geom.size.tolist())
        cube = self.looks.cube_of(geom)
        key = (kind, data, cube, size if data < 0 or kind in (shapes.PLANE, *shapes.TAKES_SIZE) or cube else None)
        if key not in self.made:
            mesh = self._make(kind, data, size)
            if mesh is not None and cube is not None:
                mesh = self.looks.laid_on_cube(mesh, geom, cube)
            self.made[key] = () if mesh is None else (mesh,)
        return self.made[key]

    def _make(self, kind: int, data: int, size: Any) -> tl.Mesh | None:
        if kind == shapes.PLANE:
            reach = 1.05 * self.model.vis.map.zfar * self.model.stat.extent
            return shapes.plane(size[:2], reach)
        if kind == shapes.HFIELD:
            return shapes.height_field(self.model, data) if data >= 0 else None
        if kind in (shapes.MESH, shapes.SDF):
            return shapes.asset(self.model, data) if data >= 0 else None
        return shapes.primitive(kind, size, self.quality) if kind in shapes.TAKES_SIZE else None


def deformed(model: Any, geom: Any, scene: Any) -> tuple[tl.Mesh, ...]:
    """The faces of a flex or a skin, in the world."""
    k = int(geom.objid)
    if geom.type == shapes.SKIN:
        rows = slice(int(scene.skinvertadr[k]), int(scene.skinvertadr[k]) + int(scene.skinvertnum[k]))
        points, normals = (np.array(own, np.float64).reshape(-1, 3)[rows] for own in (scene.skinvert, scene.skinnormal))
        first = int(model.skin_faceadr[k])
        return (tl.Mesh(points, model.skin_face[first : first + int(scene.skinfacenum[k])], normals),)
    first, n = 3 * int(scene.flexfaceadr[k]), 3 * int(scene.flexfaceused[k])
    if not n:
        return ()
    points, normals = (
        np.array(own, np.float64).reshape(-1, 3)[first : first + n] for own in (scene.flexface, scene.flexnormal)
    )
    return (tl.Mesh(points, np.arange(n).reshape(-1, 3), normals),)


def orthonormal(axes: F64) -> F64:
    """Rotations (N, 3, 3) of float32 as those of float64, whose columns are at right angles to the last bits."""
    x, y, _ = np.moveaxis(axes, 2, 0)
    x = x / np.sqrt((x * x).sum(axis=1, keepdims=True))
    y = y - x * (x * y).sum(axis=1, keepdims=True)
    y = y / np.sqrt((y * y).sum(axis=1, keepdims=True))
    return np.stack([x, y, np.cross(x, y)], axis=2)


def is_behind(geom: Any, eye: F64) -> bool:
    """Whether the eye is on the back of a plane."""
    return float(((eye - geom.pos) * geom.mat[:, 2]).sum()) < 0


def camera_of(pair: Any, size: tuple[int, int]) -> tuple[tl.Camera, F64]:
    """The camera between those of two eyes, and where it is."""
    place, forward, up = (
        (np.asarray(getattr(pair[0], name), np.float64) + getattr(pair[1], name)) / 2
        for name in ("pos", "forward", "up")
    )
    backward = -forward / np.sqrt((forward**2).sum())
    right = np.cross(up, backward)
    right /= np.sqrt((right**2).sum())
    view = np.eye(4)
    view[:3, :3] = right, np.cross(backward, right), backward
    view[:3, 3] = -(view[:3, :3] * place).sum(axis=1)
    names = ("center", "width", "bottom", "top", "near", "far")
    center, width, bottom, top, near, far = (
        (getattr(pair[0], f"frustum_{name}") + getattr(pair[1], f"frustum_{name}")) / 2 for name in names
    )
    half = width if width else 0.5 * size[0] / size[1] * (top - bottom)
    camera = tl.Camera.off_center(
        view, left=center - half, right=center + half, bottom=bottom, top=top, near=near, far=far,
        ortho=bool(pair[0].orthographic),
    )  # fmt: skip
    return camera, place
