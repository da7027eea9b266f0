"""Pictures of attributes with smooth silhouettes in one, and backward: `points`, `values` and `smooth` of `tensors.py`.

float32 takes a few rows at a time. The picture leaves what it has seen, so that backward need not look again.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import empty
from topleft._core.gradients.bands import Array, Band, Room, Sums
from topleft._core.gradients.tensors import (
    EdgeRule,
    Outline,
    PixelGrid,
    of,
    outline_of,
    points,
    points_vjp,
    scratch_of,
    smooth,
    smooth_vjp,
    values,
    values_vjp,
)


class Seen(NamedTuple):
    """What a band shows, as ``tl_grad_picture`` has it: runs of pixels, `faces` (FACE_ROWS, N), pairs."""

    row_runs: NDArray[np.int64]
    row_pairs: NDArray[np.int64]
    begins: NDArray[np.int32]
    run_faces: NDArray[np.int32]
    faces: NDArray[np.int32]
    pairs: NDArray[np.uint8]
    steps: NDArray[np.float32]

    @staticmethod
    def room(
        n_rows: int, n_runs: int, n_faces: int, n_pairs: int, n_columns: int
    ) -> tuple[tuple[tuple[int, ...], type], ...]:
        """Return shapes and dtypes of the arrays of a band."""
        return (
            ((n_rows + 1,), np.int64),
            ((n_rows + 1,), np.int64),
            ((n_runs,), np.int32),
            ((n_runs,), np.int32),
            ((engine.FACE_ROWS, n_faces + engine.IDS_ROOM), np.int32),
            ((n_pairs, engine.PAIR_BYTES), np.uint8),
            ((n_pairs, n_columns), np.float32),
        )

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """The numbers of rows, runs, faces and pairs of a copy."""
        return len(self.row_runs) - 1, len(self.begins), self.faces.shape[1] - engine.IDS_ROOM, len(self.pairs)

    def copy(self, n_rows: int, n_faces: int) -> Seen:
        """Return what was written, of so many rows and faces."""
        n_runs, n_pairs = int(self.row_runs[n_rows]), int(self.row_pairs[n_rows])
        return Seen(
            self.row_runs[: n_rows + 1].copy(),
            self.row_pairs[: n_rows + 1].copy(),
            self.begins[:n_runs].copy(),
            self.run_faces[:n_runs].copy(),
            self.faces[:, : n_faces + engine.IDS_ROOM].copy(),
            self.pairs[:n_pairs].copy(),
            self.steps[:n_pairs].copy(),
        )


#: Added to checksums: words of another process are not taken for what this process packed.
CHECK = secrets.randbits(63)


@dataclass(frozen=True)
class AttributePictures:
    """Pictures of attributes with smooth silhouettes.

    `ids` (B, H, W): row 0 is on top. `pos` (B or 1, V, 4), `attr` (B or 1, V, K). `across` (T, 3) is that of
    `halves_across`.
    """

    grid: PixelGrid
    rule: EdgeRule
    across: NDArray[np.int32]
    pos: Array
    ids: NDArray[np.int32]
    attr: Array

    @cached_property
    def outline(self) -> Outline:
        """The silhouette edges; backward of what the picture has seen needs none."""
        return outline_of(self.grid, self.pos, self.across)

    @property
    def is_in_rows(self) -> bool:
        """Whether a few rows are taken at a time; lanes count in int32."""
        return self.pos.dtype == np.float32 and self.attr.shape[1] * self.attr.shape[2] <= INT32_MAX

    def parts(self) -> tuple[Array, Array]:
        """Return `rast` and the colours."""
        rast, _ = points(self.grid, self.pos, [(one, 0) for one in self.ids], is_flipped=True, with_db=False)
        return rast, values(self.grid, self.attr, rast)[0]

    def picture(self) -> tuple[Array, list[Seen]]:
        """Return the pictures (B, H, W, K); and of each band what it shows, for `vjp`."""
        if not self.is_in_rows:
            return smooth(self.grid, self.rule, self.outline, self.pos, *self.parts()), []
        out = empty(self.grid.shape(self.attr.shape[2]), np.float32)
        found = self.run((), lambda i: (out[i], None, None))
        return out, [seen for _, seen in found]

    def check_of(self, words: NDArray[np.int64]) -> int:
        """Return the checksum of what these pictures show, packed."""
        sizes = hash((CHECK, self.ids.shape, self.pos.shape, self.attr.shape, self.grid.tri.shape))
        return (int(words.sum()) + sizes) % (1 << 63)

    def pack(self, seen: list[Seen]) -> NDArray[np.int64]:
        """Return what bands show as words for `unpack`: a checksum; of each band its counts and its arrays."""
        parts: list[Array] = [part for one in seen if self.attr.shape[2] for part in (np.array(one.counts), *one)]
        padded = (piece for part in parts for piece in (part.data, bytes(-part.nbytes % 8)))
        words = np.frombuffer(bytearray(8) + b"".join(padded), np.int64)
        words[0] = self.check_of(words[1:])
        return words

    def unpack(self, words: NDArray[np.int64]) -> list[Seen] | None:
        """Return what `pack` was given; None where there is nothing, or the words were changed."""
        words = words.copy()  # another thread may write to saved tensors
        if len(words) < 2 or words[0] != self.check_of(words[1:]):
            return None
        at = 8

        def take(shape: tuple[int, ...], dtype: type) -> Array:
            nonlocal at
            array: Array = np.frombuffer(words, dtype, math.prod(shape), at).reshape(shape)
            at += array.nbytes + -array.nbytes % 8
            return array

        seen = []
        for _ in self.grid.bands.all:
            n_rows, n_runs, n_faces, n_pairs = take((4,), np.int64).tolist()
            room = Seen.room(n_rows, n_runs, n_faces, n_pairs, self.attr.shape[2])
            seen.append(Seen(*(take(*one) for one in room)))
        return seen

    def vjp(self, g_out: Array, seen: list[Seen] | None = None) -> tuple[Array, Array]:
        """Return the gradients of `pos` and `attr`; without `seen`, which `picture` returned, it draws again."""
        if not self.is_in_rows:
            rast, color = self.parts()
            g_color, of_edges = smooth_vjp(self.grid, self.rule, self.outline, self.pos, rast, color, g_out)
            g_attr, g_rast, _ = values_vjp(self.grid, self.attr, rast, g_color)
            return points_vjp(self.grid, self.pos, rast, g_rast, None) + of_edges, g_attr
        g_pos, g_attr = (np.zeros(one.shape, one.dtype) for one in (self.pos, self.attr))
        self.run((g_pos, g_attr), lambda i: (None, g_out[i], None), self.picture()[1] if seen is None else seen)
        return g_pos, g_attr

    def squares(self, target: Array) -> tuple[float, Array, Array]:
        """Return the mean squared difference from other pictures, and the gradients of `pos` and `attr`."""
        n = max(1, target.size)
        if not self.is_in_rows:
            step = self.picture()[0] - target
            return float(np.square(step).sum()) / n, *self.vjp(step * (2 / n))
        g_pos, g_attr = (np.zeros(one.shape, one.dtype) for one in (self.pos, self.attr))
        found = self.run((g_pos, g_attr), lambda i: (None, None, target[i]), weight=2 / n)
        return sum(one for one, _ in found) / n, g_pos, g_attr

    def run(
        self,
        outs: tuple[Array, ...],
        pixels: Callable[[int], tuple[Array | None, Array | None, Array | None]],
        seen: list[Seen] | None = None,
        weight: float = 0.0,
    ) -> list[tuple[float, Seen]]:
        """Call the engine for each band, and add the sums to `outs`; returns what it does, and what bands show.

        `seen` where `pixels` are gradients; it is kept where they are a picture.
        """
        n, views = self.attr.shape[2], self.grid.views(self.pos)
        outline = None if seen else self.outline
        n_rows = max(self.pos.shape[1], self.attr.shape[1])
        room = room_of(n, n_rows, len(self.grid.tri), self.grid.width, self.grid.bands.n_px, is_given=seen is not None)

        def work(band: Band, made: list[Any]) -> tuple[float, Seen]:
            i, (vertices, faces, *scratch) = band.picture, made
            shown = seen[band.number] if seen else Seen(*scratch[4:])
            mesh = outline.of_picture(i) if outline else (None,) * 3
            of_pixels = pixels(i)
            found, n_faces = views[i].picture(
                self.ids[i], of(self.attr, i), mesh, (int(self.rule), weight), of_pixels, shown,
                shown.counts[2] if seen else 0, scratch[:4], (faces, vertices), band.first, band.end,
            )  # fmt: skip
            if of_pixels[0] is None or not n:
                return found, shown
            return found, shown.copy(min(band.end + 1, self.grid.height) - max(band.first - 1, 0), n_faces)

        return self.grid.bands.add_up(room, work, [outs] if outs else [])


@lru_cache(64)
def room_of(n: int, n_rows: int, n_triangles: int, width: int, n_px: int, *, is_given: bool) -> Room:
    """Return what a band of n attributes works on; with what it shows, unless that is given.

    The kernels add four columns to a row, of which three are attributes.
    """
    n_px += 4 * width
    n_threes = -(-n // 3)
    sums = (
        Sums(n_rows, 4 + 3 * n_threes + 1, 9),
        Sums(n_triangles, engine.HEAD_OF_FACE + engine.SUMS_OF_FACE * n_threes, 1),
    )
    scratch = (
        scratch_of(width),
        ((engine.ROWS_KEPT * width * n + engine.IDS_ROOM,), np.float32),
        ((16 * width * n,), np.float64),
        ((4 * width,), np.float32),
    )
    if is_given:
        return Room(n_px, sums, scratch)
    shown = Seen.room(n_px // max(1, width), n_px + engine.IDS_ROOM, min(n_triangles, n_px), 2 * n_px, n)
    return Room(n_px, sums, scratch + shown)
