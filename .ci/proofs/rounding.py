"""Rounding: the largest error of each result follows from those of its arguments, in fractions.

Based on: N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2002, chapter 3.
"""

from __future__ import annotations

import itertools
import math
import re
import shutil
import subprocess
from dataclasses import dataclass
from fractions import Fraction

from proofs.source import HERE, LeftOutError, Source, claim, need, number_of

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


@claim("rounding", "float-rows", "raster/triangles_float.c", "|v - k d - E| < 5.01 u XY < M = 6 u XY")
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


@claim("rounding", "float-boxes", "raster/triangles_float.c", "That is 23 u XY: E within 24 u XY of 0 is refined")
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


@claim("rounding", "places", "raster/triangles_float.c", "2^-18 (X + Y) <= 128 u XY")
def places(source: Source) -> None:
    """A place is within half a unit of its point, which moves E by at most 128 u XY."""
    bits = int(source.constant("vertex/exact.h", "TL_PLACE_BITS"))
    need(source.constant("raster/triangles_float.c", "TL_PLACE_UNIT") == Fraction(1, 1 << bits), "two units of places")
    moved = Fraction(1, 2 << bits)
    # E = (A - S) x (B - S): each of four coordinates moves, beside one of at most X or Y, and X + Y <= 2 XY.
    need(2 * moved * 2 + 2 * moved**2 <= Fraction(12801, 100) * FLOAT, "places move E by more than 128 u XY")
    limit = source.constant("vertex/exact.h", "TL_PLACE_LIMIT_PX")
    need((limit + 1) * 2**bits < 2**31, "a place does not fit 32 bits")


@claim("rounding", "double-rows", "raster/single_float.c", "setup and rows err by less than 11.01 u XY")
def double_rows(source: Source) -> None:
    """Row ends of float64, of a triangle by itself: v within 11.01 u XY, the band 12 u XY."""
    band = re.search(r"margin = (\d+)\.0 \* 0x1p-53", source.text("raster/single_float.c"))
    need(band is not None, "single_float.c has another band")
    error = row_value(*edge_in_float64(), DOUBLE)
    need(error <= Fraction(1101, 100) * DOUBLE, f"v errs by {float(error / DOUBLE):.4f} u XY")
    need(error <= int(band[1]) * DOUBLE * (1 - DOUBLE) ** 6, "v errs beyond the band")  # type: ignore[index]
    source.says("raster/single_float.c", "3.0 * 0x1p-53 * (e->n_cols + 2)")
    need((1 + DOUBLE) ** 2 - 1 <= 3 * DOUBLE * (1 - DOUBLE) ** 3, "a quotient errs by more than 3 u of itself")


@claim("rounding", "steps", "raster/single_float.c", "q at the first row and each step err by 2^-52 of the largest |q|")
def steps(source: Source) -> None:
    """Row ends that are stepped in integers of 2^-40 columns err by less than their band."""
    name = "raster/single_float.c"
    unit = 2 ** int(source.constant(name, "TL_STEP_BITS"))
    share, constant = source.numbers(name, r"n_rows \* \(1\.0 \+ (\S+) \* most\) \+ (\d+)\.0;")
    (largest,) = source.numbers(name, r"!\(most < (\S+)\)")
    off = ((1 + DOUBLE) ** 2 - 1) * unit  # of q, and of a step: a rounded product with a rounded 1 / d
    for n_rows in (1, 2, 2**12):
        # `most` is |q| + n_rows |step|; a band is cut to an integer, and so are q and each step.
        for q in (0, largest):
            step = (largest - q) / n_rows
            error = off * (q + n_rows * step) + 1 + n_rows
            band = (n_rows * (1 + share * largest) + constant) * (1 - DOUBLE) ** 6 - 1
            need(error <= band, f"q errs by {float(error):.0f} units in {n_rows} rows")
    need(2 * largest * unit < 2**62, "q does not fit 64 bits")


@claim("rounding", "signs", "exact/sign.c", "*bound is its largest error (Shewchuk's A)")
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


