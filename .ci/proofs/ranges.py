"""Ranges: bounds in integers."""

from __future__ import annotations

import ast
import itertools
import re
from fractions import Fraction

import z3
from proofs.logic import prove
from proofs.rounding import DOUBLE
from proofs.source import NotProvedError, Source, claim, need


@claim(
    "range",
    "edge-functions",
    "vertex/fixed.h",
    "at any point inside the bounding box of a triangle |E| <= width * height",
)
def edge_functions(source: Source) -> None:
    """In the box of a triangle |E| is at most width * height, so |2E| fits 64 and 128 bits."""
    # E has no square of a coordinate: it is linear in each, and its extremes over a box lie at corners of the box.
    for ax, ay, bx, by, px, py in itertools.product((0, 1), repeat=6):
        need(abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) <= 1, "E exceeds width * height")
    for macro, bits in (("TL_NARROW_LIMIT", 64), ("TL_WIDE_LIMIT", 128)):
        extent = 2 * (source.constant("vertex/fixed.h", macro) - 1)
        need(2 * extent**2 < 2 ** (bits - 1), f"2E of vertices below {macro} leaves {bits} bits")


@claim("range", "lanes", "raster/triangles_fixed.c", "doubled edge functions 2^29")
def lanes_fixed(source: Source) -> None:
    """Snapped triangles in 32-bit lanes: doubled coordinates fit 16 bits, 2E 29 bits, of squares 30."""
    box, unit = source.constant("raster/state.h", "TL_MAX_BOX_PX"), 2**8
    setup = source.text("raster/triangles_fixed.c") + source.text("raster/raster.c")
    need("TL_MAX_BOX_PX << (bits < 8 ? bits : 8)" in setup, "the largest extent is another")
    need("(TL_MAX_BOX_PX - 2) << (bits < 8 ? bits : 8)" in setup, "the largest extent of squares is another")
    need(box * unit < 2**14, "an extent exceeds 2^14 units")
    need(2 * box * unit < 2**15, "a doubled coordinate exceeds 16 bits")
    need(2 * (box * unit) ** 2 < 2**29, "2E exceeds 29 bits")
    # Corners of squares lie up to a pixel outside of the extent, where both products count.
    need(2 * 2 * (box - 2) * (box - 1) * unit**2 < 2**30, "2E of squares exceeds 30 bits")


