"""The content of an explorer, and the state of a page.

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

SCRIPTS = (
    "line.js", "elements.js", "edits.js", "numbers.js", "colors.js", "engine.js", "state.js", "exact.js", "pixels.js",
    "probe.js", "steps.js", "race.js", "mesh_part.js", "pixels_part.js", "race_part.js", "steps_part.js", "explore.js",
)  # fmt: skip
"""The modules of the page, each after the modules that it imports."""

Request = dict[str, Any]
"""A request of a page: "do" names its handler; "parts" are its arrays, as bytes."""


class Reply(NamedTuple):
    """The reply to a request: values for JSON, and arrays (or bytes) by name."""

    header: dict[str, Any]
    arrays: dict[str, NDArray[Any] | bytes] = {}  # noqa: RUF012 -- of a tuple: nobody writes to it


@dataclass
class Content:
    """The content that an explorer shows."""

    tab: str = "pixels"  # shown first: "pixels", "steps", "mesh" or "race"
    pixels: dict[str, Any] = field(default_factory=dict)  # the state that a link restores, without defaults
    mesh: Mesh | None = None
    name: str = ""  # of the mesh or the scene, for the reader
    fragment: str = ""  # of the address, behind the #
    moved: NDArray[np.float64] | None = None  # (V, 2) or (V, 3): vertices as a page has moved them last

    def __post_init__(self) -> None:
        if "vertices" in self.pixels:
            self.moved = np.array(self.pixels["vertices"], np.float64)


@dataclass
class Session:
    """A page: the state of its parts between requests, by name."""

    content: Content
    kept: dict[str, Any] = field(default_factory=dict)


Handler = Callable[[Session, Request], Reply]
