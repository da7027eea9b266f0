"""The contestants: topleft, and the renderers that a user could call instead, one file each.

A peer file has

    MODULE         the module to import
    DISTRIBUTION   its name for pip
    TASKS          the tasks of `scenes.cases.TASKS` that it can do
    prepare(scene, threads) -> Drawing

and may have `environment(threads)`, variables for its process, and `THREADS`: whether it can use more than one.
Nothing but the standard library and NumPy is imported at module level, so that the list of peers costs nothing.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from numpy.typing import NDArray

PEERS = {
    "llvmpipe": "OpenGL on Mesa's software rasterizer, by moderngl",
    "opencv": "OpenCV: fillConvexPoly, triangleRasterizeDepth",
    "pillow": "Pillow: ImageDraw.polygon",
    "deodr": "DEODR, a differentiable renderer",
    "vtk": "VTK off screen, which draws by OpenGL",
    "riley": "riley-raster, software rendering for image correlation",
    "open3d": "Open3D's ray casting scene: Embree, one ray a pixel",
    "datashader": "datashader: trimesh by numba",
    "skia": "skia-python: drawVertices and drawPath",
    "cairo": "pycairo: fill",
    "skimage": "scikit-image: draw.polygon",
    "agg": "Anti-Grain Geometry, by matplotlib: draw_path, PolyCollection",
    "aggdraw": "Anti-Grain Geometry, by aggdraw: polygon",
    "blend2d": "Blend2D, by blend2d-py: fill_path",
}
"""Peers by name, in the order of the report."""

OURS = "topleft"
BROKEN = "broken"
"""Draws nothing, to see that the count of wrong pixels counts; runs only when named."""


@dataclass(frozen=True)
class Drawing:
    """A scene made ready: `draw` is timed, `picture` gives its result.

    `gives` names the arrays that one call of `draw` leaves, `untimed` the work before it.
    """

    draw: Callable[[], object]
    picture: Callable[[], dict[str, NDArray[Any]]]
    gives: str
    untimed: str = ""


def llvmpipe_context() -> Any:
    """A context without a display. RuntimeError where OpenGL runs on something else than llvmpipe."""
    import moderngl

    context = moderngl.create_standalone_context(require=330, backend="egl")
    if "llvmpipe" not in context.info["GL_RENDERER"]:
        raise RuntimeError(f"OpenGL runs on {context.info['GL_RENDERER']}, not on llvmpipe")
    return context


def load_peer(name: str) -> ModuleType:
    """The file of a contestant."""
    if name not in (OURS, BROKEN, *PEERS):
        raise ValueError(f"no peer {name!r}; there are {', '.join(PEERS)}")
    return importlib.import_module(f"benchmarks.peers.{name}_peer")


def environment_of(peer: ModuleType, threads: int) -> Mapping[str, str]:
    """Variables that a peer wants in its process."""
    return peer.environment(threads) if hasattr(peer, "environment") else {}


def why_not(peer: ModuleType, task: str, threads: int) -> str | None:
    """Why a contestant sits a case out, as far as that is known without starting it."""
    if task not in peer.TASKS:
        return f"does not do {task}"
    if threads > 1 and not getattr(peer, "THREADS", False):
        return "runs on one thread"
    if importlib.util.find_spec(peer.MODULE) is None:
        return f"{peer.DISTRIBUTION} is not installed"
    return None