@claim("rounding", "edge-values", "exact/sign.c", "E to within 2^-50 of its size")
def edge_values(source: Source) -> None:
    """A sum of 16 numbers that do not overlap, from the least on, is within 6.01 u; three words of an integer are, too.

    Numbers of such a sum are not even adjacent (Shewchuk, theorem 10): all that are less than one of them add up to
    less than half of it. So each sum is at most 3/2 of its last number, these halve, and the last is at most twice E.
    """
    n = int(source.constant("exact/sign.c", "TL_EXPANSION")) - 1
    error = Fraction(3, 2) * 2 * 2 * DOUBLE * (1 + DOUBLE) ** n
    need(error <= EDGE_VALUE, f"E errs by {float(error / DOUBLE):.3f} u of itself")
    words = (1 + DOUBLE) ** 2 * (1 + Fraction(1, 2**64)) - 1  # two sums round; the rest is below 2^-64
    need(max(words, EDGE_VALUE) <= Fraction(1, 2**50), "E errs by more than 2^-50 of itself")


EDGE_VALUE = Fraction(601, 100) * DOUBLE


@claim("rounding", "shares", "raster/single_float.c", "shares of the area, each within 2^-49 of its size")
def shares(source: Source) -> None:
    """A quotient of two edge functions, each within 6.01 u, rounded once."""
    source.says("raster/single_float.c", "scaled_quotient(edge_value(p[2], p[0], sample), t->area)")
    error = (1 + EDGE_VALUE) / (1 - EDGE_VALUE) * (1 + DOUBLE) - 1
    need(error <= Fraction(1, 2**49), f"a share errs by {float(error / DOUBLE):.2f} u of itself")


@claim("rounding", "exact-weights", "pixels/weights_exact.c", "So each weight is within 2^-30 of its own size")
def exact_weights(source: Source) -> None:
    """Edge functions within 2^-32 or 2^-50 of themselves, times 1/w, over their sum of positive numbers."""
    (share,) = source.numbers("pixels/weights_exact.c", r"mantissa\) \* (\S+) > bound")
    off = share / (1 - share)  # the bound is less than `share` of the rounded edge function
    part = (1 + max(off, EDGE_VALUE)) * (1 + DOUBLE) - 1
    error = (1 + part) / (1 - part) * (1 + DOUBLE) / (1 - DOUBLE) ** 2 - 1
    need(error <= Fraction(1, 2**30), f"a weight errs by 2^{math.log2(error):.2f} of itself")


@claim("rounding", "ties-of-colours", "pixels/paint.c", "errs by less than 2^-20")
def ties_of_colours(source: Source) -> None:
    """The value of a channel errs by less than 2^-20, within which of a tie colours are compared exactly."""
    (near,) = source.numbers("pixels/paint.c", r"below - 0\.5\) < (\S+?)\)")
    weight = Fraction(1, 2**30)  # of itself, at most 1; where float64 edge functions are used 2^-36
    error = 2 * 255 * (weight + 4 * DOUBLE) + 3 * 255 * DOUBLE  # slopes, products and two sums round
    need(error < near, f"a value errs by 2^{math.log2(error):.2f}")


@claim("rounding", "projection", "vertex/project.c", "so x_px errs by less than 2^-51 of |x_px| + width")
def projection(source: Source) -> None:
    """x_px = (x/w + 1) * (width/2), three roundings: at most 3 u |x_px| + u width / 2, to first order."""
    u = DOUBLE
    source.says("vertex/project.c", "out[0] = (p[0] / p[3] + 1.0) * view->half_width_px")
    # |x/w| is at most |x/w + 1| + 1; in units of half the width, of any |x_px| = s and the 1 of the width.
    for s in (Fraction(0), Fraction(1), Fraction(2**61)):
        quotient = u * (s + 1)
        error = quotient + u * (s + quotient)
        error += u * (s + error)
        need(error <= Fraction(1, 2**51) * (s + 2), f"a coordinate errs by {float(error / u):.2f} u")


