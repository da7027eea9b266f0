"""Checks what comments of csrc claim of rounding, ranges and owners: `prove.py [--all] [--csrc FOLDER] [NAME ...]`.

Constants are read from csrc, and programs include its code, so a change there changes the proof. Each claim names a
sentence of a comment, which must stand there. `--all` adds the claims that take minutes. Needs gcc and z3-solver.
docs/design/proofs.md lists the claims.

Methods. Values: every case is computed by the code of csrc, and compared. Rounding: the largest error of each result
follows from those of its arguments, in fractions (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2002,
chapter 3). Range: bounds in integers. Logic: z3 finds no counterexample among all integers.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path

import z3

ROOT = Path(__file__).resolve().parents[1]
AVX2 = ["-DTL_USE_AVX2", "-mavx2", "-mfma", "-mbmi", "-mbmi2", "-mlzcnt", "-mpopcnt"]
FLAGS = ["-std=c11", "-O2", "-DNDEBUG", "-ffp-contract=off", "-fno-math-errno", "-w"]


class NotProvedError(Exception):
    """A claim does not follow."""


def need(holds: bool, text: str) -> None:
    """Raise an error unless a step of a proof holds."""
    if not holds:
        raise NotProvedError(text)


@dataclass(frozen=True)
class Source:
    """The C code that claims are about."""

    folder: Path

    def text(self, name: str) -> str:
        """A file in one line, without the stars of its comments."""
        lines = (self.folder / name).read_text(encoding="utf-8").replace("\n * ", "\n")
        return re.sub(r"\s+", " ", lines)

    def constant(self, name: str, macro: str) -> Fraction:
        """The number of a macro: decimal, hexadecimal with a power of two, or `1 << n`."""
        line = re.search(rf"^#define {macro} \(?([^\s)]+(?: << \d+)?)", (self.folder / name).read_text(), re.MULTILINE)
        need(line is not None, f"{name} defines no {macro}")
        value, _, shift = line[1].partition(" << ")  # type: ignore[index]
        number = value.rstrip("fu")
        return Fraction(float.fromhex(number) if "0x" in number else float(number)) * (1 << int(shift or 0))

    def run(self, *arguments: object, program: str) -> None:
        """Compile a program of .ci/proofs with the code, and run it."""
        has_avx2 = " avx2 " in Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else False
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder, "proof")
            source = Path(__file__).parent / "proofs" / program
            command = [*shlex.split(os.environ.get("CC", "gcc")), *FLAGS, *(AVX2 if has_avx2 else ["-DTL_USE_SCALAR"])]
            built = subprocess.run(
                [*command, f"-I{self.folder}", str(source), "-lm", "-o", str(made)], capture_output=True, text=True
            )
            need(built.returncode == 0, f"{program} does not compile: {built.stderr[:500]}")
            done = subprocess.run([str(made), *map(str, arguments)], capture_output=True, text=True)
        need(done.returncode == 0, f"{program}: {done.stdout.strip() or 'a value is wrong'}")


# ---- rounding ------------------------------------------------------------------------------------------------------

FLOAT, DOUBLE = Fraction(1, 2**24), Fraction(1, 2**53)
"""The largest relative error of one rounding, u."""


@dataclass(frozen=True)
class Rounded:
    """A computed number: the largest size of the exact number, and the largest error."""

    size: Fraction
    error: Fraction = Fraction(0)

    def plus(self, other: Rounded, u: Fraction, size: Fraction | int | None = None) -> Rounded:
        """A sum or difference, rounded; `size` where the exact result is known to be smaller."""
        exact = self.size + other.size if size is None else Fraction(size)
        return Rounded(exact, self.error + other.error).rounded(u)

    def times(self, other: Rounded, u: Fraction) -> Rounded:
        """A product, rounded."""
        error = self.size * other.error + other.size * self.error + self.error * other.error
        return Rounded(self.size * other.size, error).rounded(u)

    def rounded(self, u: Fraction) -> Rounded:
        """The number after one rounding."""
        return Rounded(self.size, self.error + u * (self.size + self.error))


ONE = Rounded(Fraction(1))
"""A number that is exact, scaled so that its largest size is 1."""


def edge_of_points(u: Fraction) -> tuple[Rounded, Rounded, Rounded]:
    """E at the first sample, dx and dy, from points measured from it, without the error of the points; X = Y = 1."""
    dx = dy = ONE.plus(ONE, u, 1)
    return dy.times(ONE, u).plus(dx.times(ONE, u), u, 1), dx, dy


def edge_in_float64() -> tuple[Rounded, Rounded, Rounded]:
    """As `edge_of_points`, from points in float64, whose differences round."""
    x = y = ONE.rounded(DOUBLE)
    dx = dy = ONE.plus(ONE, DOUBLE, 1)
    return dy.times(x, DOUBLE).plus(dx.times(y, DOUBLE), DOUBLE, 1), dx, dy


def row_value(e: Rounded, dx: Rounded, dy: Rounded, u: Fraction) -> Fraction:
    """The error of v - k dy in XY, where v = e + i dx; |i dx|, |k dy|, and |v|, |E| at column 0, are at most XY.

    The product with i is rounded; where `vf_fma` takes it as it is, the error is less.
    """
    return e.plus(dx.rounded(u), u, 1).error + dy.error


def float_rows(source: Source) -> None:
    """Row ends of float32: |v - k d - E| is below 5.01 u XY, within the band."""
    e, dx, dy = (number.rounded(FLOAT) for number in edge_in_float64())
    error = row_value(e, dx, dy, FLOAT)
    band = source.constant("raster/triangles_float.c", "TL_ROW_BAND")
    # X * Y is rounded three times, and the band thrice: the product with the band, 1 / d, and their product.
    need(error <= Fraction(501, 100) * FLOAT, f"v errs by {float(error / FLOAT):.4f} u XY, not 5.01")
    need(error <= band * (1 - FLOAT) ** 6 / (1 + FLOAT), f"v errs by {float(error / FLOAT):.4f} u XY, beyond the band")
    quotient = (1 + FLOAT) ** 2 - 1  # of v * (1 / d)
    need(quotient <= Fraction(201, 100) * FLOAT, "a quotient errs by more than 2.01 u of itself")
    for name, columns in (("TL_NEAR_BAND", 17), ("TL_FAR_BAND", 62)):
        slack = source.constant("raster/refine.c", name)
        need(columns <= source.constant("raster/state.h", "TL_MAX_BOX_PX"), "a box is larger than columns are proved")
        need(quotient * columns <= slack * (1 - FLOAT) ** 2, f"{name} is narrower than quotients err")


def float_boxes(source: Source) -> None:
    """Boxes of up to 4x4 samples: |e - E| <= 23 u XY by points in float32, 147 u XY by places, within the bands."""
    steps = source.constant("raster/state.h", "TL_SMALL_BOX") - 1
    point = FLOAT * (1 + DOUBLE) + DOUBLE  # of a point, relative to X or Y: in float64, then in float32
    place = Fraction(1, 2 << int(source.constant("vertex/exact.h", "TL_PLACE_BITS")))
    e, dx, dy = edge_of_points(FLOAT)
    corner = 2 * FLOAT + 4 * FLOAT  # squares: the corner is subtracted, or another one is taken
    error = e.error + dx.error + dy.error + corner + 2 * steps * FLOAT * (1 + 64 * FLOAT)
    error *= (1 + point) ** 2  # points that are moved lie in a box that is wider
    for name, moved, told in (("TL_BOX_BAND", point, 23), ("TL_PLACE_BAND", place, 147)):
        at_points = 4 * moved + 2 * moved**2  # E = (A - S) x (B - S): two products, each of two numbers that move
        band = source.constant("raster/triangles_float.c", name) * (1 - FLOAT) ** 4
        total = error + at_points
        need(total <= told * FLOAT * (1 + Fraction(1, 2**10)), f"E errs by {float(total / FLOAT):.3f} u XY, not {told}")
        need(total <= band, f"E errs by {float(total / FLOAT):.3f} u XY, beyond {name}")
        # Twice the area: three points are moved, then four differences, two products, and their difference.
        difference = ONE.plus(ONE, FLOAT, 1)
        area = difference.times(difference, FLOAT).plus(difference.times(difference, FLOAT), FLOAT, 1)
        moved_area = Fraction(3, 2) * at_points
        need(area.error + moved_area <= 2 * band * (1 - FLOAT), f"twice the area errs by more than twice {name}")


def places(source: Source) -> None:
    """A place is within half a unit of its point, which moves E by at most 128 u XY."""
    bits = int(source.constant("vertex/exact.h", "TL_PLACE_BITS"))
    need(source.constant("raster/triangles_float.c", "TL_PLACE_UNIT") == Fraction(1, 1 << bits), "two units of places")
    moved = Fraction(1, 2 << bits)
    # E = (A - S) x (B - S): each of four coordinates moves, beside one of at most X or Y, and X + Y <= 2 XY.
    need(2 * moved * 2 + 2 * moved**2 <= Fraction(12801, 100) * FLOAT, "places move E by more than 128 u XY")
    limit = source.constant("vertex/exact.h", "TL_PLACE_LIMIT_PX")
    need((limit + 1) * 2**bits < 2**31, "a place does not fit 32 bits")


def double_rows(source: Source) -> None:
    """Row ends of float64, of a triangle by itself: v within 11.01 u XY, the band 12 u XY."""
    band = re.search(r"margin = (\d+)\.0 \* 0x1p-53", source.text("raster/single_float.c"))
    need(band is not None, "single_float.c has another band")
    error = row_value(*edge_in_float64(), DOUBLE)
    need(error <= Fraction(1101, 100) * DOUBLE, f"v errs by {float(error / DOUBLE):.4f} u XY")
    need(error <= int(band[1]) * DOUBLE * (1 - DOUBLE) ** 6, "v errs beyond the band")  # type: ignore[index]


def shewchuk(source: Source) -> None:
    """The sign of a rounded E is that of E beyond (3 + 16 u) u (|left| + |right|), and beyond 4 u of it."""
    u = DOUBLE
    need("(3.0 + 16.0 * 0x1p-53) * 0x1p-53 * size" in source.text("exact/sign.c"), "sign.c has another bound")
    # A difference is its rounded number times 1 + d, and so is a product: left = rounded left * (1 + d)^3.
    exact = (1 + u) ** 3 - 1
    # |E| rounded, the bound and the size are off by a factor of at most 1 + u each.
    for bound in ((3 + 16 * u) * u, 4 * u):
        need(exact * (1 + u) ** 2 <= bound * (1 - u), "the bound of the sign of E is too small")
    turns = source.text("raster/triangles_float.c")
    need("vd_max(vd_mul(size, vd_set1(0x1p-51))" in turns and 4 * u == Fraction(1, 2**51), "find_turns: another bound")


def ramps(source: Source) -> None:
    """An edge of areas is off by less than 2^-36 px in x."""
    u, most = DOUBLE, Fraction(2 ** int(source.constant("area/area.c", "TL_MAX_EDGE_BITS")))
    slope = Rounded(Fraction(1)).rounded(u)  # dx / dy, times a power of two; the product with t is at most 2^14 px
    x = Rounded(most, most * slope.error).rounded(u).plus(ONE, u, most + 1)
    need(x.error < Fraction(1, 2**36), f"x errs by {float(x.error):.3g} px")


def areas(source: Source) -> None:
    """The area right of an edge in a pixel is off by less than 0.501 units, three edges by less than 9e-8."""
    u, whole = DOUBLE, 2 ** int(source.constant("area/ramp.c", "TL_AREA_BITS"))
    longest = Fraction(2 ** int(source.constant("area/area.c", "TL_MAX_EDGE_BITS")))
    for across in (Fraction(1, 2**16), Fraction(1), longest):  # px, of an edge that may be the longest downwards
        off = 3 * u * (1 + u) * (across + 1)  # of x
        steep = whole * longest / (2 * across)
        # By the slopes of Q: `whole` of `low`; 0 of `high`, for 2 steep (high - low) is the height; and by squares.
        q = whole * off + steep * (2 * off) ** 2
        q += 8 * whole * ((1 + u) ** 6 - 1)  # six roundings of numbers up to 8 px
        need(q < Fraction(1, 2**11), f"Q errs by {float(q):.3g} units")
        need(2 * q + Fraction(1, 2) < Fraction(501, 1000), "an area errs by more than 0.501 units")
    need(Fraction(3 * 501, 1000) / whole < Fraction(9, 10**8), "three edges err by more than 9e-8")


def depth(source: Source) -> None:
    """Depth by a plane errs by 25 u r of the largest difference of depths: by 2^-35 of the largest |z| unless a sliver.

    r is the box over twice the area; differences of depths and of coordinates are at most 1, so d1 y2 - d2 y1 is, too.
    """
    u, slivers = DOUBLE, 2 ** int(source.constant("vertex/setup.c", "TL_SLIVER_BITS"))
    corners = [
        (1, 0),
        (1, 1),
        (0, 1),
        (-1, 0),
        (-1, -1),
        (0, -1),
    ]  # of pairs whose members and difference are at most 1
    need(all(abs(a * d - b * c) <= 1 for (a, b), (c, d) in itertools.product(corners, repeat=2)), "a slope exceeds r")
    product = ONE.rounded(u).times(ONE, u)  # a difference of depths, rounded, times an exact coordinate
    slope = product.plus(product, u, 1).times(ONE.rounded(u), u)
    part = slope.times(ONE, u)  # of x or of y
    error = 2 * part.error + u * (1 + part.error)  # and the sum of z0 and the first part
    need(error <= 25 * u, f"a depth errs by {float(error / u):.2f} u r")
    sums = 2 * u * (1 + u)  # of the largest |z|
    need(2 * error * slivers + sums <= Fraction(1, 2**35), "a depth errs by more than 2^-35 of the largest |z|")


def weights(source: Source) -> None:
    """Weights of float64 edge functions: within 2^-36, and 2^-28 where w differs by 256 times."""
    guard = re.search(r"fabs\(\*area\) \* (0x\w+) >= box", source.text("pixels/weights_exact.c"))
    need(guard is not None, "weights_exact.c has another bound for slivers")
    most = Fraction(float.fromhex(guard[1]))  # type: ignore[index]
    e = ONE.plus(ONE, DOUBLE, 1).times(ONE.plus(ONE, DOUBLE, 1), DOUBLE)  # a product, of the size of the box
    error = e.plus(e, DOUBLE, 1).error * most  # of an edge function inside, over the area
    need(error <= Fraction(1, 2**38), "the area errs by more than 2^-38 of its size")
    spread = Fraction(re.search(r"<= (\d+)\.0 \* fmin\(q0", source.text("pixels/weights.c"))[1])  # type: ignore[index]
    for ratio, told in ((Fraction(1), 36), (spread, 28)):
        # A part errs so, and is rounded once more with w; the sum of three errs three times so; a weight is at most 1.
        part = error * ratio + DOUBLE
        most_told = Fraction(1, 2**told) * (1 - error * ratio)
        need(4 * part + 6 * DOUBLE <= most_told, f"a weight errs by more than 2^-{told}")


# ---- ranges --------------------------------------------------------------------------------------------------------


def edge_functions(source: Source) -> None:
    """In the box of a triangle |E| is at most width * height, so |2E| fits 64 and 128 bits."""
    # E has no square of a coordinate: it is linear in each, and its extremes over a box lie at corners of the box.
    for ax, ay, bx, by, px, py in itertools.product((0, 1), repeat=6):
        need(abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) <= 1, "E exceeds width * height")
    for macro, bits in (("TL_NARROW_LIMIT", 64), ("TL_WIDE_LIMIT", 128)):
        extent = 2 * (source.constant("vertex/fixed.h", macro) - 1)
        need(2 * extent**2 < 2 ** (bits - 1), f"2E of vertices below {macro} leaves {bits} bits")


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


def row_quotients(source: Source) -> None:
    """What rows.c looks at is all that rows meet: |dy| below 62 px of 2^8, v + 1/2 exact in float32."""
    box = source.constant("raster/state.h", "TL_MAX_BOX_PX")
    need(box == 62, "proofs/rows.c looks at boxes of 62 px")
    need(2 * ((box * 2**8) ** 2 // 2**8) + 1 < 2**22, "v + 1/2 has more than 22 bits")


def rows_float64(source: Source) -> None:
    """Rows of large snapped triangles in float64 are exact below the bound of `rows_fit`."""
    need("< 0x1p50" in source.text("raster/single_fixed.c"), "rows_fit has another bound")
    v = Fraction(2**50)  # |v| in units, at most |2E|; with the half it has 52 bits
    need(2 * v + 1 < 2**53, "v + 1/2 is not exact")
    # v + 1/2 over d is at least 1 / (2 d) from an integer, and its product with 1 / d rounds twice.
    need((v + 1) * ((1 + DOUBLE) ** 2 - 1) < Fraction(1, 2), "a quotient may pass an integer")


def crossings(source: Source) -> None:
    """Crossings of narrow rings: the product with 1 / D gives the column of the exact quotient."""
    coordinate = source.constant("polygons/polygons.h", "TL_NARROW_POLYGON")
    # N is dy times the crossing less the sample, which lies between the ends of the edge less the sample; D = unit dy.
    height, across = 2 * coordinate, coordinate + 2**16
    numerator = height * across + height * 2**16
    need(2 * numerator < 2**53, "N + D - 1/2 is not exact")
    need(2 * numerator * ((1 + DOUBLE) ** 2 - 1) < 1, "a quotient may pass an integer")


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


def divisions(source: Source) -> None:
    """Quotients of integers below 2^24 in float32, and of sums below 2^39 in float64, round as the exact quotient."""
    need("2^39" in source.text("blend/mix_u8.c"), "divide_sums has another range")
    divisor = 255 * 255
    need(Fraction(1, 2**17) < Fraction(1, 2 * divisor), "a quotient of at most 255 may pass a middle")
    need(Fraction(1, 2**9) < Fraction(1, 510), "a quotient by 255 may pass a middle")
    need(Fraction(256, 2**53) < Fraction(1, 2**32), "a quotient of sums may pass a middle")
    need(16 * 255 * 65536 < 2**29, "the sum of a pixel's samples exceeds 2^29")


def lengths(source: Source) -> None:
    """The lengths of matches in PNG files: each from 3 to 258 has one symbol and its extra bits."""
    text = source.text("pixels/png.c")
    least, bits = ([int(n) for n in re.search(rf"{name}\[29\] = {{([^}}]*)}}", text)[1].split(",")]  # type: ignore[index]
                   for name in ("LENGTHS", "LENGTH_BITS"))  # fmt: skip
    ends = [a + 2**b for a, b in zip(least, bits, strict=True)]
    need(least[0] == 3 and least[-1] == 258 and bits[-1] == 0, "the first or the last length is another")
    need(ends[:-2] == least[1:-1] and ends[-2] == 258 + 1, "a length has no symbol, or two")


def lines(source: Source) -> None:
    """Lines between any vertices: d fits 64 bits, products of two lengths 128."""
    most = source.constant("vertex/fixed.h", "TL_WIDE_LIMIT")
    need(2 * most - 1 < 2**63 and (2 * most) ** 2 <= 2**126 and 2 * (2 * most) <= 2**64, "a line exceeds its integers")


# ---- logic ---------------------------------------------------------------------------------------------------------


def prove(claim: z3.BoolRef, text: str) -> None:
    """Raise an error unless a claim holds for all values of its variables."""
    solver = z3.Solver()
    solver.add(z3.Not(claim))
    found = solver.check()
    need(found == z3.unsat, f"{text}: {solver.model() if found == z3.sat else found}")


def top_left(dx: z3.ArithRef, dy: z3.ArithRef) -> z3.BoolRef:
    """Whether an edge owns the samples on it, as the code has it."""
    return z3.Or(dy < 0, z3.And(dy == 0, dx > 0))


def bias(source: Source) -> None:
    """One owner: the code owns a sample where E > 0, or E = 0 and the edge is top or left, with units and without."""
    code = source.text("raster/triangles_fixed.c")
    need("vi_gt(vi_set1(0), vi_sub(vi_shift_left(t->dy[k], 16), t->dx[k]))" in code, "another test of top and left")
    need("vi_select(top_left, doubled, vi_sub(doubled, vi_set1(1)))" in code, "another bias")
    dx, dy = z3.BitVecs("dx dy", 32)
    small = [z3.And(number > -(2**15), number < 2**15) for number in (dx, dy)]
    told = (dy << 16) - dx < 0
    prove(z3.Implies(z3.And(small), told == z3.Or(dy < 0, z3.And(dy == 0, dx > 0))), "top and left as one number")
    e, steps, unit = z3.Ints("e steps unit")
    for owns_ties, less in ((True, 0), (False, 1)):
        # E counts half units; a unit is two sub-pixels, or more, and E changes from sample to sample by whole units.
        at = (e - less) / unit + steps >= 0  # z3 divides as a shift does, to the integer below
        exact = z3.Or(e + unit * steps > 0, z3.And(owns_ties, e + unit * steps == 0))
        prove(z3.Implies(unit >= 2, at == exact), "the biased edge function in units")


def one_owner(source: Source) -> None:
    """Of the two triangles on either side of an edge exactly one owns a sample on it, and none if it lies outside."""
    need("2E = dx * (2py - 2ay) - dy * (2px - 2ax)" in source.text("vertex/fixed.h"), "another edge function")
    ax, ay, bx, by, px, py = z3.Ints("ax ay bx by px py")

    def owns(x0: z3.ArithRef, y0: z3.ArithRef, x1: z3.ArithRef, y1: z3.ArithRef) -> z3.BoolRef:
        e = (x1 - x0) * (py - y0) - (y1 - y0) * (px - x0)
        return z3.Or(e > 0, z3.And(e == 0, top_left(x1 - x0, y1 - y0)))

    is_edge = z3.Or(ax != bx, ay != by)
    prove(z3.Implies(is_edge, z3.Xor(owns(ax, ay, bx, by), owns(bx, by, ax, ay))), "one owner of an edge")


def one_owner_of_a_hub(source: Source) -> None:
    """Of the triangles round a vertex exactly one owns a sample on it.

    The triangle between the edges a and b from the hub, of positive area, owns it if and only if the ray (n, 1) runs
    between a and b, for any n beyond all coordinates. That ray is the same for all triangles and lies on no edge, and
    triangles that go round the hub once cover it once.
    """
    need("2E = dx * (2py - 2ay) - dy * (2px - 2ax)" in source.text("vertex/fixed.h"), "another edge function")
    ax, ay, bx, by, n = z3.Ints("ax ay bx by n")
    owns = z3.And(top_left(ax, ay), top_left(-bx, -by))  # E = 0 on both edges, one of which runs back to the hub
    between = z3.And(ax * 1 - ay * n > 0, n * by - 1 * bx > 0)
    is_fan = z3.And(ax * by - ay * bx > 0, n > ax, n > -ax, n > bx, n > -bx)
    prove(z3.Implies(is_fan, owns == between), "one owner of a hub")
    prove(z3.Implies(z3.And(z3.Or(ax != 0, ay != 0), n > ax, n > -ax), ax * 1 - ay * n != 0), "the ray lies on an edge")


# ---- values --------------------------------------------------------------------------------------------------------


def fixed_rows(source: Source, step: int = 1) -> None:
    """Row ends of snapped triangles, each height of an edge up to 62 px of 2^8, or every `step`-th of them."""
    n, most = os.cpu_count() or 1, 62 * 2**8
    heights = [0, *(round(most * (i / (8 * n)) ** 0.5) for i in range(1, 8 * n)), most]  # equal work
    ranges = [(a + 1, b + 1) for a, b in itertools.pairwise(heights)]
    if step > 1:
        ranges = [(a, a + 1) for a in range(1, most + 1, step)][-16:] + [(1, 1000)]
    with ThreadPoolExecutor(n) as pool:
        list(pool.map(lambda part: source.run(*part, program="rows.c"), ranges))


@dataclass(frozen=True)
class Claim:
    """A sentence of a comment and its proof."""

    name: str
    place: str
    says: str
    method: str
    proof: Callable[[Source], object]
    is_long: bool = False


CLAIMS = (
    Claim(
        "row-ends",
        "raster/row_edges.h",
        "It is computed in float32 as floor((v + 0.5) * (1 / d)), exactly",
        "values",
        fixed_rows,
        is_long=True,
    ),
    Claim(
        "row-ends-short",
        "raster/row_edges.h",
        "is at least 0.5 / d > 2^-15 from an integer",
        "values",
        partial(fixed_rows, step=16),
    ),
    Claim("row-quotients", "raster/row_edges.h", "0.5 has at most 22 bits", "range", row_quotients),
    Claim("float-rows", "raster/triangles_float.c", "|v - k d - E| < 5.01 u XY < M = 6 u XY", "rounding", float_rows),
    Claim(
        "float-boxes",
        "raster/triangles_float.c",
        "That is 23 u XY: E within 24 u XY of 0 is refined",
        "rounding",
        float_boxes,
    ),
    Claim("places", "raster/triangles_float.c", "2^-18 (X + Y) <= 128 u XY", "rounding", places),
    Claim(
        "double-rows", "raster/single_float.c", "setup and rows err by less than 11.01 u XY", "rounding", double_rows
    ),
    Claim("signs", "exact/sign.c", "*bound is its largest error (Shewchuk's A)", "rounding", shewchuk),
    Claim("weights", "pixels/weights_exact.c", "weights within 2^-36", "rounding", weights),
    Claim("ramps", "area/ramp.c", "x is off by less than 2^-36 px", "rounding", ramps),
    Claim("areas", "area/ramp.c", "an area is off by less than 0.501 units of 2^-24 px^2", "rounding", areas),
    Claim("depth", "vertex/setup.c", "steep that float64 would lose bits that float32 shows", "rounding", depth),
    Claim(
        "edge-functions",
        "vertex/fixed.h",
        "at any point inside the bounding box of a triangle |E| <= width * height",
        "range",
        edge_functions,
    ),
    Claim("lanes", "raster/triangles_fixed.c", "doubled edge functions 2^29", "range", lanes_fixed),
    Claim("large-rows", "raster/single_fixed.c", "Whether float64 row ends are exact", "range", rows_float64),
    Claim(
        "crossings",
        "polygons/crossings.c",
        "the product with the rounded 1 / D errs by less than 2^-51 |q|",
        "range",
        crossings,
    ),
    Claim("sums", "area/accumulate.c", "the overflow is detected", "range", sums_of_cells),
    Claim("divisions", "blend/mix_u8.c", "the least distance from the middle between two integers", "range", divisions),
    Claim("lengths", "pixels/png.c", "The least length of each length symbol", "range", lengths),
    Claim("lines", "lines/lines.c", "product of two of these is below 2^126", "range", lines),
    Claim("bias", "raster/triangles_fixed.c", "left: dy < 0, top: dy = 0 and dx > 0; as one number", "logic", bias),
    Claim("one-owner", "vertex/fixed.h", "edge functions are evaluated doubled", "logic", one_owner),
    Claim("one-owner-of-a-hub", "vertex/fixed.h", "edge functions are evaluated doubled", "logic", one_owner_of_a_hub),
    Claim(
        "bytes",
        "blend/mix_u8.c",
        "A quotient by 255 is at least 1/510 from the middle",
        "values",
        partial(Source.run, program="bytes.c"),
    ),
    Claim(
        "light", "shade/srgb.c", "value for each of the 65537 steps", "values", partial(Source.run, program="light.c")
    ),
    Claim(
        "curves",
        "clusters/cluster_sort.c",
        "A number below 2^10 with two zeros between its bits",
        "values",
        partial(Source.run, program="bits.c"),
    ),
    Claim(
        "roots",
        "points/cloud.c",
        "The largest whole number with a square of at most a, 0 <= a <= 2^60",
        "values",
        partial(Source.run, program="roots.c"),
        is_long=True,
    ),
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="claims to prove; all that are short")
    parser.add_argument("--all", action="store_true", help="with those that take minutes")
    parser.add_argument("--list", action="store_true", help="name the claims, and prove none")
    parser.add_argument("--csrc", type=Path, default=ROOT / "csrc", help="the folder of the code")
    options = parser.parse_args()
    known = [claim.name for claim in CLAIMS]
    if unknown := sorted(set(options.names) - set(known)):
        parser.error(f"NAME must be one of {', '.join(known)}, got {', '.join(unknown)}")
    if options.list:
        sys.stdout.writelines(f"{claim.name} {claim.place} {claim.method}\n" for claim in CLAIMS)
        return 0
    source, failed = Source(options.csrc.resolve()), 0
    for claim in CLAIMS:
        if claim.name not in options.names if options.names else claim.is_long and not options.all:
            continue
        start = time.monotonic()
        try:
            need(claim.says in source.text(claim.place), f"csrc/{claim.place} does not say: {claim.says}")
            claim.proof(source)
            told = "proved"
        except NotProvedError as error:
            told, failed = f"NOT PROVED: {error}", 1
        sys.stdout.write(f"{claim.name:20} {claim.method:9} {time.monotonic() - start:6.1f} s  {told}\n")
        sys.stdout.flush()
    return failed


if __name__ == "__main__":
    sys.exit(main())
