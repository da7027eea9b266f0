"""Logic: z3 finds no counterexample among all integers."""

from __future__ import annotations

import z3
from proofs.source import Source, claim, need


def prove(claim: z3.BoolRef, text: str) -> None:
    """Raise an error unless a claim holds for all values of its variables."""
    solver = z3.Solver()
    solver.add(z3.Not(claim))
    found = solver.check()
    need(found == z3.unsat, f"{text}: {solver.model() if found == z3.sat else found}")


def top_left(dx: z3.ArithRef, dy: z3.ArithRef) -> z3.BoolRef:
    """Whether an edge owns the samples on it, as the code has it."""
    return z3.Or(dy < 0, z3.And(dy == 0, dx > 0))


@claim("logic", "bias", "raster/triangles_fixed.c", "left: dy < 0, top: dy = 0 and dx > 0; as one number")
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


Numbers = z3.ArithRef | int
Point = tuple[Numbers, Numbers]


def edge_function(a: Point, b: Point, p: Point) -> z3.ArithRef:
    """E of the edge from a to b at p; positive inside, for y runs down and areas are positive."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


@claim("logic", "one-owner", "vertex/fixed.h", "edge functions are evaluated doubled")
def one_owner(source: Source) -> None:
    """Of the two triangles on either side of an edge exactly one owns a sample on it, and none if it lies outside.

    The rule (docs/design/rules.md): E > 0 on all edges, or E = 0 on an edge that is top, exactly horizontal with the
    interior below, or left, not horizontal with the interior to its right.
    """
    source.says("vertex/fixed.h", "2E = dx * (2py - 2ay) - dy * (2px - 2ax)")
    ax, ay, bx, by, px, py = z3.Ints("ax ay bx by px py")
    a, b, p = (ax, ay), (bx, by), (px, py)

    def owns(a: Point, b: Point) -> z3.BoolRef:
        e = edge_function(a, b, p)
        return z3.Or(e > 0, z3.And(e == 0, top_left(b[0] - a[0], b[1] - a[1])))

    is_edge = z3.Or(ax != bx, ay != by)
    below, right = (ax, ay + 1), (ax + 1, ay)  # on which side the interior lies is where E > 0
    is_top = z3.And(ay == by, edge_function(a, b, below) > 0)
    is_left = z3.And(ay != by, edge_function(a, b, right) > 0)
    prove(z3.Implies(is_edge, top_left(bx - ax, by - ay) == z3.Or(is_top, is_left)), "top and left by the rule")
    prove(z3.Implies(is_edge, z3.Xor(owns(a, b), owns(b, a))), "one owner of an edge")
    # Between its ends, at a share t, the other two edges of a triangle (a, b, c) are positive: so its edge decides.
    ax, ay, bx, by, cx, cy, t = z3.Reals("ax ay bx by cx cy t")
    a, b, c, p = (ax, ay), (bx, by), (cx, cy), (ax + t * (bx - ax), ay + t * (by - ay))
    area = edge_function(a, b, c)
    both = z3.And(edge_function(b, c, p) == (1 - t) * area, edge_function(c, a, p) == t * area)
    prove(z3.And(both, edge_function(a, b, p) == 0), "the other edges of a triangle")


@claim("logic", "one-owner-of-a-hub", "vertex/fixed.h", "edge functions are evaluated doubled")
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


@claim("logic", "products", "base/integers.h", "by halves of 32 bits: no sum of them reaches 2^64")
def products(source: Source) -> None:
    """The product of two words by halves, of a signed word, and the steps of a long division."""
    name, half, word = "base/integers.h", 2**32, 2**64
    source.says(name, "middle = a1 * b0 + (a0 * b0 >> 32), other = a0 * b1 + (middle & half)", "(b < 0 ? a.low : 0)")
    source.says(name, "a1 * b1 + (middle >> 32) + (other >> 32)", "r < b < 2^127, so 2 r < 2^128")
    low, mid, cross, high = parts = z3.Ints("low mid cross high")  # a0 b0, a1 b0, a0 b1, a1 b1
    are_products = z3.And([z3.And(part >= 0, part <= (half - 1) ** 2) for part in parts])
    middle = mid + low / half
    other = cross + middle % half
    upper, lower = high + middle / half + other / half, (other % half) * half + low % half
    whole = high * word + (mid + cross) * half + low
    told = z3.And(middle < word, other < word, upper * word + lower == whole, lower < word)
    prove(z3.Implies(are_products, told), "a product by halves")
    # (a + 2^64 h) (b - 2^64 s) modulo 2^128, of unsigned words a and b and the sign s of b
    a, h, b, s = z3.Ints("a h b s")
    left_out = word * word * h * s
    prove(
        (a + word * h) * (b - word * s) == a * b + word * (h * b - s * a) - left_out, "a product with a negative word"
    )
    r, divisor, bit, q = z3.Ints("r divisor bit q")
    is_step = z3.And(0 <= r, r < divisor, divisor < 2**127, 0 <= bit, bit <= 1)
    twice = 2 * r + bit
    told = z3.And(twice < 2**128, z3.If(twice >= divisor, twice - divisor, twice) < divisor)
    prove(z3.Implies(is_step, told), "a step of a division")
    prove(-(q * divisor + r) - 1 == (-q - 1) * divisor + (divisor - 1 - r), "a negative dividend")


@claim("logic", "counts", "kernels.h", "at most 13 characters a count")
def counts(source: Source) -> None:
    """Counts as text: five bits a character, until the rest is 0 or -1 as the last character's sign has it."""
    source.says("pixels/rle.c", "const int bits = (int)(x & 31)", "is_more = bits & 16 ? x != -1 : x != 0")
    x = z3.BitVec("x", 64)
    bits, rest = x & 31, x >> 5  # z3 shifts in the sign
    is_last = z3.If(bits & 16 != 0, rest == -1, rest == 0)
    prove(z3.Implies(is_last, z3.If(bits & 16 != 0, bits - 32, bits) == x), "the last character of a count")
    prove((rest << 5) + bits == x, "a character of a count")
    thirteenth = x >> 60
    prove(z3.If(thirteenth & 16 != 0, thirteenth >> 5 == -1, thirteenth >> 5 == 0), "a count of 14 characters")


@claim("logic", "averages", "pixels/resolve.c", "Turns two sums of up to 2^4 bytes, 16 bits apart, into their means")
def averages(source: Source) -> None:
    """Means of 2 to 16 bytes, to nearest, ties to even, in pairs; one by one the formula is equal."""
    code = "half = vi_set1(0x00010001 * ((1 << sample_bits >> 1) - 1))"
    source.says(
        "pixels/resolve.c", code, "vi_add(vi_add(sums, half), is_odd)", "(sum + half - 1 + is_odd) >> sample_bits"
    )
    sums = z3.BitVec("sums", 32)
    for bits in range(1, 5):
        n = 1 << bits
        is_sum = z3.And([z3.ULE(z3.LShR(sums, shift) & 0xFFFF, 255 * n) for shift in (0, 16)])
        means = z3.LShR(sums + 0x10001 * (n // 2 - 1) + (z3.LShR(sums, bits) & 0x10001), bits) & 0xFF00FF
        for shift in (0, 16):
            sum_of, mean = (z3.LShR(both, shift) & 0xFFFF for both in (sums, means))
            twice = 2 * (sum_of - mean * n)  # twice the rest
            told = z3.And(twice <= n, twice >= -n, z3.Implies(z3.Or(twice == n, twice == -n), mean & 1 == 0))
            prove(z3.Implies(is_sum, told), f"a mean of {n} bytes")
