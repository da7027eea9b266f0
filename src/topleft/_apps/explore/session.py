"""The content that is shown, and the state of one page.

In: arrays, a mesh or the name of a scene. Out: `Content`, which all pages of an explorer share, and a `Session` for
each page.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft import Mesh

SCRIPTS = ("line.js", "elements.js", "mesh_part.js", "pixels_part.js", "race_part.js", "steps_part.js", "explore.js")
"""The modules of the page, each behind those that it imports."""

Request = dict[str, Any]
"""What a page asks: "do" names it; "parts" are the arrays that came along, as bytes."""


class Reply(NamedTuple):
    """What a page gets: values for JSON, and arrays (or bytes) by name."""

    header: dict[str, Any]
    arrays: dict[str, NDArray[Any] | bytes] = {}  # noqa: RUF012 -- of a tuple: nobody writes to it


@dataclass
class Content:
    """What an explorer was opened with.

    Attributes
    ----------
    tab : str
        Which part of the page is shown first: "pixels", "steps", "mesh" or "race".
    pixels : dict
        Of the part Pixels: the state that a link restores, without defaults.
    mesh : Mesh or None
        Of the part Mesh.
    name : str
        Of the mesh or the scene, for the reader.
    fragment : str
        What stands after the # of the address.
    moved : ndarray or None
        Vertices (V, 2) or (V, 3) of the part Pixels as a page has moved them last.
    """

    tab: str = "pixels"
    pixels: dict[str, Any] = field(default_factory=dict)
    mesh: Mesh | None = None
    name: str = ""
    fragment: str = ""
    moved: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if "vertices" in self.pixels:
            self.moved = np.array(self.pixels["vertices"], np.float64)


@dataclass
class Session:
    """One page: what its parts keep from question to question, by name."""

    content: Content
    kept: dict[str, Any] = field(default_factory=dict)


Handler = Callable[[Session, Request], Reply]
