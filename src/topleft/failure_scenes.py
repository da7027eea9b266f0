"""Small scenes on which methods fail, with the right picture and the pictures of the methods.

They stand in failure_scenes.json: the first failure of each method along the families of the atlas
(docs/measured/atlas.md), triangles left out and coordinates rounded as far as it stayed;
`tests/methods/test_failure_scenes.py` draws them all. The production methods are right on each.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["FAILURE_SCENES", "FailureScene", "Got"]


@dataclass(frozen=True, slots=True)
class Got:
    """The picture of a scene by one method.

    Attributes
    ----------
    method : str
    subpixel_bits : int
        8 where the method has none.
    rows : str
        The picture, as in `FailureScene.expected`.
    """

    method: str
    subpixel_bits: int
    rows: str


@dataclass(frozen=True, slots=True)
class FailureScene:
    """Triangles, a window, its right picture, and the pictures of the methods that fail.

    Attributes
    ----------
    name : str
    family, value : str
        Its place in the atlas: the family of scenes, and the first value at which the methods fail.
    kind : str
        "gap" and "overdraw" (pixels drawn less or more often than they should be), or "wrong" (another triangle shows).
    points : tuple of (float, float)
        Vertices, pixels.
    triangles : tuple of (int, int, int)
    size, origin : (int, int)
        The window, as in `topleft.coverage`.
    subpixel_bits : int
        With so many the production methods draw the expected picture; fewer may move a vertex.
    expected : str
        Rows of the exact picture of the vertices as they are, from the top, with "/" between them. A sign a pixel: how
        often it is drawn, or, for "wrong", the index of the triangle that shows; "." is none.
    got : tuple of Got
        The methods that fail at this value first.
    """

    name: str
    family: str
    value: str
    kind: str
    points: tuple[tuple[float, float], ...]
    triangles: tuple[tuple[int, int, int], ...]
    size: tuple[int, int]
    origin: tuple[int, int]
    subpixel_bits: int
    expected: str
    got: tuple[Got, ...]

    def shape(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
        """Return vertices (V, 2) float64, pixels, and triangles (T, 3) int32."""
        return np.array(self.points, np.float64), np.array(self.triangles, np.int32)


def picture(rows: str) -> npt.NDArray[np.int32]:
    """Return rows of `FailureScene.expected` as integers (H, W); "." is -1.

    Examples
    --------
    >>> picture("01/.2").tolist()
    [[0, 1], [-1, 2]]
    """
    return np.array([[-1 if sign == "." else int(sign, 36) for sign in row] for row in rows.split("/")], np.int32)


def scene_of(row: Mapping[str, Any]) -> FailureScene:
    """Return a scene from the JSON object of `dataclasses.asdict`."""
    got = tuple(Got(**picture) for picture in row["got"])
    points, triangles = (tuple(map(tuple, row[name])) for name in ("points", "triangles"))
    size, origin = (tuple(row[name]) for name in ("size", "origin"))
    fields = {"points": points, "triangles": triangles, "size": size, "origin": origin, "got": got}
    return FailureScene(**{**row, **fields})


_ROWS = json.loads(files("topleft").joinpath("failure_scenes.json").read_text(encoding="utf-8"))
FAILURE_SCENES: Mapping[str, FailureScene] = MappingProxyType({row["name"]: scene_of(row) for row in _ROWS})
"""By name."""
