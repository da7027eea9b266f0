"""The exact picture of a scene after the snap to 1/256 pixel, and how far another picture is from it.

Nothing of the engine draws it: see `topleft.methods.reference.integers`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.cases import Scene
from topleft.methods.reference.integers import ExactPicture, areas

AREA_ROUNDING = 1e-9
"""The largest error of sums of areas."""

OTHER_SURFACE = 1e-4
"""Window depth: far more than the rounding of any peer's depth buffer."""

Picture = dict[str, NDArray[Any]]
"""The result of a contestant: any of "triangle" (H, W) int32, "depth" float32, "mask" bool, "color" (H, W, 3) uint8."""


@dataclass(frozen=True)
class Error:
    """How far a picture is from the exact one."""

    wrong_px: int
    max_depth_error: float | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"wrong_px": self.wrong_px, "max_depth_error": self.max_depth_error}


def compare(picture: Picture, exact: Picture) -> Error | AreaError:
    """Count wrong pixels: ids where there are ids, else colours, else coverage; areas: see `area_error`.

    With depth and no ids, a pixel with depth off by more than `OTHER_SURFACE` is wrong too: another triangle shows.
    The largest difference of depth is over the pixels that both cover; with ids, over those with equal ids.
    """
    if "area" in exact:
        return area_error(picture, exact["area"])
    difference = None
    if "depth" in picture and "depth" in exact:
        both = coverage(picture) & exact["mask"]
        difference = np.zeros(both.shape)
        difference[both] = np.abs(picture["depth"][both].astype(np.float64) - exact["depth"][both])
    if "triangle" in picture:
        wrong = picture["triangle"] != exact["triangle"]
    elif "color" in picture:
        wrong = (picture["color"] != exact["color"]).any(axis=-1)
    else:
        wrong = coverage(picture) != exact["mask"]
        if difference is not None:
            wrong |= difference > OTHER_SURFACE
    if difference is None or not both.any():
        return Error(int(wrong.sum()), None)
    if "triangle" in picture:
        both &= ~wrong
    return Error(int(wrong.sum()), float(difference[both].max(initial=0)))


@dataclass(frozen=True)
class AreaError:
    """How far a smooth picture of white triangles that do not overlap is from the areas that they cover."""

    wrong_px: int
    """Pixels that are covered whole and not white: seams."""
    darkest: float
    """Of these, 0 to 1."""
    rms: float | None
    """Over the partly covered pixels, if there are any."""
    worst: float | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"wrong_px": self.wrong_px, "darkest": self.darkest, "rms": self.rms, "worst": self.worst}


def area_error(picture: Picture, area: NDArray[np.float64]) -> AreaError:
    """Compare coverage, as such or as the brightness of the first channel, with exact areas."""
    drawn = picture["area"].astype(np.float64) if "area" in picture else picture["color"][..., 0] / 255
    is_whole = area > 1 - AREA_ROUNDING
    is_part = (area > AREA_ROUNDING) & ~is_whole
    error = np.abs(drawn - area)[is_part]
    rms, worst = (float(np.sqrt((error**2).mean())), float(error.max())) if error.size else (None, None)
    whole = drawn[is_whole]
    return AreaError(int((whole < 1).sum()), float(whole.min(initial=1)), rms, worst)


def coverage(picture: Picture) -> NDArray[np.bool_]:
    """Which pixels a picture covers."""
    if "mask" in picture:
        return picture["mask"].astype(bool)
    if "triangle" in picture:
        return picture["triangle"] >= 0
    return np.isfinite(picture["depth"])


def draw_exact(scene: Scene) -> Picture:
    """The picture that a contestant should draw; nothing where there is no exact one."""
    if scene.task == "smooth-fill":
        is_white = scene.colors is not None and (scene.colors == 255).all()
        return {"area": areas(scene.vertices, scene.triangles, scene.size)} if is_white else {}
    with_depth = scene.task in ("visibility", "depth-2d")
    test = "less" if with_depth else None
    exact = ExactPicture(scene.snapped(), scene.triangles, scene.size, depth_tests=(test,), cull=scene.cull)
    picture: Picture = {"triangle": exact.triangle, "mask": exact.triangle >= 0}
    if with_depth:
        picture["depth"] = np.where(picture["mask"], exact.depth(exact.triangle)[0], np.inf).astype(np.float32)
    if scene.colors is not None:
        palette = np.concatenate([scene.colors, np.zeros((1, scene.colors.shape[1]), scene.colors.dtype)])
        picture["color"] = palette[picture["triangle"]]
    return picture
