"""The state of the part Pixels: what is drawn and how, checked, as a page and a link hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from topleft._apps.explore.content import MAX_SIDE_PX, MAX_TRIANGLES, MAX_VERTICES
from topleft._core.base.arrays import as_checked_triangles
from topleft._core.base.options import check_choice
from topleft.methods import CLASSICS, find_method
from topleft.typing import CullOption, DepthTestOption, SamplingOption

Turn = Literal["as given", "clockwise", "counter-clockwise"]
Look = Literal["owners", "overdraw", "wireframe"]

MAX_COORDINATE = 2.0**52
"""Pixels from 0: beyond it a vertex cannot be moved by a pixel's half."""


@dataclass(frozen=True)
class PixelState:
    """What is drawn magnified, and how; sampling, cull and depth_test are those of `rasterize`."""

    vertices: NDArray[np.float64]  # (V, 2) or (V, 3), pixels of the whole picture
    triangles: NDArray[np.int32]  # (T, 3), as they are turned by `winding`
    size: tuple[int, int]  # of the window
    origin: tuple[int, int] = (0, 0)
    method: str = "auto"
    other: str = ""  # draws the second picture; "" for no second one
    exact: bool = False  # whether the exact picture is drawn, too
    subpixel_bits: int | Literal["exact"] = 8
    sampling: SamplingOption = "center"
    cull: CullOption = "none"
    depth_test: DepthTestOption = "less"
    winding: Turn = "as given"  # how triangles turn on the screen before they are drawn
    look: Look = "owners"

    @property
    def has_depth(self) -> bool:
        """Whether vertices have a depth."""
        return self.vertices.shape[1] == 3

    def options(self, method: str) -> dict[str, Any]:
        """Return what a verb of the library is asked for, and no more than the method has."""
        classic = CLASSICS.get(method)
        if classic is None:
            found: dict[str, Any] = {"subpixel_bits": self.subpixel_bits, "sampling": self.sampling, "cull": self.cull}
            if self.sampling == "area" and self.subpixel_bits == "exact":
                found["subpixel_bits"] = 8
        else:
            has_bits = classic.has_subpixel_bits and self.subpixel_bits != "exact"
            found = {"subpixel_bits": self.subpixel_bits if has_bits else 8, "sampling": "center", "cull": "none"}
        usual = {"subpixel_bits": 8, "sampling": "center", "cull": "none"}
        found = {name: value for name, value in found.items() if value != usual[name]}
        return {"method": method} | ({"origin": self.origin} if any(self.origin) else {}) | found

    def lacks(self, method: str) -> list[str]:
        """Return what was asked for that a method does not have, in words."""
        drawn = {"subpixel_bits": 8, "sampling": "center", "cull": "none"} | self.options(method)
        told = []
        if drawn["subpixel_bits"] != self.subpixel_bits:
            told.append("8 sub-pixel bits" if method not in CLASSICS else "its own grid")
        elif method in CLASSICS and CLASSICS[method].claims.integer_vertices:
            told.append("whole pixels")
        if drawn["sampling"] != self.sampling:
            told.append("at centres")
        if drawn["cull"] != self.cull:
            told.append("nothing culled")
        if method in CLASSICS and self.has_depth:
            told.append("no depth")
        return told


def parse_state(given: object) -> PixelState:
    """Return a state from the JSON object that a page or a link holds."""
    if not isinstance(given, Mapping):
        raise TypeError(f"a state must be an object, got {type(given).__name__}")
    names = {one.name for one in fields(PixelState)}
    if unknown := sorted(set(map(str, given)) - names - {"scene"}):
        raise ValueError(f"a state has no {', '.join(unknown)[:80]}")
    if missing := [name for name in ("vertices", "triangles", "size") if name not in given]:
        raise ValueError(f"a state must have {' and '.join(missing)}")
    state: dict[str, Any] = {name: value for name, value in given.items() if name in names}
    state["size"] = pair("size", state["size"], 1, MAX_SIDE_PX)
    state["origin"] = pair("origin", state.get("origin", (0, 0)), -(2**52), 2**52)
    points = state["vertices"] = as_points(state["vertices"])
    bits = state.setdefault("subpixel_bits", 8)
    if bits != "exact" and not (type(bits) is int and 0 <= bits <= 16):
        raise ValueError(f"subpixel_bits must be from 0 to 16, or 'exact', got {str(bits)[:40]!r}")
    if type(state.setdefault("exact", False)) is not bool:
        raise TypeError("exact must be true or false")
    find_method(state.get("method", "auto"))
    if state.get("other", ""):
        find_method(state["other"])
    for name, kind in (
        ("sampling", SamplingOption), ("cull", CullOption), ("depth_test", DepthTestOption), ("winding", Turn),
        ("look", Look),
    ):  # fmt: skip
        if name in state:
            check_choice(name, state[name], get_args(kind))
    triangles = state["triangles"]
    if isinstance(triangles, list) and len(triangles) > MAX_TRIANGLES:
        raise ValueError(f"at most {MAX_TRIANGLES} triangles are drawn magnified, got {len(triangles)}")
    corners = as_checked_triangles(triangles if triangles != [] else np.zeros((0, 3), np.int32), len(points))
    state["triangles"] = turned(points, corners, cast(Turn, state.get("winding", "as given")))
    return PixelState(**state)


def as_points(values: object) -> NDArray[np.float64]:
    """Vertices (V, 2) or (V, 3) of finite numbers."""
    if not isinstance(values, list):
        raise TypeError("vertices must be a list of rows")
    if len(values) > MAX_VERTICES:
        raise ValueError(f"at most {MAX_VERTICES} vertices are drawn magnified, got {len(values)}")
    n = {len(row) if isinstance(row, list) else 0 for row in values} or {2}
    is_number = all(type(value) in (int, float) for row in values if isinstance(row, list) for value in row)
    if n not in ({2}, {3}) or not is_number:
        raise ValueError("vertices must be rows of two or three numbers each, all of one length")
    points = np.array(values, np.float64).reshape(-1, n.pop())
    if not (np.abs(points[:, :2]) <= MAX_COORDINATE).all() or not (np.abs(points[:, 2:]) < 1e38).all():
        raise ValueError(f"vertices must lie within {MAX_COORDINATE:.0f} pixels of 0")
    return points


def pair(name: str, value: object, least: int, greatest: int) -> tuple[int, int]:
    """Two whole numbers of a range."""
    if not (isinstance(value, (list, tuple)) and len(value) == 2 and all(type(number) is int for number in value)):
        raise ValueError(f"{name} must be two whole numbers, got {str(value)[:40]}")
    if not all(least <= number <= greatest for number in value):
        raise ValueError(f"{name} must be from {least} to {greatest}, got {value[0]}, {value[1]}")
    return value[0], value[1]


def turned(points: NDArray[np.float64], triangles: NDArray[np.int32], winding: Turn) -> NDArray[np.int32]:
    """Triangles that all turn one way on the screen, where y points down."""
    if winding == "as given" or not len(triangles):
        return triangles
    a, b, c = (points[triangles[:, k], :2] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    is_wrong = area < 0 if winding == "clockwise" else area > 0
    return np.where(is_wrong[:, None], triangles[:, [0, 2, 1]], triangles).astype(np.int32)
