"""`to_rle`: run lengths of masks, ids and polygons, in the format of COCO.

Input: masks, ids, or rings and a size. Output: a dict for each object, which `pycocotools` reads.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import as_array
from topleft._core.base.memory import SCRATCH
from topleft._core.base.options import parse
from topleft._core.polygons.draw import draw_mask
from topleft._core.polygons.polygons import frame_of, polygons
from topleft._core.polygons.prepared import prepare
from topleft._core.polygons.rings import as_rings
from topleft._core.raster.rle import RunTable, encode_ids, encode_masks
from topleft.typing import RuleOption


def to_rle(
    pixels: Any,
    size: int | tuple[int, int] | None = None,
    *,
    labels: npt.ArrayLike | None = None,
    rule: RuleOption = "evenodd",
    subpixel_bits: int = 8,
    compressed: bool = True,
) -> Any:
    """Return the run lengths of masks, of the objects of an id map, or of polygons, in the format of COCO.

    Parameters
    ----------
    pixels : array_like (H, W) or (N, H, W), bool or 0 and 1 of uint8; (H, W) of integers; or polygons
        A mask, or several; ids, with `labels`; polygons as `polygons` takes them, with `size`.
    size : (int, int), optional
        Width and height of the picture in pixels that polygons are in.
    labels : array_like (N,) of int, optional
        The ids to encode: ``range(len(scene))`` of an instance map. The mask of an id that no pixel has is empty.
    rule, subpixel_bits
        Of polygons, as for `polygons`.
    compressed : bool
        Counts as text, which `pycocotools` and `json` take as it is; otherwise as a list of int.

    Returns
    -------
    dict, or list of dict
        `size`, [H, W], and `counts`: how many pixels are outside, then inside, then outside and so on, down the columns
        from left to right. A dict for a mask (H, W); otherwise a list of a dict for each mask, label or polygon.

    Raises
    ------
    ValueError
        For a wrong shape, bytes other than 0 and 1, ids beyond int32, labels that are not different, both `size` and
        `labels`, and as `polygons` does.
    TypeError
        For other dtypes.

    Notes
    -----
    `counts` equals the text of ``pycocotools.mask.encode`` of the mask, byte for byte. Polygons are drawn under the
    rule of `polygons`; `pycocotools` draws polygons by another rule, and its masks differ along the border.

    References
    ----------
    T.-Y. Lin and others, Microsoft COCO: Common Objects in Context, 2014; the format as in the C code of its tools.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> mask = np.array([[0, 1, 1], [0, 0, 1]], bool)
    >>> tl.to_rle(mask, compressed=False)  # down the columns: 2 outside, 1 inside, 1 outside, 2 inside
    {'size': [2, 3], 'counts': [2, 1, 1, 2]}
    >>> tl.to_rle(mask)
    {'size': [2, 3], 'counts': '2111'}
    >>> ids = np.array([[-1, 4, 4], [-1, 7, 4]])
    >>> [rle["counts"] for rle in tl.to_rle(ids, labels=[7, 4], compressed=False)]
    [[3, 1, 2], [2, 1, 1, 2]]
    >>> tl.to_rle([[(0, 0), (2, 0), (2, 2), (0, 2)]], (3, 2), compressed=False)
    [{'size': [2, 3], 'counts': [0, 4, 2]}]
    """
    if size is not None:
        if labels is not None:
            raise ValueError("labels are of ids, and size is of polygons: give one of them")
        return encode_polygons(pixels, size, rule, subpixel_bits, compressed=compressed)
    array = as_array("pixels", pixels)
    if labels is not None:
        return encode_ids(array, labels, compressed=compressed)
    if array.ndim not in (2, 3):
        raise ValueError(f"masks must have shape (H, W) or (N, H, W), got {array.shape}; polygons need size=")
    if array.dtype == np.uint8:
        largest = int(array.max(initial=0))
        if largest > 1:
            raise ValueError(f"masks of uint8 must hold 0 and 1, got {largest}; labels= takes objects out of ids")
        array = array.view(np.bool_)
    if array.dtype != np.bool_:
        raise TypeError(f"masks must be bool, got dtype {array.dtype}; labels= takes objects out of ids")
    if array.ndim == 2:
        return encode_masks(array[None], compressed=compressed)[0]
    return encode_masks(array, compressed=compressed)


def encode_polygons(
    rings: Any,
    size: object,
    rule: RuleOption,
    subpixel_bits: object = 8,
    *,
    owners: npt.NDArray[np.int64] | None = None,
    compressed: bool = True,
) -> list[dict[str, Any]]:
    """Return the run lengths of the mask of each polygon, drawn only in its box.

    `owners`: the object of each polygon, ascending from 0 on; the mask of an object is the union of its polygons.
    """
    is_nonzero = parse(RuleOption, "rule", rule) == "nonzero"
    rings_px, frame = frame_of(as_rings(rings), size, (0, 0), subpixel_bits, 1, 1)  # type: ignore[arg-type]
    prepared = prepare(SCRATCH, rings_px, frame, is_nonzero=is_nonzero)
    table, boxes = RunTable(frame.size), prepared.compiled.boxes_px.tolist()
    mask: npt.NDArray[np.uint8] = SCRATCH.scratch("labels", frame.size[::-1], np.uint8)
    firsts = np.arange(len(rings_px)) if owners is None else np.flatnonzero(np.diff(owners, prepend=-1))
    for first, end in pairwise([*firsts.tolist(), len(rings_px)]):
        shown = [box for box in boxes[first:end] if box[0] < box[2] and box[1] < box[3]]
        if not shown:
            continue
        left, top = (min(box[k] for box in shown) for k in (0, 1))
        right, bottom = (max(box[k] for box in shown) for k in (2, 3))
        key = first if owners is None else int(owners[first])
        if end - first == 1:
            draw_mask(prepared, mask, polygon=first, rows=(top, bottom))
            table.add(mask[None], box=(left, top, right, bottom), key=key)
        else:  # parts may be thousands: the rectangles of a crowd
            window: dict[str, Any] = {"origin": (left, top), "subpixel_bits": frame.subpixel_bits, "threads": 1}
            union = polygons(rings_px.part(first, end), (right - left, bottom - top), rule=rule, **window)
            table.add(union.view(np.uint8)[None], at=(left, top), key=key)
    n = len(rings_px) if owners is None else int(owners[-1]) + 1 if len(owners) else 0
    return table.encode(table.keys.astype(np.int32), n, compressed=compressed)