@claim("rounding", "stage", "src/topleft/_core/raster/cluster_draw.py", "four roundings, and the same again")
def stage(source: Source) -> None:
    """A row of a matrix times a point, as ((a + b) + c) + d: four roundings; bounds for clusters take twice that."""
    name = "src/topleft/_core/raster/cluster_draw.py"
    told = source.numbers(name, r"float32\): 2\.0\*\*-(\d+), np\.dtype\(np\.float64\): 2\.0\*\*-(\d+)")
    for u, bits in zip((FLOAT, DOUBLE), told, strict=True):
        error = (1 + u) ** 4 * (1 + DOUBLE) ** 4 - 1
        need(2 * error <= Fraction(1, 2 ** int(bits)) * (1 + 32 * DOUBLE) * (1 + 4 * u), "STAGE_ERROR is too small")


@claim("rounding", "hidden-depths", "clusters/cluster_view.c", "the error of a depth before it is rounded to float32")
def hidden_depths(source: Source) -> None:
    """Depths are within 2^-35 of the largest |z|, and z errs by less than 4 u: less than is left for clusters."""
    (left,) = source.numbers("clusters/cluster_view.c", r"error = (\S+) \* \(largest\[2\] \+ 1\.0\)")
    need(Fraction(1, 2**35) + 4 * DOUBLE <= left, "a hidden cluster may show")


@claim("rounding", "quotients", "lanes/lanes_x86.h", "it errs by less than 2^-100 of the quotient")
def quotients(source: Source) -> None:
    """A quotient by one division for three is correctly rounded.

    Of float32 numbers a - q b is exact, so the step leaves |a / b - q| times the error of 1 / b, and a / b, whose
    divisor has 24 bits, is 1 / (2^53 2^24) or more from a middle, in units of the quotient's power of two. Of float64
    numbers the first step leaves an error far below one unit in the last place, so q is faithful, and the second
    rounds correctly (Markstein, theorem of 1990).
    """
    source.says("lanes/lanes_x86.h", "q = TL_MM(mul_pd)(a, inverse); if (!are_f32) q = TL_MM(fmadd_pd)")
    first = (1 + DOUBLE) ** 2 - 1  # of a rounded 1 / b, and of the product
    need(first * 2**53 < 4, "a - q b needs more than 53 bits of 24 and 24 + 53")
    step = first * DOUBLE * (1 + DOUBLE)
    need(2 * step < Fraction(1, 2**100), "the step errs by more than 2^-100")
    need(Fraction(1, 2**53 * 2**24) > Fraction(2, 2**100), "a quotient may pass a middle")
    faithful = 2 * (first + DOUBLE) * (DOUBLE + first)  # a - q b is rounded, too
    need(faithful < DOUBLE / 2**40, "q is not faithful")


@claim("rounding", "ramps", "area/ramp.c", "x is off by less than 2^-36 px")
def ramps(source: Source) -> None:
    """An edge of areas is off by less than 2^-36 px in x."""
    u, most = DOUBLE, Fraction(2 ** int(source.constant("area/area.c", "TL_MAX_EDGE_BITS")))
    slope = Rounded(Fraction(1)).rounded(u)  # dx / dy, times a power of two; the product with t is at most 2^14 px
    x = Rounded(most, most * slope.error).rounded(u).plus(ONE, u, most + 1)
    need(x.error < Fraction(1, 2**36), f"x errs by {float(x.error):.3g} px")


@claim("rounding", "areas", "area/ramp.c", "an area is off by less than 0.501 units of 2^-24 px^2")
def areas(source: Source) -> None:
    """The area right of an edge in a pixel is off by less than 0.501 units, three edges by less than 9e-8."""
    u, whole = DOUBLE, 2 ** int(source.constant("area/ramp.c", "TL_AREA_BITS"))
    longest = Fraction(2 ** int(source.constant("area/area.c", "TL_MAX_EDGE_BITS")))
    for across in (
        Fraction(1, source.finest()),
        Fraction(1),
        longest,
    ):  # px, of an edge that may be the longest downwards
        off = 3 * u * (1 + u) * (across + 1)  # of x
        steep = whole * longest / (2 * across)
        # By the slopes of Q: `whole` of `low`; 0 of `high`, for 2 steep (high - low) is the height; and by squares.
        q = whole * off + steep * (2 * off) ** 2
        q += 8 * whole * ((1 + u) ** 6 - 1)  # six roundings of numbers up to 8 px
        need(q < Fraction(1, 2**11), f"Q errs by {float(q):.3g} units")
        need(2 * q + Fraction(1, 2) < Fraction(501, 1000), "an area errs by more than 0.501 units")
    need(Fraction(3 * 501, 1000) / whole < Fraction(9, 10**8), "three edges err by more than 9e-8")


