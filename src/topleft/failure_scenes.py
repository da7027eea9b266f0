"""Small scenes on which methods fail: what a picture must hold, and what they draw instead.

Shrunk by `python -m benchmarks atlas --scenes` from the first failure of each method along the families of the atlas
(docs/atlas.md), and kept: `tests/test_failure_scenes.py` draws them all. The production methods are right on each.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

__all__ = ["FAILURE_SCENES", "FailureScene", "Got"]


@dataclass(frozen=True, slots=True)
class Got:
    """What a method draws of a scene.

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
    """Triangles, a window, the picture that it must hold, and those of the methods that fail.

    Attributes
    ----------
    name : str
    family, value : str
        Where in the atlas it comes from: the family of scenes, and the first value at which the methods fail.
    kind : str
        "gap" and "overdraw" (pixels drawn less or more often than they should be), or "wrong" (another triangle shows).
    points : tuple of (float, float)
        Vertices, pixels.
    triangles : tuple of (int, int, int)
    size, origin : (int, int)
        The window, as in `topleft.coverage`.
    subpixel_bits : int
        With so many the production methods draw what is expected; fewer may move a vertex.
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


_SCENES: tuple[FailureScene, ...] = (
    # begin: written by `python -m benchmarks atlas --scenes`
    FailureScene(
        "any-wrong", "any", "", "wrong",
        ((33.0, 19.0), (33.0, 21.0), (44.0, 25.998046875)),
        ((0, 2, 1),), (7, 7), (33, 19), 16,
        "0....../00...../.000.../...000./......0/......./.......",
        (
            Got("auto", 8, "0....../00...../.000.../...00../.....00/......./......."),
            Got("edge", 8, "0....../00...../.000.../...00../.....00/......./......."),
            Got("scanline", 8, "0....../00...../.000.../...00../.....00/......./......."),
            Got("auto", 0, "0....../00...../.000.../...00../.....00/......./......."),
            Got("point_in_triangle/top-left", 8, "......./00...../0000.../...000./......0/......./......."),
            Got("edge_increment", 8, "0....../00...../.000.../...00../.....00/......./......."),
            Got("edge_increment/integer", 8, "......./00...../0000.../...000./......0/......./......."),
            Got("zigzag", 8, "0....../00...../.000.../...00../.....00/......./......."),
        ),
    ),
    FailureScene(
        "any-overdraw", "any", "", "overdraw",
        ((20.5, 0.5), (25.5, 1.5), (14.5, 12.5), (20.5, 10.5)),
        ((0, 1, 2), (1, 3, 2)), (7, 7), (20, 0), 8,
        "0000000/1111100/1111100/1111000/1111000/1110000/1110000",
        (
            Got("point_in_triangle", 8, "1000000/1111120/1111200/1112000/1121000/1210000/2110000"),
            Got("bresenham_scanline", 8, "1110000/2222230/1111200/1112100/1121000/1211000/2110000"),
            Got("lerp_scanline", 8, "1000000/1111120/1111210/1112100/1121100/1211000/2111000"),
            Got("lerp_scanline/plus-one", 8, "1000000/2221120/1111220/1112200/1122100/1221000/2211000"),
            Got("row_crossing", 8, "1000000/1111120/1111200/1112100/1121000/1211000/2110000"),
            Got("row_crossing/zero-area-test", 8, "1000000/1111120/1111200/1112100/1121000/1211000/2110000"),
            Got("row_crossing/cull-back", 8, "1000000/1111120/1111200/1112100/1121000/1211000/2110000"),
            Got("row_crossing/cull-front", 8, "1000000/1111120/1111200/1112100/1121000/1211000/2110000"),
            Got("float_barycentric", 8, "1000000/1111120/1111200/1112000/1121000/1210000/2110000"),
            Got("float_barycentric/float64", 8, "1000000/1111120/1111200/1112000/1121000/1210000/2110000"),
        ),
    ),
    FailureScene(
        "any-wrong-2", "any", "", "wrong",
        ((33.0, 19.0), (34.19140625, 21.537109375), (44.890625, 25.99609375)),
        ((0, 2, 1),), (7, 7), (33, 19), 16,
        "0....../.00..../.000.../....00./......0/......./.......",
        (
            Got("edge_increment/bottom-right", 8, "0....../.00..../.000.../...000./......0/......./......."),
        ),
    ),
    FailureScene(
        "any-gap", "any", "", "gap",
        ((42.5, 4.5), (58.5, 4.5), (42.5, 9.5), (46.5, 12.5)),
        ((0, 1, 3), (0, 3, 2)), (7, 7), (42, 4), 8,
        "1111111/1111111/1111111/1111111/1111111/1111111/0011111",
        (
            Got("bresenham_scanline/top-left", 8, "1111111/0111111/1111111/1011111/1111111/1101111/0111111"),
        ),
    ),
    FailureScene(
        "any-overdraw-2", "any", "", "overdraw",
        ((28.5, 0.5), (34.5, 0.5), (21.5, 11.5), (28.5, 9.5)),
        ((0, 1, 2), (1, 3, 2)), (7, 7), (28, 0), 8,
        "1111110/1111110/1111100/1111000/1111000/1110000/1100000",
        (
            Got("bresenham_scanline/top-left", 8, "1111110/1111100/1111100/1121000/1110000/1110000/1100000"),
        ),
    ),
    FailureScene(
        "any-gap-2", "any", "", "gap",
        ((14.5, 25.5), (22.5, 23.5), (10.5, 29.5), (14.5, 33.5)),
        ((0, 1, 2), (1, 3, 2)), (7, 7), (14, 25), 8,
        "1111111/1111110/1111100/1111000/1111000/1110000/1100000",
        (
            Got("lerp_scanline/plus-one", 8, "1112211/1111111/1011110/1111100/2222200/1111000/1110000"),
        ),
    ),
    FailureScene(
        "far-1e8-gap", "far", "1e8", "gap",
        ((100000007.5, 100000001.5), (100000000.5, 100000001.5), (100000012.5, 100000009.5)),
        ((0, 2, 1),), (7, 7), (100000006, 100000001), 8,
        "1000000/1100000/1110000/1110000/1111000/0011100/0001100",
        (
            Got("row_crossing", 8, "1110000/0010000/0010000/0010000/0010000/0010000/0011111"),
            Got("row_crossing/zero-area-test", 8, "1110000/0010000/0010000/0010000/0010000/0010000/0011111"),
            Got("row_crossing/cull-back", 8, "1110000/1110000/1111111/0011111/0011111/0011111/0011111"),
            Got("row_crossing/cull-front", 8, "1110000/0010000/0010000/0010000/0010000/0010000/0011111"),
        ),
    ),
    FailureScene(
        "far-1e10-gap", "far", "1e10", "gap",
        ((9999999999.0, 9999999999.0), (10000000007.0, 9999999999.0), (9999999999.0, 10000000007.0)),
        ((0, 1, 2),), (7, 7), (9999999999, 9999999999), 8,
        "1111111/1111110/1111100/1111000/1110000/1100000/1000000",
        (
            Got("float_barycentric", 8, "0000000/0000000/0000000/0000000/0000000/0000000/0000000"),
        ),
    ),
    FailureScene(
        "far-1e6-overdraw", "far", "1e6", "overdraw",
        ((1000060.0, 999999.0), (1000066.0, 1000000.0), (1000055.875, 1000010.125), (1000060.0, 1000011.0)),
        ((0, 1, 2), (1, 3, 2)), (7, 7), (1000060, 999999), 8,
        "1110000/1111110/1111100/1111100/1111000/1111000/1110000",
        (
            Got("float_barycentric", 8, "1110000/1111120/1111200/1112100/1121000/1211000/2110000"),
        ),
    ),
    FailureScene(
        "far-1e14-overdraw", "far", "1e14", "overdraw",
        ((100000000000060.0, 99999999999999.0), (100000000000066.0, 100000000000000.0), (100000000000055.89,
        100000000000010.11), (100000000000060.0, 100000000000011.0)),
        ((0, 1, 2), (1, 3, 2)), (7, 7), (100000000000060, 99999999999999), 8,
        "1110000/1111110/1111100/1111100/1111000/1111000/1110000",
        (
            Got("float_barycentric/float64", 8, "1110000/1111120/1111200/1112100/1121000/1211000/2110000"),
        ),
    ),
    FailureScene(
        "large-1e8-gap", "large", "1e8", "gap",
        ((4.5, 2.5), (0.5, -67108863.5), (0.5, 67108864.5), (-67108863.5, 0.5)),
        ((0, 2, 3), (0, 3, 1)), (7, 7), (0, 0), 8,
        "1111000/1111000/1111000/1111000/1111000/1111000/1111000",
        (
            Got("lerp_scanline", 8, "1111100/1111100/1100000/1111100/1111100/1111100/1111100"),
        ),
    ),
    FailureScene(
        "large-1e8-gap-2", "large", "1e8", "gap",
        ((34.5, 24.5), (46.5, 0.5), (75497518.5, -92274687.5)),
        ((0, 1, 2),), (7, 7), (46, 0), 8,
        "1111111/1111111/1111110/1111110/1111100/1111000/1110000",
        (
            Got("row_crossing", 8, "1110000/1110000/1110000/1110000/1110000/1110000/1110000"),
            Got("row_crossing/zero-area-test", 8, "1110000/1110000/1110000/1110000/1110000/1110000/1110000"),
            Got("row_crossing/cull-front", 8, "1110000/1110000/1110000/1110000/1110000/1110000/1110000"),
        ),
    ),
    FailureScene(
        "large-1e8-gap-3", "large", "1e8", "gap",
        ((24.5, 26.5), (-67108863.5, -79691775.5), (0.5, -67108863.5)),
        ((0, 1, 2),), (7, 7), (0, 0), 8,
        "0001111/0001111/0000111/0000011/0000001/0000000/0000000",
        (
            Got("row_crossing/cull-back", 8, "0000000/0000000/0000000/0000000/0000000/0000000/0000000"),
        ),
    ),
    FailureScene(
        "large-1e6-gap", "large", "1e6", "gap",
        ((-4.8125, 5.20703125), (0.0, 0.0), (965504.0, -198122.671875), (0.0, 524288.0)),
        ((0, 1, 2), (0, 2, 3)), (7, 7), (0, 0), 8,
        "1111111/1111111/1111111/1111111/1111111/1111111/1111111",
        (
            Got("float_barycentric", 8, "1111111/1111111/1111111/1110111/1111111/1111111/1111111"),
        ),
    ),
    FailureScene(
        "large-1e5-overdraw", "large", "1e5", "overdraw",
        ((3.1875, 3.3125), (0.0, 0.0), (0.0, -16384.0), (94208.0, 55808.0), (0.0, 65536.0), (0.0, 65536.0), (0.0,
        0.0)),
        ((0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 5, 6)), (7, 7), (0, 0), 16,
        "1111111/1111111/1111111/1111111/1111111/1111111/1111111",
        (
            Got("float_barycentric", 8, "1111111/1111111/1111111/1112111/1111111/1111111/1111111"),
        ),
    ),
    FailureScene(
        "large-1e14-gap", "large", "1e14", "gap",
        ((17.609375, 24.4921875), (-58788007369152.0, -87489935311360.0), (0.0, -70368744177664.0),
        (-70368744177664.0, 0.0)),
        ((0, 1, 2), (0, 3, 1)), (7, 7), (0, 0), 8,
        "1111111/1111111/1111111/1111111/1111111/1111111/1111111",
        (
            Got("float_barycentric/float64", 8, "1111111/1111111/1111111/1110111/1111111/1111111/1111111"),
        ),
    ),
    FailureScene(
        "large-1e14-overdraw", "large", "1e14", "overdraw",
        ((3.1875, 3.25), (0.0, 70368744177664.0), (-95657511616512.0, 70918499991552.0), (0.0, 0.0)),
        ((0, 1, 2), (0, 2, 3)), (7, 7), (0, 0), 8,
        "0000000/1000000/1100000/1110000/1110000/1110000/1110000",
        (
            Got("float_barycentric/float64", 8, "0000000/1000000/1100000/1110000/1210000/1110000/1110000"),
        ),
    ),
    FailureScene(
        "sliver-2^-14-wrong", "sliver", "2^-14", "wrong",
        ((505.966064453125, 536.7074127197266), (488.0, 528.0), (529.294677734375, 413.27734375), (488.0, 528.0),
        (529.294677734375, 413.27734375), (354.78369140625, 482.2857666015625)),
        ((5, 1, 0), (2, 4, 3)), (7, 7), (488, 528), 16,
        "0....../000..../.0000../...0000/......0/......./.......",
        (
            Got("float_barycentric", 8, "0....../000..../.0000../....000/......0/......./......."),
        ),
    ),
    FailureScene(
        "fan-128-gap", "fan", "128", "gap",
        ((512.5, 511.5), (660.5, 514.5), (712.5, 527.5), (532.5, 534.5)),
        ((0, 1, 2), (0, 2, 3)), (7, 7), (532, 510), 8,
        "0000000/0000000/1111111/1111111/1111111/1111111/1111111",
        (
            Got("lerp_scanline/plus-one", 8, "0000000/0000000/1111111/1111011/1111111/1111111/1111111"),
        ),
    ),
    FailureScene(
        "fan-512-wrong", "fan", "512", "wrong",
        ((34.0, 34.0), (-165.0, -165.0), (-128.0, 0.0)),
        ((0, 2, 1),), (7, 7), (0, 0), 0,
        "......./0....../00...../000..../0000.../00000../000000.",
        (
            Got("float_barycentric", 8, "0....../00...../000..../0000.../00000../000000./0000000"),
        ),
    ),
    FailureScene(
        "hub-48-px-gap", "hub", "48 px", "gap",
        ((470.5, 576.5), (534.5, 584.5), (598.5, 600.5), (534.5, 616.5)),
        ((0, 1, 2), (0, 2, 3)), (7, 7), (534, 584), 8,
        "0000000/1111000/1111111/1111111/1111111/1111111/1111111",
        (
            Got("lerp_scanline/plus-one", 8, "1000000/1111000/1111111/1111111/1111111/1110011/1111111"),
        ),
    ),
    FailureScene(
        "edge-2^-9-wrong", "edge", "2^-9", "wrong",
        ((0.0, 3.5), (128.0, 3.501953125), (0.0, 0.0)),
        ((1, 0, 2),), (7, 7), (0, 0), 16,
        "0000000/0000000/0000000/0000000/......./......./.......",
        (
            Got("auto", 8, "0000000/0000000/0000000/......./......./......./......."),
            Got("edge", 8, "0000000/0000000/0000000/......./......./......./......."),
            Got("scanline", 8, "0000000/0000000/0000000/......./......./......./......."),
            Got("edge_increment", 8, "0000000/0000000/0000000/......./......./......./......."),
            Got("zigzag", 8, "0000000/0000000/0000000/......./......./......./......."),
        ),
    ),
    FailureScene(
        "edge-2^-9-wrong-2", "edge", "2^-9", "wrong",
        ((3.498046875, 0.0), (3.498046875, 128.0), (0.0, 0.0)),
        ((1, 0, 2),), (7, 7), (0, 0), 16,
        "000..../000..../000..../000..../000..../000..../000....",
        (
            Got("edge_increment/bottom-right", 8, "0000.../0000.../0000.../0000.../0000.../0000.../0000..."),
        ),
    ),
    FailureScene(
        "edge-2^-16-overdraw", "edge", "2^-16", "overdraw",
        ((478.0, 513.5), (606.0, 513.5000152587891), (478.0, 510.0), (478.0, 638.0)),
        ((0, 1, 2), (1, 0, 3)), (7, 7), (478, 510), 16,
        "1111111/1111111/1111111/1111111/1111111/1111111/1111111",
        (
            Got("float_barycentric", 8, "1111111/1111111/1111111/2222222/1111111/1111111/1111111"),
        ),
    ),
    FailureScene(
        "edge-0-overdraw", "edge", "0", "overdraw",
        ((0.0, 3.5), (128.0, 3.5), (0.0, 0.0), (0.0, 128.0)),
        ((0, 1, 2), (1, 0, 3)), (7, 7), (0, 0), 8,
        "1111111/1111111/1111111/1111111/1111111/1111111/1111111",
        (
            Got("float_barycentric/float64", 8, "1111111/1111111/1111111/2222222/1111111/1111111/1111111"),
        ),
    ),
    # end
)

FAILURE_SCENES: Mapping[str, FailureScene] = MappingProxyType({scene.name: scene for scene in _SCENES})
"""By name."""
