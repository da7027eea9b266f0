"""For tests of programs that draw: a comparison of pictures that lists their differences, and hard scenes.

In: arrays that were drawn and arrays that were expected.  Out: nothing, or an `AssertionError` in plain words, and a
picture of the difference.  The library's golden hashes are of the same scenes; `topleft doctor` draws them with each
instruction set.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import coverage, fill, overdraw, rasterize, save_image
from topleft._core.base.arrays import as_array, as_number, as_path, shown
from topleft.annex.pictures import isa_available, isa_in_use, use_isa

__all__ = ["HARD_SCENES", "assert_same_picture", "check_instruction_sets", "hard_scenes", "words_of"]

SIZE = (61, 47)
"""Width and height of the pictures of `HARD_SCENES`."""

N_SEEDS = 5
N_SHOWN = 8

#: Triangles of random places: their extent in pixels and their number; the same of clip space.
PIXEL_SCENES = {
    "dust": (0.7, 900),
    "small": (3.0, 400),
    "middle": (12.0, 120),
    "large": (70.0, 40),
    "huge": (1e5, 20),
    "wide": (1e12, 12),
}
CLIP_SCENES = {"near": (0.5, 60), "cut": (2.0, 40), "behind": (8.0, 30)}

HARD_SCENES: Mapping[str, str] = MappingProxyType({
    "dust": "triangles smaller than a pixel",
    "small": "triangles of a few pixels",
    "middle": "triangles of some dozens of pixels",
    "large": "triangles as large as the picture",
    "huge": "triangles of a hundred thousand pixels: 64-bit arithmetic",
    "wide": "triangles of 1e12 pixels: 128-bit arithmetic",
    "near": "clip space, triangles cut by the near plane",
    "cut": "clip space, triangles cut by several planes",
    "behind": "clip space, triangles far behind and beside the eye",
    "lattice": "vertices on centres and sides of pixels: ties on every edge",
    "shared": "few float32 vertices that many triangles share",
    "slivers": "triangles of a hundredth of a pixel in width",
})  # fmt: skip
"""The kinds of `hard_scenes`, and the difficulty of each."""

# The hashes of `check_instruction_sets`, made by the scalar kernels.
GOLDEN = (
    "coverage:8187e6065fe4 overdraw:694d07a349da area:abca57dd0e79 triangle:b1b5f2a561ac "
    "depth:a1b2b9397d0e fill:07f31beef2d5 blend:671433bd5e53"
)


def assert_same_picture(
    got: ArrayLike, expected: ArrayLike, *, tolerance: float = 0, path: str | os.PathLike[str] | None = None
) -> None:
    """Raise an error with the places of the differences, if two pictures differ.

    Parameters
    ----------
    got, expected : array_like, shape (H, W) or (H, W, C)
        Numbers or truth values of one dtype. NaN is equal to NaN.
    tolerance : float, optional
        The largest allowed difference of a channel. 0: none.
    path : str or path-like, optional
        File for a picture of the differences, if there are any: black where pixels are equal, brighter the more they
        differ, the largest difference white.

    Raises
    ------
    AssertionError
        With the number of pixels that differ, the largest difference, and the first of them with both values.

    Examples
    --------
    >>> import numpy as np
    >>> from topleft.testing import assert_same_picture
    >>> assert_same_picture(np.eye(3), np.eye(3))
    >>> assert_same_picture(np.eye(3), np.ones((3, 3)))
    Traceback (most recent call last):
    AssertionError: 6 of 9 pixels differ, by 1 at most
      row 0, column 1: got 0.0, expected 1.0
      row 0, column 2: got 0.0, expected 1.0
      row 1, column 0: got 0.0, expected 1.0
      row 1, column 2: got 0.0, expected 1.0
      row 2, column 0: got 0.0, expected 1.0
      row 2, column 1: got 0.0, expected 1.0
    """
    __tracebackhide__ = True  # pytest shows the line of the caller
    one, other, most = as_array("got", got), as_array("expected", expected), as_number("tolerance", tolerance)
    where = None if path is None else as_path("path", path)
    for name, array in (("got", one), ("expected", other)):
        if array.dtype.kind not in "bfiu":
            raise TypeError(f"{name} must be real numbers or truth values, got {shown(array)} of {array.dtype}")
    if one.shape != other.shape:
        raise AssertionError(f"the picture has shape {one.shape}, expected {other.shape}")
    if one.dtype != other.dtype:
        raise AssertionError(f"the picture has dtype {one.dtype}, expected {other.dtype}")
    if one.ndim not in (2, 3):
        raise AssertionError(f"a picture has shape (H, W) or (H, W, C), got {one.shape}")
    off = _differences(one, other)
    by_pixel = off if off.ndim == 2 else off.max(2, initial=0.0)
    wrong = by_pixel > most
    if not wrong.any():
        return
    lines = [f"{wrong.sum()} of {wrong.size} pixels differ, by {by_pixel.max():g} at most"]
    for row, column in np.argwhere(wrong)[:N_SHOWN]:
        lines.append(f"  row {row}, column {column}: got {one[row, column]}, expected {other[row, column]}")
    if wrong.sum() > N_SHOWN:
        rows, columns = np.nonzero(wrong)
        box = f"rows {rows.min()} to {rows.max()}, columns {columns.min()} to {columns.max()}"
        lines.append(f"  and {wrong.sum() - N_SHOWN} more, in {box}")
    if where is not None:
        finite = by_pixel[np.isfinite(by_pixel)].max(initial=0.0)
        share = np.where(np.isfinite(by_pixel), by_pixel / (finite or 1), 1)
        save_image(where, np.where(wrong, np.ceil(55 + 200 * share), 0).astype(np.uint8))
        lines.append(f"  the difference is drawn in {where}")
    raise AssertionError("\n".join(lines))


def hard_scenes(kind: str) -> Iterator[tuple[NDArray[Any], NDArray[np.int64]]]:
    """Yield the five scenes of a kind, the same ones on every machine.

    Parameters
    ----------
    kind : str
        One of `HARD_SCENES`.

    Yields
    ------
    vertices : ndarray, shape (V, 3) or (V, 4)
        Pixels and depth, or clip space ("near", "cut", "behind"), for pictures of 61 x 47 pixels.
    triangles : ndarray of int64, shape (T, 3)

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if not (isinstance(kind, str) and kind in HARD_SCENES):
        raise ValueError(f"kind must be one of {', '.join(HARD_SCENES)}, got {kind!r}")
    for seed in range(N_SEEDS):
        rng = np.random.default_rng([len(kind), ord(kind[0]), seed])
        if kind in PIXEL_SCENES:
            extent, n = PIXEL_SCENES[kind]
            corners = rng.random((n, 1, 3)) * [*SIZE, 1] + (rng.random((n, 3, 3)) - 0.5) * [extent, extent, 1]
            yield corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)
        elif kind in CLIP_SCENES:
            extent, n = CLIP_SCENES[kind]
            corners = (rng.random((3 * n, 4)) - [0.5, 0.5, 0.5, 0.3]) * [2 * extent, 2 * extent, 2, 1]
            yield corners, np.arange(3 * n).reshape(-1, 3)
        elif kind == "lattice":
            vertices = rng.integers(-4, 2 * np.array([*SIZE, 2]), (200, 3)) / 2
            yield vertices, rng.integers(0, 200, (150, 3))
        elif kind == "shared":
            yield rng.random((40, 3)).astype(np.float32) * np.float32(60), rng.integers(0, 40, (200, 3))
        else:
            ends = rng.random((80, 2, 3)) * [*SIZE, 1]
            corners = np.concatenate([ends, ends[:, :1] + [0.01, 0.02, 0]], axis=1)
            yield corners.reshape(-1, 3), np.arange(240).reshape(-1, 3)