@claim("rounding", "wide-areas", "area/ramp.c", "errs by less than 2^-23 of a unit")
def wide_areas(source: Source) -> None:
    """The area right of an edge of any length, where ends of ramps are quotients of integers: 2^-23 units off.

    In pixel k the area is (a + b - 2 low) steep (b - a) + right height with a and b in [low, high]. An error of high,
    which a, b and `right` share, moves it by its square, for the ramp ends where it has the whole height.
    """
    u, whole = DOUBLE, 2 ** int(source.constant("area/ramp.c", "TL_AREA_BITS"))
    source.says("area/ramp.c", "(a + b - (low + low)) * steep * (b - a) + right * height")
    low = (1 + u) ** 3 - 1  # three roundings; low is below 1
    for length in (Fraction(1, 2**62), Fraction(1), Fraction(2**50), Fraction(2**62)):
        share = min(Fraction(1), 1 / length)  # of the height, in a pixel
        off = low * share + 8 * u  # of the mean of the ramp: of low, and roundings of its own size
        off += (4 * u * (length + 1)) ** 2 * share * (length < 2**50)  # of high; beyond 2^50 px its pixel is whole
        off += Fraction(1, 2**49) * (length >= 2**50)  # there the mean is that of 2 k, in pixels that may be the last
        need(whole * off < Fraction(1, 2**23), f"an area errs by {float(whole * off):.3g} units")


