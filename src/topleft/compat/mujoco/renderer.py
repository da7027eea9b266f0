"""Draws the scene of MuJoCo: colours, depth, segmentation.

Input: an `MjModel`, and an `MjvScene` that MuJoCo has updated. Output: arrays as `mujoco.Renderer` returns them.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, SHOWN_AS_LIGHT, over
from topleft.compat.mujoco import shapes
from topleft.compat.mujoco.looks import Looks, lights_of

SAMPLES = ((16, "msaa16"), (8, "msaa8"), (4, "msaa4"), (2, "msaa2"))
"""Samples of a pixel of a model's quality, and the sampling with as many."""

BEHIND = 0.3
"""Opacity of a plane that is seen from below."""


class Renderer:
    """Draws scenes of MuJoCo, in the shape of `mujoco.Renderer`; without OpenGL, a display or a GPU.

    Parameters
    ----------
    model : mujoco.MjModel
    height, width : int
        Pixels; at most the offscreen size of the model, as MuJoCo has it.
    max_geom : int
        Of the scene.
    font_scale : optional
        Not looked at: no text is drawn.

    Raises
    ------
    ValueError
        If the picture is larger than the model's offscreen buffer.
    """

    def __init__(
        self,
        model: Any,
        height: int = 240,
        width: int = 320,
        max_geom: int = 10000,
        font_scale: Any = None,  # noqa: ARG002
    ) -> None:
        import mujoco

        limits = model.vis.global_
        for name, value, most in (("width", width, limits.offwidth), ("height", height, limits.offheight)):
            if value > most:
                raise ValueError(f"{name} must be at most {most}, that of the model's offscreen buffer, got {value}")
        self._mujoco, self._model, self._height, self._width = mujoco, model, height, width
        self._scene = mujoco.MjvScene(model=model, maxgeom=max_geom)
        self._option = mujoco.MjvOption()
        self._mode, self._is_open = "color", True
        self._assets = Assets(model)
        self._sampling: Any = next((word for n, word in SAMPLES if model.vis.quality.offsamples >= n), "center")
        self._scenes: dict[tuple[Any, ...], tl.Scene] = {}
        self._sky: tuple[Any, Any] = (None, None)

    model = property(lambda self: self._model, doc="The `MjModel`.")
    scene = property(lambda self: self._scene, doc="The `MjvScene`, which may be given more geoms before `render`.")
    height = property(lambda self: self._height, doc="Pixels.")
    width = property(lambda self: self._width, doc="Pixels.")

    def enable_depth_rendering(self) -> None:
        """Have `render` return distances."""
        self._mode = "depth"

    def disable_depth_rendering(self) -> None:
        """Have `render` return colours, unless it returns segmentation."""
        self._mode = "color" if self._mode == "depth" else self._mode

    def enable_segmentation_rendering(self) -> None:
        """Have `render` return ids."""
        self._mode = "segmentation"

    def disable_segmentation_rendering(self) -> None:
        """Have `render` return colours, unless it returns distances."""
        self._mode = "color" if self._mode == "segmentation" else self._mode

    def update_scene(self, data: Any, camera: Any = -1, scene_option: Any = None) -> None:
        """Have MuJoCo update the scene.

        Parameters
        ----------
        data : mujoco.MjData
        camera : int, str or mujoco.MjvCamera
            A camera of the model, by number or name; -1: the free one.
        scene_option : mujoco.MjvOption, optional

        Raises
        ------
        ValueError
            If there is no such camera.
        """
        mujoco, model = self._mujoco, self._model
        if not isinstance(camera, mujoco.MjvCamera):
            k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, camera) if isinstance(camera, str) else int(camera)
            if not -1 <= k < model.ncam or (k < 0 and isinstance(camera, str)):
                raise ValueError(f"camera must be a name or a number of -1 to {model.ncam - 1}, got {camera!r}")
            camera = mujoco.MjvCamera()
            if k < 0:
                mujoco.mjv_defaultFreeCamera(model, camera)
            else:
                camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, k
        option = self._option if scene_option is None else scene_option
        mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene)

    def render(self, *, out: npt.NDArray[Any] | None = None) -> npt.NDArray[Any]:
        """Draw the scene.

        Parameters
        ----------
        out : array, optional
            Where the result is put, of its shape; it is cast to the dtype.

        Returns
        -------
        (H, W, 3) uint8, (H, W) float32 or (H, W, 2) int32
            Colours; distances along the view, that of the far plane where nothing is; or number and type (mjtObj) of
            the object, -1 and -1 where nothing is.

        Raises
        ------
        RuntimeError
            If the renderer is closed.
        ValueError
            If `out` has another shape.
        """
        if not self._is_open:
            raise RuntimeError("render cannot be called after close")
        shape = (self._height, self._width, *{"color": (3,), "depth": (), "segmentation": (2,)}[self._mode])
        if out is not None and out.shape != shape:
            raise ValueError(f"out must have shape {shape}, got {out.shape}")
        found = {"color": self._color, "depth": self._depth, "segmentation": self._segmentation}[self._mode]()
        if out is None:
            return found
        np.copyto(out, found, casting="unsafe")
        return out

    def close(self) -> None:
        """Forbid further pictures; there is no context to free."""
        self._is_open = False

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def _size(self) -> tuple[int, int]:
        return self._width, self._height

    def _color(self) -> npt.NDArray[Any]:
        scene = self._scene
        camera, eye = camera_of(scene.camera, self._size)
        sky = self._sky_seen(camera)
        lights, ambient, gloss = lights_of(scene)
        subject = self._subject([*scene.geoms[: scene.ngeom]], eye, gloss)
        if subject is None:
            return np.broadcast_to(np.asarray(sky, np.uint8), (self._height, self._width, 4))[..., :3].copy()
        look: dict[str, Any] = {"background": "transparent", "lights": lights, "ambient": ambient}
        picture = tl.render(subject, camera, self._size, sampling=self._sampling, **look)
        return over(picture, SHOWN_AS_LIGHT, sky)[..., :3]

    def _depth(self) -> npt.NDArray[Any]:
        camera, _ = camera_of(self._scene.camera, self._size)
        subject = self._subject(self._segmented())
        depth = np.zeros(self._size[::-1])
        if subject is not None:
            projection = camera.projection.copy()
            projection[2] = -projection[2]  # near is 1 and far 0, where float32 is fine
            upside = tl.Camera(camera.view, projection)
            drawn = tl.rasterize_mesh(subject, upside, self._size, depth_test="greater", background_depth=0.0)
            depth = drawn.depth.astype(np.float64)
        near, far = (np.float32(own * self._model.stat.extent) for own in self._planes())
        if not camera.projection[3, 2]:
            return (far - depth * (far - near)).astype(np.float32)
        # The numbers of the matrix, rounded as mujoco.Renderer has them: what is behind everything lies at far.
        c = np.float32(0.5) * ((far + near) / (far - near)) - np.float32(0.5)
        d = np.float32(0.5) * (np.float32(2) * far * near / (far - near))
        return (np.float64(d) / (depth + np.float64(c))).astype(np.float32)

    def _planes(self) -> tuple[float, float]:
        """Near and far, in extents of the model."""
        return float(self._model.vis.map.znear), float(self._model.vis.map.zfar)

    def _segmentation(self) -> npt.NDArray[Any]:
        camera, _ = camera_of(self._scene.camera, self._size)
        geoms = self._segmented()
        subject = self._subject(geoms)
        if subject is None:
            return np.full((*self._size[::-1], 2), -1, np.int32)
        frags = tl.rasterize_mesh(subject, camera, self._size)
        assert isinstance(frags, tl.SceneFragments)
        of_instance = [(geom.objid, geom.objtype) for geom in geoms for _ in self._assets.meshes_of(geom, self._scene)]
        return np.array([*of_instance, (-1, -1)], np.int32)[frags.instance]

    def _segmented(self) -> list[Any]:
        return [geom for geom in self._scene.geoms[: self._scene.ngeom] if geom.segid >= 0]

    def _subject(self, geoms: list[Any], eye: F64 | None = None, gloss: float = 1.0) -> tl.Scene | None:
        """The scene of these geoms; None of none. With colours: who sees planes from behind, strength of highlights."""
        meshes, places, looks = [], [], []
        culls = bool(self._scene.flags[self._mujoco.mjtRndFlag.mjRND_CULL_FACE])
        for geom in geoms:
            for mesh in self._assets.meshes_of(geom, self._scene):
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

    def _sky_seen(self, camera: tl.Camera) -> Any:
        """What is behind everything, (H, W, 4) uint8, or black; kept while the camera looks the same way."""
        sky = self._assets.looks.sky
        if sky is None or not self._scene.flags[self._mujoco.mjtRndFlag.mjRND_SKYBOX]:
            return (0, 0, 0, 255)
        key = camera.view[:3, :3].tobytes() + camera.projection.tobytes()
        if self._sky[0] != key:
            turned = np.eye(4)
            turned[:3, :3] = camera.view[:3, :3]
            picture = tl.render(sky, tl.Camera(turned, camera.projection), self._size, background="black")
            self._sky = key, over(picture, SHOWN_AS_LIGHT, (0, 0, 0, 255))
        return self._sky[1]


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
