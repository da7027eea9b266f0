"""The renderer of MuJoCo, drawn by topleft: ``from topleft.compat.mujoco import Renderer``.

`Renderer` has the calls of `mujoco.Renderer`: colours, depth and segmentation of a scene that MuJoCo has updated,
without OpenGL, a display or a GPU. `install` has MuJoCo's own calls draw so, and with them Gymnasium and dm_control.
Shadows, reflections, haze, lines and labels are not drawn.
"""

from topleft.compat.mujoco.hook import install
from topleft.compat.mujoco.renderer import Renderer

__all__ = ["Renderer", "install"]