@claim("rounding", "rests", "pixels/runs.c", "stays below 17 and errs by less than 2^-19")
def rests(source: Source) -> None:
    """The rest of an edge function of vertices that are not snapped, by its nearest column, middle and pixel."""
    block, u = int(source.constant("pixels/runs.c", "TL_RUN_BLOCK")), FLOAT
    half = Fraction(1, 2)  # the largest rest, and the largest rest of a step
    worst = Fraction(0)
    for near in (0, block - 1):
        for pixel in (0, block - 1):
            middle = half + half * abs(near - block // 2)
            at = half + half * abs(pixel - near)
            need(max(middle, at) < 17, "a rest is 17 or more")
            # Half a unit in the last place is u / 2 times the power of two that the number is at most.
            error = (power_of_two(middle) + half * abs(pixel - block // 2) + power_of_two(at)) * u / 2
            worst = max(worst, error)
    need(worst < Fraction(1, 2**19), f"a rest errs by 2^{math.log2(worst):.2f}")
    need(
        worst / source.constant("pixels/runs.c", "TL_UNIT_AREA") < Fraction(1, 2**43), "of an area it is 2^-43 or more"
    )
    # float64, in boxes over areas: a product of two differences errs by 3 u. The area, two products and a difference,
    # scales E and its step alike, and E is at most the area in the triangle.
    product = ONE.rounded(DOUBLE).times(ONE.rounded(DOUBLE), DOUBLE)
    both = product.plus(product, DOUBLE)
    step = ONE.rounded(DOUBLE).times(ONE, DOUBLE)
    scale = 2 * DOUBLE  # the quotient and the product with it
    error64 = both.error + scale * both.size + both.error + scale + step.error
    need(error64 < Fraction(1, 2**48), f"float64 errs by {float(error64 / DOUBLE):.2f} u boxes over areas")


def power_of_two(number: Fraction) -> Fraction:
    """The least power of two that is not less."""
    return Fraction(2) ** math.ceil(math.log2(number))


@claim("rounding", "attributes", "pixels/runs.c", "so a value errs by less than 13.01 * 2^-24 of the largest")
def attributes(source: Source) -> None:
    """sum(E q a) / sum(E q) in float32, of positive E and q: E, q and q a are rounded, then products and sums."""
    sums = "vf_fma(p->e[0], pick(p, c0), vf_fma(p->e[1], pick(p, c1), vf_mul(p->e[2], pick(p, c2))))"
    source.says("pixels/runs.c", sums)
    source.says("shade/shade_pixels.c", "p->inv_q = vf_div(vf_set1(1.0f), p->q)", "p->inv_q);")
    above = (1 + FLOAT) ** (1 + 1 + 1 + 3)  # of E, q, q a; and a product and two sums
    below = (1 - FLOAT) ** (1 + 1 + 3)
    error = above / below * (1 + FLOAT) ** 2 - 1  # the inverse, and the product with it
    need(error < Fraction(1301, 100) * FLOAT, f"a value errs by {float(error / FLOAT):.3f} units of 2^-24")


@claim("rounding", "layers", "pixels/composite.c", "a colour of uint8 is within 1/2 + 2^-37 of the exact mean")
def layers(source: Source) -> None:
    """The mean of up to 17 colours by weights a T, where T is the product of 1 - a of the layers before.

    An error u a of a moves T by at most u times a weight before, so all of them by u times the sum of weights; the
    rest is relative: 1 - a and its product with T, for each layer before.
    """
    name, u = "pixels/composite.c", DOUBLE
    source.says(name, "own = (double)color[n_colors] / ONE, share = own * *through", "*through *= 1.0 - own")
    n = int(source.constant("topleft.h", "TL_MAX_LAYERS")) + 1  # and the background
    weights = (1 + u) ** (2 * (n - 1) + 2) - 1 + n * u * (1 + u) ** (4 * n)  # all errors, over the sum of weights
    above = (1 + weights) * (1 + u) ** (n + 1) - 1  # a product with the colour, and sums
    below = (1 + weights) * (1 + u) ** n - 1
    error = 255 * ((above + below) / (1 - below) * (1 + u) + u)
    need(error < Fraction(1, 2**37), f"a mean errs by 2^{math.log2(error):.2f}")


@claim("rounding", "spans", "tiles/spans.c", "its error is below 2^-49 of the largest coordinate")
def spans(source: Source) -> None:
    """The point where an edge enters a row of windows, and the window of a column."""
    u, slack = DOUBLE, source.constant("tiles/spans.c", "TL_SPAN_SLACK")
    share = (1 + u) ** 2 / (1 - u) - 1  # (y - ya) / (yb - ya), at most 1: two differences and a quotient
    product = Rounded(Fraction(1)).rounded(u).times(Rounded(Fraction(1), share), u)  # of b - a
    of_largest = 2 * product.error + u * (1 + 2 * product.error)
    need(of_largest < Fraction(1, 2**49), f"x errs by {float(of_largest / u):.2f} u")
    of_sum = product.error + u * (1 + product.error)  # of |xa| + |xb|
    need(of_sum < slack / 2, "x errs by more than the slack")
    need(2**31 * ((1 + u) ** 2 - 1) < Fraction(1, 2**20), "a column errs by 2^-20 px or more")


@claim("rounding", "strips", "blend/blend_strip.c", "the error is below 2^-20 sub-pixels")
def strips(source: Source) -> None:
    """The columns of a triangle in a strip of rows: a quotient, a product and a sum, of narrow vertices."""
    source.says(
        "blend/blend_strip.c", "a = y1 == y0 ? x0 : x0 + (first - y0) * slope", "t->is_narrow ? floor(low / unit) - 1.0"
    )
    extent = 2 * source.constant("vertex/fixed.h", "TL_NARROW_LIMIT")
    across = Rounded(extent).rounded(DOUBLE).rounded(DOUBLE)
    error = across.plus(Rounded(extent / 2), DOUBLE, extent / 2).error
    need(error < Fraction(1, 2**20), f"a column errs by {float(error):.3g} sub-pixels")


@claim("rounding", "smooth-lines", "lines/smooth_lines.c", "coverage errs by less than 2^-23")
def smooth_lines(source: Source) -> None:
    """1 - distance, 0 to 1: a square of float64 rounded to float32, its root, and a difference."""
    source.says("lines/smooth_lines.c", "vf_sub(vf_set1(1.0f), vf_sqrt(vf_from_vd(square)))")
    u, square = FLOAT, (1 + DOUBLE) ** 9 - 1  # a root, a quotient and products, squared
    root = (1 + square / 2) * (1 + u / 2) * (1 + u) - 1  # of the distance, at most 1
    for distance in (Fraction(0), Fraction(1, 2), Fraction(1)):
        error = distance * root + u * (1 - distance + distance * root)
        need(error < Fraction(1, 2**23), f"coverage errs by {float(error / u):.3f} u")


@claim("rounding", "angles", "lanes/angle.h", "where the polynomial is within 2^-56 of atan(q) / q")
def angles(source: Source) -> None:
    """The polynomial in z = q^2 beside the series of atan, z <= tan(22.5 degrees)^2 with the rounding of q."""
    text = source.text("lanes/angle.h")
    found = re.search(r"RISING\[\] = {([^}]*)}", text)
    need(found is not None, "angle.h has no polynomial")
    rising = [number_of(part) for part in found[1].split(",")]  # type: ignore[index]
    (slope,) = source.numbers("lanes/angle.h", r"slope = vd_set1\((\S+?)\)")
    n, most = 24, (slope * (1 + 4 * DOUBLE)) ** 2
    told = [Fraction(1), *reversed(rising)]
    series = [Fraction((-1) ** k, 2 * k + 1) for k in range(n)]
    error = largest([(told[k] if k < len(told) else 0) - series[k] for k in range(n)], most) + most**n
    need(error < Fraction(1, 2**56), f"the polynomial errs by 2^{math.log2(error):.2f}")


@claim("rounding", "corner-angles", "mesh/normals.c", "An angle is within 2^-48 radians where sides are exact")
def corner_angles(source: Source) -> None:
    """Angles at the two ends of the longest side, from the area and products of sides, and the rest of pi.

    In units of u and of the product of two sides. The area is that of the two shortest sides, so its error is no larger
    in units of others; a vector that moves by d turns by at most d over its length.
    """
    source.says("mesh/normals.c", "vd_sub(vd_mul(u[j], v[l]), vd_mul(u[l], v[j]))", "angle_of(area, pick_widest(widest")
    source.says("mesh/normals.c", "largest = vd_sub(vd_set1(0x1.921fb54442d18p+1), vd_add(onward, back))")
    area = math.sqrt(2) + 1 + 2.5  # products, differences, and the root of a sum of three squares
    product = 3  # of three products, two sums
    tangent = math.sqrt(2) - 1
    turn = math.hypot(area, product)
    # A sum or a difference above and below, and their quotient; six roundings of what is added to q, and q's sum.
    arctangent = 3 * tangent + 6 * tangent**3 / 3 + tangent
    start = math.pi / 4 + math.pi / 2  # of a constant, and of the last sum, up to 90 degrees
    end = turn + arctangent + start + tangent / 8  # the polynomial: 2^-56 of q
    need(end * 1.001 < 2**4, f"an angle errs by {end:.2f} u")
    widest = 2 * end + 2 * math.pi / 3 + 2 * math.pi  # their sum, the constant, and the difference
    need(widest * 1.001 < 2**5, f"the largest angle errs by {widest:.2f} u")


@claim("rounding", "logarithms", "pixels/texels.c", "log2 of positive numbers within 1e-10")
def logarithms(source: Source) -> None:
    """log2 by 2 atanh(t) / ln 2, t from -(3 - sqrt 8) to 3 - sqrt 8, of texels and of gradients."""
    most = Fraction(29438, 10**6)  # above (3 - sqrt 8)^2
    need((3 - Fraction(2828427, 10**6)) ** 2 < most and Fraction(2828427, 10**6) ** 2 < 8, "t^2 is larger")
    source.says(
        "pixels/texels.c", "sum = 1.0 / 11.0;", "sum = sum * square + 1.0 / 9.0;", "t * sum * 2.8853900817779268"
    )
    source.says("grad/looks.c", "for (int k = 23; k > 0; k -= 2)")
    for last in (11, 23):
        rest = most ** (last // 2 + 1) / (last + 2) / (1 - most)  # of the series, of positive terms
        error = Fraction(29, 10) * Fraction(172, 1000) * (rest + 24 * DOUBLE) + 1100 * DOUBLE  # with the exponent
        need(error < Fraction(1, 10**10), f"a logarithm errs by 2^{math.log2(error):.2f}")


def largest(coefficients: list[Fraction], most: Fraction, n_parts: int = 16) -> Fraction:
    """A bound of the size of a polynomial from 0 to `most`: the largest of its Bernstein coefficients in each part."""
    n, width, bound = len(coefficients) - 1, most / n_parts, Fraction(0)
    for part in range(n_parts):
        moved = list(coefficients)  # to powers of the share t of the part: x = width (part + t)
        for i in range(n):
            for k in range(n - 1, i - 1, -1):
                moved[k] += width * part * moved[k + 1]
        scaled = [c * width**k / math.comb(n, k) for k, c in enumerate(moved)]
        points = (sum(math.comb(j, i) * scaled[i] for i in range(j + 1)) for j in range(n + 1))
        bound = max(bound, *map(abs, points))
    return bound


@claim("rounding", "depth", "vertex/setup.c", "steep that float64 would lose bits that float32 shows")
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
    # Slivers: z0 + (w1 (d1 / W) + w2 (d2 / W)) of rounded integers w1, w2 and W, of w1 + w2 <= W and |d| <= 2 |z|.
    source.says("sink/sink.c", "slope1 = (t->z[1] - z0) / t->w_sum", "z0 + (w1[k] * slope1 + w2[k] * slope2)")
    weighted = 2 * ((1 + u) ** 6 / (1 - u) - 1)
    need(weighted + u * (1 + weighted) <= Fraction(1, 2**35), "a depth of a sliver errs by more than 2^-35")


@claim("rounding", "weights", "pixels/weights_exact.c", "weights within 2^-36")
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


@claim("rounding", "moved-areas", "clusters/cluster_view.c", "the area by less than 4 d (lx + ly) + 8 d^2 sub-pixels^2")
def moved_areas(source: Source) -> None:
    """Twice the area of a triangle whose corners move by d in x and in y: a difference of them moves by 2 d."""
    source.says("clusters/cluster_view.c", "> 8.0 * moved * sides", "> 16.0 * moved * moved")
    for lx, ly, d in itertools.product(
        (Fraction(1), Fraction(10**6)), (Fraction(1), Fraction(7)), (Fraction(3, 4), Fraction(9))
    ):
        product = Rounded(lx, 2 * d).times(Rounded(ly, 2 * d), Fraction(0))
        told = 4 * d * (lx + ly) + 8 * d**2
        need(2 * product.error <= told, "twice the area moves by more")
        # A value above 2 p and 2 q is above p + q.
        need(2 * max(8 * d * (lx + ly), 16 * d**2) >= 2 * told, "areas that may turn are culled")


@claim("rounding", "differences", "pixels/runs.c", "rounded in float32 or first in float64")
def differences(source: Source) -> None:
    """A sum of two float32 rounded to float64, then to float32, is as rounded once (S. Figueroa, 1995)."""
    source.says("pixels/runs.c", "A float32 difference is equal whether rounded in float32 or first in float64")
    need(DOUBLE <= FLOAT**2 / 4, "float64 is too short")


@claim("gappa", "second-opinion", "raster/triangles_float.c", "M = 6 u XY", is_long=True)
def second_opinion(source: Source) -> None:
    """Main bounds by Gappa (proofs/bounds.g), where it is installed: as an independent proof, by numbers of its own."""
    if not shutil.which("gappa"):
        raise LeftOutError("gappa is not installed")
    for part in (HERE / "bounds.g").read_text(encoding="utf-8").split("----\n"):
        done = subprocess.run(["gappa"], input=part, capture_output=True, text=True)
        need(done.returncode == 0, f"{done.stderr.strip()} in {part[:60]}")
    source.says("raster/single_float.c", "M = 12 u XY")