@claim("range", "row-quotients", "raster/row_edges.h", "0.5 has at most 22 bits")
def row_quotients(source: Source) -> None:
    """What rows.c looks at is all that rows meet: |dy| below 62 px of 2^8, v + 1/2 exact in float32."""
    box = source.constant("raster/state.h", "TL_MAX_BOX_PX")
    need(box == 62, "proofs/rows.c looks at boxes of 62 px")
    need(2 * ((box * 2**8) ** 2 // 2**8) + 1 < 2**22, "v + 1/2 has more than 22 bits")
    # Squares: 60 px, and corners up to a pixel outside; their rows are among those of rows.c, or beyond 64 columns.
    need(2 * 2 * (box - 2) * (box - 1) * 2**16 // 2**9 < 2**22, "v of squares does not fit 22 bits and a half")


@claim("range", "large-rows", "raster/single_fixed.c", "Whether float64 row ends are exact")
def rows_float64(source: Source) -> None:
    """Rows of large snapped triangles in float64 are exact below the bound of `rows_fit`."""
    need("< 0x1p50" in source.text("raster/single_fixed.c"), "rows_fit has another bound")
    v = Fraction(2**50)  # |v| in units, at most |2E|; with the half it has 52 bits
    need(2 * v + 1 < 2**53, "v + 1/2 is not exact")
    # v + 1/2 over d is at least 1 / (2 d) from an integer, and its product with 1 / d rounds twice.
    need((v + 1) * ((1 + DOUBLE) ** 2 - 1) < Fraction(1, 2), "a quotient may pass an integer")


@claim("range", "crossings", "polygons/crossings.c", "the product with the rounded 1 / D errs by less than 2^-51 |q|")
def crossings(source: Source) -> None:
    """Crossings of narrow rings: the product with 1 / D gives the column of the exact quotient."""
    coordinate = source.constant("polygons/polygons.h", "TL_NARROW_POLYGON")
    # N is dy times the crossing less the sample, which lies between the ends of the edge less the sample; D = unit dy.
    height, across = 2 * coordinate, coordinate + source.finest()
    numerator = height * across + height * source.finest()
    need(2 * numerator < 2**53, "N + D - 1/2 is not exact")
    need(2 * numerator * ((1 + DOUBLE) ** 2 - 1) < 1, "a quotient may pass an integer")


@claim("range", "sums", "area/accumulate.c", "the overflow is detected")
def sums_of_cells(source: Source) -> None:
    """Areas: a cell or a sum that leaves its range sets the bits that are asked for before it can wrap."""
    clear = source.constant("topleft.h", "TL_CELL_CLEAR")
    margin = source.constant("area/accumulate.c", "TL_SUM_MARGIN")
    step = 2 ** source.constant("area/ramp.c", "TL_AREA_BITS") + 1
    need(clear + 2**30 == 2**31 and clear - 2**30 == 0, "cells in [-2^30, 2^30) are not the positive int32")
    need(2**31 + step <= 2**32 - step, "a cell may wrap before its sign is seen")
    good, cell = 3 * 2**30, 2**30  # sum + margin lies in [0, good); a cell moves it by less than `cell`
    need(good + cell <= 2**32, "a sum may wrap upwards to one that is in range")
    need(2**32 - cell >= good, "a sum may wrap downwards to one that is in range")
    need(0 < margin < 2**24, "the margin is a pixel or nothing")
    bits = z3.BitVec("bits", 32)
    alarm = bits & (bits + bits)
    prove(z3.ULT(bits, z3.BitVecVal(good, 32)) == (z3.Extract(31, 31, alarm) == 0), "sum_alarm tells another range")


@claim("range", "divisions", "blend/mix_u8.c", "the least distance from the middle between two integers")
def divisions(source: Source) -> None:
    """Quotients of integers below 2^24 in float32, and of sums below 2^39 in float64, round as the exact quotient."""
    name, whole, full = "blend/mix_u8.c", 2**15, 255
    source.says(name, "sums below 2^39", "below = vi_mul(byte_of(d, 24), vi_sub(full, alpha))")
    largest = full * full  # alpha 255 + alpha' (255 - alpha), the divisor of whole pixels
    need(full * largest < 2**24 and whole * full < 2**24, "a numerator does not fit float32")
    # Half a unit in the last place is u times the power of two that the number is at least.
    need(Fraction(128, 2**24) < Fraction(1, 2 * largest), "a quotient of at most 255 may pass a middle")
    need(Fraction(whole, 2**24) < Fraction(1, 2 * full), "a quotient by 255 may pass a middle")
    # Parts of pixels: a weight w, at most the coverage c <= 2^15, gives above = 255^2 w, below <= 255^2 (2^15 - w).
    source.says(name, "fine = vi_mul(weight, vi_set1(255))", "vi_sub(vi_set1(255 << 15), gone)")
    sums = largest * whole
    need(sums < 2**31 and full * sums < 2**39, "a sum leaves its range")
    need(Fraction(full, 2**53) < Fraction(1, 2 * sums), "a quotient of sums may pass a middle")
    need(Fraction(full, 2**53) < Fraction(1, 2 * full * whole), "an alpha may pass a middle")


@claim("range", "means", "pixels/resolve.c", "at most 16 * 255 * 65536 < 2^29")
def means(source: Source) -> None:
    """Sums of the samples of a pixel, weighted by alpha, of light in steps of 2^-16."""
    (most,) = source.numbers("src/topleft/_core/base/color.py", r"LINEAR_ONE = 1 << (\d+)")
    need(16 * 255 * 2 ** int(most) < 2**29, "the sum of a pixel's samples exceeds 2^29")


@claim("range", "lengths", "pixels/png.c", "The least length of each length symbol")
def lengths(source: Source) -> None:
    """The lengths of matches in PNG files: each from 3 to 258 has one symbol and its extra bits."""
    text = source.text("pixels/png.c")
    least, bits = ([int(n) for n in re.search(rf"{name}\[29\] = {{([^}}]*)}}", text)[1].split(",")]  # type: ignore[index]
                   for name in ("LENGTHS", "LENGTH_BITS"))  # fmt: skip
    ends = [a + 2**b for a, b in zip(least, bits, strict=True)]
    need(least[0] == 3 and least[-1] == 258 and bits[-1] == 0, "the first or the last length is another")
    need(ends[:-2] == least[1:-1] and ends[-2] == 258 + 1, "a length has no symbol, or two")


@claim("range", "lines", "lines/lines.c", "product of two of these is below 2^126")
def lines(source: Source) -> None:
    """Lines between any vertices: d fits 64 bits, products of two lengths 128."""
    most = source.constant("vertex/fixed.h", "TL_WIDE_LIMIT")
    need(2 * most - 1 < 2**63 and (2 * most) ** 2 <= 2**126 and 2 * (2 * most) <= 2**64, "a line exceeds its integers")


@claim("range", "squares", "raster/walk.h", "no farther than a pixel outside the extent: |E| < 2^63 or 2^127")
def squares(source: Source) -> None:
    """Edge functions of corners of squares up to a pixel outside, and what walkers step, one row or column beyond."""
    unit = source.finest()
    for macro, bits in (("TL_NARROW_LIMIT", 64), ("TL_WIDE_LIMIT", 128)):
        extent = 2 * (source.constant("vertex/fixed.h", macro) - 1)
        corner = (extent + 2 * unit) ** 2
        need(corner < 2 ** (bits - 1), f"E of squares leaves {bits} bits")
        need(extent**2 + 2 * extent < 2 ** (bits - 1), f"E' leaves {bits} bits beyond the box")
    source.says("vertex/setup.c", "i128_product(y1, x2)), 2)")
    need(2 * extent**2 < 2**127, "four times the area leaves 128 bits")


@claim("range", "planes", "vertex/setup.c", "products below 2^52 are exact")
def planes(source: Source) -> None:
    """Areas of narrow triangles in 64 bits; areas and weights in float64 where they are said to be exact."""
    narrow = 2 * (source.constant("vertex/fixed.h", "TL_NARROW_LIMIT") - 1)
    source.says("vertex/setup.c", "two products below 2^62", "width * height < 0x1p52", "2.0 * width * height < 0x1p52")
    need(narrow**2 < 2**62, "a product of two differences exceeds 2^62")
    need(2 * narrow**2 < 2**63, "an area leaves 64 bits")
    need(2 * 2**52 <= 2**53, "a difference of two products is not exact")
    source.says("raster/state.h", "Triangles with extents up to 2^25 units")
    (limit,) = source.numbers("area/area.c", r"bits \+ TL_MAX_EDGE_BITS < (\d+) \?")
    need(limit == 25 and 2 * 2**50 < 2**53, "an area of extents of 2^25 is not exact")


@claim(
    "range", "grid-edges", "raster/triangles_float.c", "nothing is rounded in 2., because all its numbers are below 2^7"
)
def grid_edges(source: Source) -> None:
    """Vertices on 2^-8 px: edge functions of small boxes in float32, and of triangles by themselves in float64."""
    name, bits = "raster/triangles_float.c", int(source.constant("raster/triangles_float.c", "TL_GRID_BITS"))
    box, half = source.constant(name, "TL_EXACT_BOX"), source.constant(name, "TL_HALF_UNIT")
    need(half == Fraction(1, 2 ** (2 * bits + 1)), "half a unit is another")
    need(2 * box / half <= 2**24, "an edge function does not fit float32")
    source.says(name, "wide = vf_set1(0x1p15f)")
    need(2**15 * Fraction(1, 2**bits) > box, "top and left as one number")
    (most,) = source.numbers("raster/single_float.c", r"fabs\(x_fx\) < (\S+) ")
    source.says("raster/single_float.c", "near enough that 2E < 2^51")
    need(2 * (2 * most) ** 2 < 2**51, "2E is 2^51 or more")


@claim("range", "wide-edges", "area/ramp.c", "below 2^126 + 2^79")
def wide_edges(source: Source) -> None:
    """Where an edge of any length enters a row, in 128 bits."""
    extent = 2 * (source.constant("vertex/fixed.h", "TL_WIDE_LIMIT") - 1)
    unit = source.finest()
    need((unit - 1) * extent + extent * extent < 2**126 + 2**79, "a numerator is larger")
    source.says("area/ramp.c", "i128_product(ta, dx)", "i128_product(tb - ta, dx)", "dx < 0 ? i128_add(xa, step) : xa")
    need(2**126 + 2**79 < 2**127, "a numerator leaves 128 bits, from either end of the row")


@claim("range", "fans", "exact/pieces.c", "Sums the areas of a fan by sign")
def fans(source: Source) -> None:
    """The sum of the areas of a fan round a clipped polygon, of corners within the guard band."""
    source.says("src/topleft/_core/engine/buffers.pxi", "2.0**60 / (side / 2 * 2**guard_bits)")
    source.says("vertex/clip.c", "#define TL_MAX_CORNERS (3 + TL_N_PLANES)")
    corners = 3 + source.constant("vertex/project.c", "TL_N_PLANES")
    extent = 2 * 2**60 + 2**9  # rounded in float64, whose last place there is 2^8
    need((corners - 2) * extent**2 < 2**127, "the areas of a fan leave 128 bits")


@claim("range", "comparisons", "pixels/paint.c", "the terms reach 2^127")
def comparisons(source: Source) -> None:
    """Colours that are compared exactly: three edge functions times integers of 10 bits, in two words or 4352 bits."""
    source.says("pixels/paint.c", "|d|, |halves| <= 511")
    factor = 2 * 255 + 1
    need(2 * (255 - 0) + 1 <= factor and factor < 2**10, "a factor has more than 10 bits")
    need(3 * factor * 2**64 + 3 * factor * 2**63 < 2**127, "a sum of words leaves 128 bits")
    words = int(source.constant("exact/sign.c", "TL_BIG_WORDS"))
    least = -int(source.numbers("exact/sign.c", r"TL_LEAST_EXPONENT (-\d+)")[0])
    edge = 2 * (2 * 2**1024 * 2**least) ** 2  # two products of two differences of numbers below 2^1024
    source.says("exact/sign.c", "|E| is below 2^4200, the words have 4352 bits")
    need(edge <= 2**4199 < 2**4200 and 64 * words == 4352, "an edge function is 2^4200 or more")
    need(3 * factor * edge < 2 ** (64 * words), "a sum of terms does not fit the words")
    need(1024 - 53 + least + 64 <= 32 * (words - 2), "a number does not fit its words")


@claim("range", "expansions", "exact/sign.c", "every product of parts is then a multiple of 2^-1074 and below 2^1004")
def expansions(source: Source) -> None:
    """Products of parts of differences do not underflow or overflow, nor do they with a factor of 10 bits."""
    low, high = source.numbers("exact/sign.c", r"fabs\(v\) >= (\S+) && fabs\(v\) <= (\S+?)\)")
    part = low / 2**52  # differences and their errors are multiples of it
    need(part**2 >= Fraction(1, 2**1074), "a product is no multiple of 2^-1074")
    need((2 * high) ** 2 < 2**1004 and 2**10 * 16 * 2**1004 < 2**1023, "a product overflows")
    least, most = source.numbers("exact/sign.c", r"size > (1e-200) && size < (1e300)")
    need(least / 2 / 2**106 > Fraction(1, 2**1074) and most < 2**1023, "an error of a product underflows")


@claim("range", "adler", "pixels/png.c", "64 sums side by side, over up to 16 lines")
def adler(source: Source) -> None:
    """Adler-32 in 16 and 32 bits, and codes in the word of the writer."""
    name = "pixels/png.c"
    source.says(name, "min64(n / 64, 16)", "for (; n > 0; n--)", "b = (b + 64 * n_lines * a + weighed) % 65521")
    sums, before = 16 * 255, 120 * 255  # 0 + 1 + ... + 15
    need(sums < 2**16 and before < 2**16, "a sum of 16 lines does not fit 16 bits")
    weighed = 65 * 32 * sums + 64 * 64 * before
    need(65521 + 64 * 16 * 65521 + weighed < 2**32, "a sum does not fit 32 bits")
    need(65521 + 63 * (65521 + 63 * 255) < 2**32, "a sum of the last bytes does not fit 32 bits")
    (bits,) = source.numbers(name, r"MOST_BITS = (\d+)")
    need(7 + 4 * bits <= 64 and 8 + bits + 5 + 1 <= 32 and 286 <= 2**bits, "codes do not fit a word")


@claim("range", "clouds", "src/topleft/_core/raster/points.py", "squares of it in sub-pixels stay below 2**60")
def clouds(source: Source) -> None:
    """Points: squares of sizes, for whole roots up to 2^60, and rows of windows in 64 bits."""
    name = "src/topleft/_core/raster/points.py"
    (most,), (farthest,) = (
        source.numbers(name, r"MOST_POINT_PX = 1 << (\d+)"),
        source.numbers(name, r"WINDOW_FX = 1 << (\d+)"),
    )
    need((2**most * source.finest()) ** 2 <= 2**60, "a square exceeds 2^60")
    need(2 * 2**farthest + 2**31 * 2**17 + 2**31 + 2**31 < 2**63, "a row leaves 64 bits")


@claim("range", "rings", "polygons/simple.c", "Differences have 25 bits, so products are exact")
def rings(source: Source) -> None:
    """Rings: differences of narrow points, pieces in 64 bits, of wide points in 128, and the snap in float64."""
    narrow = source.constant("polygons/polygons.h", "TL_NARROW_POLYGON")
    wide, unit = source.constant("polygons/polygons.h", "TL_POLYGON_LIMIT"), source.finest()
    need(2 * narrow <= 2**25 and 2 * (2 * narrow) ** 2 <= 2**53, "a difference of products is not exact")
    need(unit * 2 * narrow + (2 * narrow) ** 2 < 2**63, "a piece leaves 64 bits")
    need(unit * 2 * wide + (2 * wide) ** 2 < 2**127 and 2 * (2 * wide) ** 2 < 2**127, "a piece leaves 128 bits")
    source.says(
        "polygons/points.c",
        "vd_set1(0x1.8p52)",
        "vd_ge(vd_set1(0x1p50), vd_abs(fx))",
        "far = (int64_t)1 << (50 - grid_bits)",
    )
    need(2**50 + narrow < 2**53, "a coordinate from the corner is not exact")


@claim("range", "windows", "vertex/fixed.h", "Whether a window lies within 2^30 pixels of 0")
def windows(source: Source) -> None:
    """Pixels of windows within 2^30 of 0 in 32 bits, offsets of fewer than 2^31 samples, and cells of areas."""
    source.says("raster/state.h", "farthest = (int64_t)1 << 30", "min64(window->x_px + window->width, farthest)")
    (near,) = source.numbers("src/topleft/_core/raster/choices.py", r"max\(map\(abs, view\.origin\)\) < 2\*\*(\d+)")
    source.says("src/topleft/_core/raster/choices.py", "width * height < 2**31")
    need(2**near <= 2**30 and 2 * (2**30 - 1) < 2**31, "a column from the window does not fit 32 bits")
    (cells,) = source.numbers("src/topleft/_core/raster/sampling.py", r"MAX_CELLS = 1 << (\d+)")
    need(2**cells + 2**24 < 2**31, "a place of a cell does not fit 32 bits")
    source.says("topleft.h", "n_px <= 2^62", "window->pause->left_px >= 0)")
    need(0 - 2**62 >= -(2**63), "work that is left overflows")


@claim("range", "ids", "src/topleft/_core/base/arrays.py", "triangles must have at most {INT32_MAX} rows")
def ids(source: Source) -> None:
    """Indices, names and strides of up to 2^31 rows: rows are found by 64 bits, and names of scenes fit int32."""
    source.says(
        "src/topleft/_core/base/arrays.py", "INT32_MAX = 2**31 - 1", "vertices must have at most {INT32_MAX} rows"
    )
    source.says("src/topleft/_meshes/scene/scene.py", "if self.n_triangles > INT32_MAX")
    source.says("lanes/lanes_x86.h", "uint64_t at = (uint32_t)i[4 * step * k]", "base + at * (uint64_t)scale")
    source.says("vertex/corners.h", "read_corners(const tl_snapped *snapped, int64_t i,")
    need(2**32 * 32 * 4 < 2**63, "a row of 32 bytes, or of four such, is not found by 64 bits")
    source.says("src/topleft/_meshes/model/normals.py", "n_triangles >= 1 << 28")
    need(3 * 2**28 < 2**31, "corners round vertices do not fit int32")


@claim(
    "range", "references", "src/topleft/methods/reference/integers.py", "products of two differences stay below 2^60"
)
def references(source: Source) -> None:
    """The integers of references and of the methods of others."""
    name = "src/topleft/methods/reference/integers.py"
    (limit,), (centre,) = (
        source.numbers(name, r"INT64_LIMIT = 2\*\*(\d+)"),
        source.numbers(name, r"CENTER_LIMIT = 2\*\*(\d+)"),
    )
    need((2 * (2**limit - 1)) ** 2 < 2**60, "a product is 2^60 or more")
    need(2**centre * 16 < 2**53, "a sixteenth of a pixel is not exact")
    source.says(
        "src/topleft/methods/__init__.py", "Integer products of differences stay below 2**61", "INT_LIMIT = 2.0**29"
    )


@claim(
    "range",
    "samples",
    "src/topleft/_core/raster/sampling.py",
    "in sixteenths of a pixel: the standard patterns of Direct3D 11",
)
def samples(source: Source) -> None:
    """Samples lie in the pixel, each in a row and a column of its own, and those of 2, 4 and 8 around its centre."""
    positions = positions_of(source)
    (bits,) = source.numbers("src/topleft/_core/raster/sampling.py", r"SAMPLE_GRID_BITS = (\d+)")
    half = 2**bits / 2
    need(list(positions) == [1, 2, 4, 8, 16], "other numbers of samples")
    for n, at in positions.items():
        need(len(at) == n and all(-half <= a < half for pair in at for a in pair), f"{n} samples leave the pixel")
        need(all(len(set(axis)) == n for axis in zip(*at, strict=True)), f"{n} samples share a row or a column")
        middle = [sum(axis) for axis in zip(*at, strict=True)]
        need(middle == ([-8, -8] if n == 16 else [0, 0]), f"{n} samples have another mean")


def positions_of(source: Source) -> dict[int, tuple[tuple[int, int], ...]]:
    """The positions of samples, as sampling.py has them."""
    for node in ast.parse(source.lines("src/topleft/_core/raster/sampling.py")).body:
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "POSITIONS" and node.value:
            return ast.literal_eval(node.value)
    raise NotProvedError("sampling.py has no positions")


@claim("range", "shifts", "lanes/lanes.h", "a number below 2^42 less the nearest multiple of 2^-8")
def shifts(source: Source) -> None:
    """Numbers that are rounded by adding a large one: the sum lies where float64 has steps of the unit."""
    source.says("raster/triangles_float.c", "vd_ge(vd_set1(0x1p30), farthest)", "vd_off_256th(t->x[k])")
    block, step = (source.constant("pixels/runs.c", f"TL_{name}") for name in ("RUN_BLOCK", "MOST_STEP"))
    area = source.constant("pixels/runs.c", "TL_UNIT_AREA")
    for name, pattern, most, unit in (
        ("lanes/lanes.h", r"shift = vd_set1\((\S+?)\)", Fraction(2**42), Fraction(1, 2**8)),
        ("lanes/lanes_scalar.h", r"\(\(a \+ (\S+)\) - 0x1\.8p52\)", Fraction(2**51), Fraction(1)),
        ("raster/single_float.c", r"magic = (\S+);", Fraction(2**31), Fraction(1)),
        ("pixels/runs.c", r"integers = vd_set1\((\S+?)\)", area + block * step, Fraction(1)),  # near a pixel inside
        ("polygons/points.c", r"magic = vd_set1\((\S+?)\)", Fraction(2**50), Fraction(1)),
    ):
        (shift,) = source.numbers(name, pattern)
        need(2**52 * unit <= shift - most and shift + most <= 2**53 * unit, f"{name} rounds to another unit")


@claim("range", "snap", "vertex/snap.c", "rint is the only rounding")
def snap(source: Source) -> None:
    """A coordinate times a power of two is exact unless it overflows, which the range refuses; so is its inverse."""
    narrow, wide = (source.constant("vertex/fixed.h", f"TL_{kind}_LIMIT") for kind in ("NARROW", "WIDE"))
    source.says("vertex/snap.c", "store_vertex(rint(x_px * scale), rint(y_px * scale), z, i, out, wide, counts)")
    source.says("vertex/fixed.h", "fabs(x_fx) < TL_NARROW_LIMIT", "fabs(x_fx) < TL_WIDE_LIMIT")
    need(narrow == 2**30 and wide == 2**62, "other limits")
    (integers,) = source.numbers("exact/take_points.c", r"\(double\)integers\[i\]\) < (\S+)\)")
    need(integers * source.finest() <= wide and integers <= 2**53, "an integer on a grid is not exact")
