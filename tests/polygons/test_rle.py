"""`to_rle`: counts down the columns, as pycocotools writes and reads them."""

from itertools import groupby

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on

import topleft as tl
from topleft._core.raster.rle import RunTable

SIZES = [(1, 1), (2, 3), (33, 65), (64, 64), (63, 128), (100, 1), (1, 100), (129, 200)]
SHARES = [0.0, 0.02, 0.5, 1.0]


def counts_of(mask):
    """Counts of a mask (H, W), pixel by pixel."""
    runs = [(inside, len(list(run))) for inside, run in groupby(mask.T.ravel().tolist())]
    return [0] * (not runs or runs[0][0]) + [n for _, n in runs]


def read_counts(text):
    """Counts of a text, a bit at a time."""
    counts, bits = [], ""
    for character in text:
        group = f"{ord(character) - 48:06b}"
        bits = group[1:] + bits
        if group[0] == "0":
            step = int(bits, 2) - (1 << len(bits)) * (bits[0] == "1")
            counts.append(step + (counts[-2] if len(counts) > 2 else 0))
            bits = ""
    return counts


def masks_of(size, n=3):
    rng = np.random.default_rng(sum(size))
    return np.concatenate([rng.random((n, *size)) < share for share in SHARES])


@ON_EACH_ISA
@pytest.mark.parametrize("size", SIZES)
def test_masks_of_every_size_have_the_counts_of_their_pixels(isa, size):
    masks = masks_of(size)
    with on(isa):
        found = tl.to_rle(masks, compressed=False)
    assert found == [{"size": list(size), "counts": counts_of(mask)} for mask in masks]


@ON_EACH_ISA
@pytest.mark.parametrize("size", SIZES)
def test_ids_have_the_counts_of_the_mask_of_each_label(isa, size):
    ids = np.random.default_rng(1).integers(-1, 4, size).astype(np.int32)
    labels = [3, -1, 9, 0]
    with on(isa):
        assert tl.to_rle(ids, labels=labels) == [tl.to_rle(ids == label) for label in labels]


@pytest.mark.parametrize("size", SIZES)
def test_text_is_that_of_pycocotools_which_decodes_and_measures_it(size):
    coco = pytest.importorskip("pycocotools.mask")
    masks = masks_of(size)
    found = tl.to_rle(masks)
    theirs = coco.encode(np.asfortranarray(masks.transpose(1, 2, 0).astype(np.uint8)))
    assert [one["counts"].encode() for one in found] == [one["counts"] for one in theirs]
    assert (coco.decode(found).transpose(2, 0, 1) == masks).all()
    assert coco.area(found).tolist() == masks.sum(axis=(1, 2)).tolist()
    assert (coco.iou(found, found, [0] * len(found)) == coco.iou(theirs, theirs, [0] * len(found))).all()


def test_counts_in_a_list_are_what_pycocotools_reads():
    coco = pytest.importorskip("pycocotools.mask")
    (mask,) = masks_of((40, 30))[6:7]
    assert (coco.decode(coco.frPyObjects(tl.to_rle(mask, compressed=False), 40, 30)) == mask).all()


def test_counts_of_a_frame_that_int32_does_not_hold_are_right():
    table = RunTable((70_000, 70_000))
    table.add(np.ones((1, 2, 1), np.uint8), at=(65_000, 5))
    (found,) = table.encode(np.zeros(1, np.int32), 1, compressed=False)
    assert found["counts"] == [65_000 * 70_000 + 5, 2, 5_000 * 70_000 - 7]
    assert read_counts(table.encode(np.zeros(1, np.int32), 1, compressed=True)[0]["counts"]) == found["counts"]


@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
def test_polygons_have_the_counts_of_their_masks_alone(rule):
    rng = np.random.default_rng(2)
    polygons = [[rng.uniform(-20, 120, (n, 2)), rng.uniform(0, 60, (4, 2))] for n in range(3, 40)]
    expected = [tl.to_rle(tl.polygons([rings], (100, 70), rule=rule)) for rings in polygons]
    assert tl.to_rle(polygons, (100, 70), rule=rule) == expected


def test_polygons_outside_the_picture_are_empty():
    outside = [(200, 0), (220, 0), (220, 9)]
    assert tl.to_rle([[outside]], (8, 4), compressed=False) == [{"size": [4, 8], "counts": [32]}]


def test_empty_pictures_have_one_count_as_in_pycocotools():
    assert tl.to_rle(np.zeros((0, 5), bool)) == {"size": [0, 5], "counts": "0"}
    assert tl.to_rle(np.zeros((0, 4, 5), bool)) == []
    assert tl.to_rle(np.zeros((4, 5), np.int32), labels=[]) == []


def test_a_table_that_is_too_small_is_made_again():
    chess = np.indices((4, 300, 70)).sum(axis=0) % 2 == 0  # 150 runs a column
    assert tl.to_rle(chess, compressed=False)[2]["counts"] == counts_of(chess[2])


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint32, np.int64])
def test_ids_of_other_integers_are_the_same(dtype):
    ids = np.random.default_rng(3).integers(0, 5, (20, 30))
    assert tl.to_rle(ids.astype(dtype), labels=[1, 4]) == [tl.to_rle(ids == 1), tl.to_rle(ids == 4)]


def test_masks_of_bytes_and_strided_masks_are_the_same():
    mask = masks_of((33, 65))[6]
    assert tl.to_rle(mask.astype(np.uint8)) == tl.to_rle(np.asfortranarray(mask)) == tl.to_rle(mask)
    assert tl.to_rle(mask[::2, ::-3]) == tl.to_rle(mask[::2, ::-3].copy())


@pytest.mark.parametrize(
    ("pixels", "options", "error", "message"),
    [
        (np.zeros(3, bool), {}, ValueError, r"masks must have shape \(H, W\) or \(N, H, W\), got \(3,\)"),
        (np.full((2, 2), 7, np.uint8), {}, ValueError, "masks of uint8 must hold 0 and 1, got 7; labels="),
        (np.zeros((2, 2)), {}, TypeError, "masks must be bool, got dtype float64"),
        (np.zeros((2, 2)), {"labels": [0]}, TypeError, "ids must be integers, got dtype float64"),
        (np.zeros((2, 2, 2), int), {"labels": [0]}, ValueError, r"ids must have shape \(H, W\), got \(2, 2, 2\)"),
        (np.full((2, 2), 2**31), {"labels": [0]}, ValueError, "ids must lie within int32, got 2147483648 to"),
        (np.zeros((2, 2), int), {"labels": [1, 2, 1]}, ValueError, r"labels must be different, got \[1, 2, 1\]"),
        (np.zeros((2, 2), int), {"labels": [0.5]}, TypeError, "labels must be integers, got dtype float64"),
        (np.zeros((2, 2), int), {"labels": 3}, ValueError, r"labels must have shape \(N,\), got \(\)"),
        ([[(0, 0), (1, 0), (0, 1)]], {"size": (2, 2), "labels": [0]}, ValueError, "labels are of ids, and size is of"),
        ([[(0, 0), (1, 0), (0, 1)]], {"size": (2, 2), "rule": "odd"}, ValueError, "rule must be"),
    ],
)
def test_wrong_pixels_are_refused(pixels, options, error, message):
    with pytest.raises(error, match=message):
        tl.to_rle(pixels, **options)