def check_instruction_sets() -> dict[str, str]:
    """Draw `hard_scenes` with each instruction set of this machine; return the verdicts.

    Returns
    -------
    dict
        By instruction set "right", or the buffers that differ from the hashes in this file.
        Takes about a second. Not for several threads at a time: the instruction set in use changes meanwhile.
    """
    before, found = isa_in_use(), {}
    golden = dict(pair.split(":") for pair in GOLDEN.split())
    try:
        for name in isa_available():
            use_isa(name)
            made = {n: _hash_of_all(n) for n in (1, 2)}
            wrong = sorted({key for hashes in made.values() for key in golden if hashes[key] != golden[key]})
            found[name] = f"wrong: {', '.join(wrong)}" if wrong else "right"
    finally:
        use_isa(before)
    return found


def words_of(buffer: NDArray[Any]) -> bytes:
    """Return dtype, shape and contents of an array to be hashed; all NaN alike, as their bits depend on the CPU."""
    buffer = as_array("buffer", buffer)
    if buffer.dtype.hasobject:
        raise TypeError(f"buffer must hold numbers, got {shown(buffer)} of {buffer.dtype}")
    if buffer.dtype.kind == "f":
        buffer = np.where(np.isnan(buffer), buffer.dtype.type(np.nan), buffer)
    return f"{buffer.dtype.str} {buffer.shape} ".encode() + np.ascontiguousarray(buffer).tobytes()


def _hash_of_all(threads: int) -> dict[str, str]:
    sums = {name: hashlib.sha256() for name in ("coverage", "overdraw", "area", "triangle", "depth", "fill", "blend")}
    for kind in HARD_SCENES:
        for vertices, triangles in hard_scenes(kind):
            colors = (np.arange(4 * len(triangles)) * 37 % 256).astype(np.uint8).reshape(-1, 4)
            frags = rasterize(vertices, triangles, SIZE, threads=threads)
            made = {
                "coverage": coverage(vertices, triangles, SIZE, threads=threads),
                "overdraw": overdraw(vertices, triangles, SIZE, threads=threads),
                "area": coverage(vertices, triangles, SIZE, sampling="area", threads=threads),
                "triangle": frags.triangle,
                "depth": frags.depth,
                "fill": fill(vertices, triangles, colors, SIZE, per="triangle", sampling="msaa4", threads=threads),
                "blend": fill(vertices, triangles, colors, SIZE, per="triangle", blend="over", threads=threads),
            }
            for name, buffer in made.items():
                sums[name].update(words_of(buffer))
    return {name: each.hexdigest()[:12] for name, each in sums.items()}


def _differences(one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.float64]:
    """Return the difference of each number, inf where it is not a number."""
    same = one == other
    if one.dtype.kind == "f":
        same |= np.isnan(one) & np.isnan(other)
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(one.astype(np.float64) - other.astype(np.float64))
    # Integers beyond float64's exactness differ though their difference is 0.
    return np.where(same, 0.0, np.where(np.isnan(off), np.inf, np.maximum(off, np.finfo(np.float64).tiny)))
