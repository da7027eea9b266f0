"""Counts the run lengths of masks and of ids, in the format of COCO.

In: pixels. Out: for each object the counts of pixels outside, inside, outside and so on, down the columns.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.array_types import I32, I64
from topleft._core.base.arrays import as_aligned, as_array, shown
from topleft._core.base.memory import empty

RUNS_A_COLUMN = 4
"""For which there is room before any has been seen; a table that is too small is made again, four times as large."""

NO_ID = 2**31
"""A background that no id has."""


class RunTable:
    """Runs of pictures in one frame: rows (start, end, key)."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._runs: I64 = empty((0, 3), np.int64)
        self._rows: I32 = empty((0,), np.int32)  # for a kernel
        self._n = 0

    @property
    def keys(self) -> I64:
        """The owner of each run: the number of its mask, or the id of its pixels."""
        return self._runs[: self._n, 2]

    def add(
        self,
        pixels: NDArray[Any],
        *,
        box: tuple[int, int, int, int] | None = None,
        at: tuple[int, int] = (0, 0),
        background: int = 0,
        key: int = 0,
    ) -> None:
        """Append the runs of pictures (N, H, W): of masks, bytes of 0 and 1, by their number from `key` on; of int32.

        `box`: left, top, right and bottom of the part to read; `at`: x and y of pixel (0, 0) in the frame.
        """
        n_pictures, height, width = pixels.shape
        corner = *at, self.size[1]
        look, done = (0, 0, width, height) if box is None else box, 0
        if len(self._rows) < engine.RLE_LINE * (look[3] - look[1]):
            self._rows = empty((engine.RLE_LINE * (look[3] - look[1]),), np.int32)
        how = pixels, look, corner, background, key
        while True:
            self._n, done = engine.list_runs(*how, done, self._rows, self._runs, self._n)
            if done == n_pictures:
                return
            n_least = RUNS_A_COLUMN * (look[2] - look[0]) * (n_pictures - done)
            grown = empty((max(4 * len(self._runs), self._n + n_least, 256), 3), np.int64)
            grown[: self._n] = self._runs[: self._n]
            self._runs = grown

    def encode(self, objects: I32, n: int, *, compressed: bool) -> list[dict[str, Any]]:
        """Return the run lengths of n objects; run i is of objects[i], of none where that is below 0."""
        width, height = self.size
        n_of = np.bincount(objects[objects >= 0], minlength=n)
        starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(2 * n_of + 1, dtype=np.int64)])
        n_counts, counts = np.empty(n, np.int64), empty((int(starts[-1]),), np.int64)
        engine.count_runs(self._runs[: self._n], objects, width * height, starts, n_counts, counts)
        if not compressed:
            ends = (starts[:-1] + n_counts).tolist()
            listed = [counts[first:end].tolist() for first, end in zip(starts.tolist(), ends, strict=False)]
            return [{"size": [height, width], "counts": one} for one in listed]
        n_characters = (width * height).bit_length() // 5 + 1  # of a count with its sign, five bits each
        text, text_starts = empty((len(counts) * n_characters + 1,), np.uint8), np.zeros(n + 1, np.int64)
        engine.write_counts(starts, n_counts, counts, text_starts, text)
        places = text_starts.tolist()
        whole = text[: places[-1]].tobytes().decode("ascii")
        return [{"size": [height, width], "counts": whole[i:j]} for i, j in pairwise(places)]


def encode_masks(masks: NDArray[Any], *, compressed: bool) -> list[dict[str, Any]]:
    """Return the run lengths of each of masks (N, H, W), bool."""
    n, height, width = masks.shape
    table = RunTable((width, height))
    table.add(np.ascontiguousarray(masks).view(np.uint8))
    return table.encode(table.keys.astype(np.int32), n, compressed=compressed)


def encode_ids(ids: NDArray[Any], labels: ArrayLike, *, compressed: bool) -> list[dict[str, Any]]:
    """Return the run lengths of the pixels of each label in ids (H, W)."""
    wanted = as_array("labels", labels)
    if wanted.dtype.kind not in "iu" and wanted.size:
        raise TypeError(f"labels must be integers, got dtype {wanted.dtype}")
    if wanted.ndim != 1:
        raise ValueError(f"labels must have shape (N,), got {wanted.shape}")
    if ids.dtype.kind not in "iu":
        raise TypeError(f"ids must be integers, got dtype {ids.dtype}")
    if ids.ndim != 2:
        raise ValueError(f"ids must have shape (H, W), got {ids.shape}")
    if ids.dtype.itemsize > 4 or ids.dtype == np.uint32:
        ends = (int(ids.min()), int(ids.max())) if ids.size else (0, 0)
        if not -NO_ID <= ends[0] <= ends[1] < NO_ID:
            raise ValueError(f"ids must lie within int32, got {ends[0]} to {ends[1]}")
    order = np.argsort(wanted, kind="stable")
    ascending = wanted[order].astype(np.int64)
    if (ascending[1:] == ascending[:-1]).any():
        raise ValueError(f"labels must be different, got {shown(wanted.tolist())}")
    height, width = ids.shape
    table = RunTable((width, height))
    background = next(value for value in (-1, 0, NO_ID) if value not in ascending)
    table.add(as_aligned(np.ascontiguousarray(ids, np.int32))[None], background=background)
    keys = table.keys
    objects = np.full(len(keys), -1, np.int32)
    if len(ascending):
        place = np.minimum(np.searchsorted(ascending, keys), len(ascending) - 1)
        objects = np.where(ascending[place] == keys, order[place], -1).astype(np.int32)
    return table.encode(objects, len(wanted), compressed=compressed)


def annotation_of(rle: dict[str, Any], own: int, image: int, category: int) -> dict[str, Any]:
    """Return the annotation of COCO of an object with run lengths."""
    return {"id": own, "image_id": image, "category_id": category, "iscrowd": 0} | annotation_members(rle)


def annotation_members(rle: dict[str, Any]) -> dict[str, Any]:
    """Return the members of an annotation that run lengths give: area, box (left, top, width, height), themselves."""
    height = rle["size"][0]
    ends = np.cumsum(
        read_counts(rle["counts"]) if isinstance(rle["counts"], str) else np.array(rle["counts"], np.int64)
    )
    first, last = ends[: len(ends) // 2 * 2 : 2], ends[1::2] - 1
    box = [0, 0, 0, 0]
    if len(last):
        left, right = int(first[0]) // height, int(last[-1]) // height
        top, bottom = int((first % height).min()), int((last % height).max())
        if (first // height < last // height).any():  # a run goes on in the next column
            top, bottom = 0, height - 1
        box = [left, top, right + 1 - left, bottom + 1 - top]
    area = int((last + 1 - first).sum())
    return {"area": area, "bbox": box, "segmentation": rle}


def read_counts(text: str) -> I64:
    """Return run lengths from a string, as `write_counts` of csrc/pixels/rle.c and pycocotools write them.

    A `ValueError` if it is no such text: with the first character that is none, or where it ends.
    """
    lengths: list[int] = []
    value = shift = 0
    for character in text:
        bits = ord(character) - 48
        if not 0 <= bits < 64 or shift > 40:
            raise ValueError(f"run lengths that are no text of COCO, at {character!r}")
        value |= (bits & 31) << shift
        shift += 5
        if not bits & 32:
            if bits & 16:
                value -= 1 << shift
            lengths.append(value + (lengths[-2] if len(lengths) > 2 else 0))
            value = shift = 0
    if shift:
        raise ValueError("run lengths that end within a number")
    return np.array(lengths, np.int64)
