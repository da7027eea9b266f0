"""The pure twins of the methods, in Python and NumPy: the cost of the exact reference and of readable code.

A twin is timed on few triangles in a small frame, and must draw the pixels of its kernel there; so its error is that of
the kernel, which is counted on many.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.turns import turn_of
from benchmarks.scenes.families import Entry, Triangles

FRAME_PX = 512


@dataclass(frozen=True)
class Twin:
    """Pure code for the picture of `entry`."""

    name: str
    entry: Entry
    n_timed: dict[str, int]
    """How many triangles of a family one call draws."""

    def overdraw(self, scene: Triangles, size: tuple[int, int]) -> np.ndarray:
        """Return how often it draws each pixel."""
        if self.entry.bits is not None:
            from topleft.methods import reference

            return reference.overdraw(*scene, size, subpixel_bits=self.entry.bits)
        module, _, variant = self.entry.method.partition("/")
        draw: Callable[..., np.ndarray] = import_module(f"topleft.methods.twins.{module}").overdraw
        return draw(*scene, size, variant)


SLOW = {"small": 100, "medium": 5, "large": 1, "slivers": 1}
FASTER = {"small": 100, "medium": 40, "large": 4, "slivers": 40}

TWINS = (
    Twin("exact reference", Entry("auto", 8), SLOW),
    *(
        Twin(f"{name}, pure", Entry(name), FASTER)
        for name in ("point_in_triangle", "bresenham_scanline", "lerp_scanline", "row_crossing", "float_barycentric")
    ),
)


def times_ms(twin: Twin, scene: Triangles, size: tuple[int, int], rounds: int) -> NDArray[np.float64]:
    """Return the times of at most three calls, alone: beside pure code nothing else counts."""
    call = partial(twin.overdraw, twin.entry.orient(scene), size)
    return np.concatenate([turn_of(call)(0.0) for _ in range(min(3, rounds))])


def check(twin: Twin, scene: Triangles, size: tuple[int, int]) -> None:
    """Check that a twin draws the pixels of its kernel.

    Raises
    ------
    RuntimeError
        If they differ in a pixel.
    """
    import topleft as tl

    mine = twin.overdraw(twin.entry.orient(scene), size)
    theirs = tl.overdraw(*twin.entry.orient(scene), size, **twin.entry.options())
    if n := int((mine != theirs).sum()):
        raise RuntimeError(f"{twin.name} must draw what {twin.entry.method} draws, {n} pixels differ")
