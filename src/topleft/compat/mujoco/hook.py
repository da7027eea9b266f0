"""Has MuJoCo's own calls draw by topleft: `mjr_render` and `mjr_readPixels`, on which Gymnasium and dm_control stand.

Input: what those calls are given. Output: what they fill. No context of OpenGL is made: the places from which programs
take one have one that does nothing. mujoco is imported by `install` alone.
"""

from __future__ import annotations

import sys
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from topleft.compat.mujoco.painter import Painter, segmented
from topleft.compat.mujoco.renderer import Renderer

PLATFORMS = ("mujoco.egl", "mujoco.glfw", "mujoco.osmesa", "mujoco.cgl")
"""Modules whose `GLContext` MuJoCo and Gymnasium take."""

OF_DM_CONTROL = {
    "dm_control._render.glfw_renderer": "GLFWContext",
    "dm_control._render.pyopengl.egl_renderer": "EGLContext",
    "dm_control._render.pyopengl.osmesa_renderer": "OSMesaContext",
}
"""Modules of dm_control, and the contexts that they define."""

IGNORED = (
    "mjr_setBuffer", "mjr_overlay", "mjr_text", "mjr_label", "mjr_figure", "mjr_rectangle", "mjr_drawPixels",
    "mjr_finish", "mjr_setAux", "mjr_addAux", "mjr_changeFont", "mjr_restoreBuffer",
)  # fmt: skip
"""Calls that do nothing: buffers that are not there, text and figures over pictures."""

RENEWED = ("mjr_uploadTexture", "mjr_uploadMesh", "mjr_uploadHField")
"""Calls after which meshes and textures of the model are made anew."""


class GLContext:
    """A context that makes nothing current."""

    def __init__(self, *_: Any) -> None:
        pass

    def make_current(self) -> None:
        """Do nothing."""

    def free(self) -> None:
        """Do nothing."""


class MjrContext:
    """What stands for `mujoco.MjrContext`: the model's meshes and materials, and the scene that was rendered last."""

    def __init__(self, model: Any = None, fontscale: Any = None) -> None:
        self.model, self.fontScale = model, fontscale
        self.readDepthMap = self.currentBuffer = 0
        limits = None if model is None else model.vis.global_
        self.offWidth, self.offHeight = (0, 0) if limits is None else (int(limits.offwidth), int(limits.offheight))
        self.painter = None if model is None else Painter(model)
        self.rendered: tuple[Any, tuple[int, int], bool] | None = None

    def free(self) -> None:
        """Do nothing: there is no context to free."""


def mjr_render(viewport: Any, scn: Any, con: MjrContext) -> None:
    """Note a scene, which `mjr_readPixels` draws."""
    flags = import_module("mujoco").mjtRndFlag
    con.rendered = scn, (int(viewport.width), int(viewport.height)), bool(scn.flags[flags.mjRND_SEGMENT])


def mjr_readPixels(rgb: Any, depth: Any, viewport: Any, con: MjrContext) -> None:
    """Draw the scene that was rendered last into arrays, of whatever shape, whose first row is the lowest."""
    size = int(viewport.width), int(viewport.height)
    if con.rendered is None or con.painter is None or con.rendered[1] != size:
        raise ValueError(f"viewport must have the size of mjr_render's last picture, got {size}")
    scene, _, is_segmented = con.rendered
    if rgb is not None and not is_segmented:
        rgb.reshape(*size[::-1], 3)[:] = con.painter.colors(scene, size)[::-1]
    elif rgb is not None:
        geoms, shown = con.painter.geoms(scene, size)
        numbers = np.array([*(geom.segid + 1 for geom in geoms), 0], np.uint32)[shown]
        rgb.reshape(*size[::-1], 3)[:] = (numbers[::-1, :, None] >> np.array([0, 8, 16], np.uint32)).astype(np.uint8)
    if depth is not None:
        drawn = segmented(scene) if is_segmented else [*scene.geoms[: scene.ngeom]]
        found = con.painter.depth(scene, size, drawn)[::-1]
        is_far_zero = con.readDepthMap == import_module("mujoco").mjtDepthMap.mjDEPTH_ZEROFAR
        depth.reshape(size[::-1])[:] = found if is_far_zero else 1 - found


def mjr_resizeOffscreen(width: int, height: int, con: MjrContext) -> None:
    """Note the size of a buffer that is not there."""
    con.offWidth, con.offHeight = int(width), int(height)


def mjr_maxViewport(con: MjrContext) -> Any:
    """The rectangle of that size."""
    return import_module("mujoco").MjrRect(0, 0, con.offWidth, con.offHeight)


def renew(_: Any, con: MjrContext, *__: Any) -> None:
    """Make meshes and textures of the model anew."""
    con.painter = Painter(con.model)


def nothing(*_: Any, **__: Any) -> None:
    """Do nothing."""


CALLS = (mjr_render, mjr_readPixels, mjr_resizeOffscreen, mjr_maxViewport)


def install() -> None:
    """Have MuJoCo's Python module draw by topleft from now on, and what stands on it: Gymnasium, dm_control.

    Call it before those are imported.
    """
    for name in PLATFORMS:
        sys.modules[name] = module = ModuleType(name)
        module.GLContext = GLContext  # type: ignore[attr-defined]
    for name, word in OF_DM_CONTROL.items():
        sys.modules[name] = module = ModuleType(name)
        module.__getattr__ = partial(context_of_dm_control, word)  # type: ignore[method-assign]
    mujoco = import_module("mujoco")
    calls: dict[str, Any] = {own.__name__: own for own in CALLS}
    calls |= dict.fromkeys(IGNORED, nothing) | dict.fromkeys(RENEWED, renew)
    calls |= {"MjrContext": MjrContext, "GLContext": GLContext, "Renderer": Renderer}
    for name, own in calls.items():
        setattr(mujoco, name, own)


def context_of_dm_control(word: str, asked: str) -> Any:
    """A context of dm_control that makes nothing current, when it asks for what it calls `word`."""
    if asked != word:
        raise AttributeError(asked)
    executor = import_module("dm_control._render.executor")
    kind: Any = import_module("dm_control._render.base").ContextBase

    class Context(kind):  # type: ignore[misc]
        _platform_init = _platform_make_current = _platform_free = nothing

        def __init__(self, max_width: int, max_height: int) -> None:
            super().__init__(max_width, max_height, executor.PassthroughRenderExecutor)

    return Context
