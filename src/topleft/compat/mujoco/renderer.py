"""Draws the scene of MuJoCo: colours, depth, segmentation.

Input: an `MjModel`, and an `MjvScene` that MuJoCo has updated. Output: arrays as `mujoco.Renderer` returns them.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.compat.mujoco.painter import Painter, segmented


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
        self._painter = Painter(model)

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
        return self._painter.colors(self._scene, self._size)

    def _depth(self) -> npt.NDArray[Any]:
        depth = self._painter.depth(self._scene, self._size, segmented(self._scene))
        own = self._model.vis.map
        near, far = (np.float32(plane * self._model.stat.extent) for plane in (float(own.znear), float(own.zfar)))
        if self._scene.camera[0].orthographic:
            return (far - depth * (far - near)).astype(np.float32)
        # The numbers of the matrix, rounded as mujoco.Renderer has them: what is behind everything lies at far.
        c = np.float32(0.5) * ((far + near) / (far - near)) - np.float32(0.5)
        d = np.float32(0.5) * (np.float32(2) * far * near / (far - near))
        return (np.float64(d) / (depth + np.float64(c))).astype(np.float32)

    def _segmentation(self) -> npt.NDArray[Any]:
        geoms, shown = self._painter.geoms(self._scene, self._size)
        return np.array([*((geom.objid, geom.objtype) for geom in geoms), (-1, -1)], np.int32)[shown]
