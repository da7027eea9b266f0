"""Values: the code of csrc computes every case."""

from __future__ import annotations

import ast
import itertools
import os
from bisect import bisect
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal, getcontext
from functools import lru_cache, partial
from typing import Any

import numpy as np
from proofs.source import Source, claim, need

values = partial(claim, "values")


def each_height(source: Source, ranges: list[tuple[int, int]]) -> None:
    """Row ends of snapped triangles for ranges of heights |dy|, by all processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda part: source.run(*part, program="rows.c"), ranges))


@values(
    "row-ends", "raster/row_edges.h", "It is computed in float32 as floor((v + 0.5) * (1 / d)), exactly", is_long=True
)
def row_ends(source: Source) -> None:
    """Row ends of snapped triangles and squares, of each height of an edge up to 62 px of 2^8."""
    n, most = 8 * (os.cpu_count() or 1), 62 * 2**8
    ends = [0, *(round(most * (i / n) ** 0.5) for i in range(1, n)), most]  # equal work
    each_height(source, [(a + 1, b + 1) for a, b in itertools.pairwise(ends)])


@values("row-ends-short", "raster/row_edges.h", "is at least 0.5 / d > 2^-15 from an integer")
def row_ends_short(source: Source) -> None:
    """Heights up to 1,000, and 16 larger ones."""
    each_height(source, [(a, a + 1) for a in range(1, 62 * 2**8 + 1, 16)][-16:] + [(1, 1000)])


@values("owners", "raster/walk.h", "these are all the axes that can separate the two")
def owners(source: Source) -> None:
    """Samples, squares and hubs of all triangles of grids of up to 9 x 9 points, by 32, 64 and 128 bits."""
    source.run(program="owners.c")


@values("bytes", "blend/mix_u8.c", "A quotient by 255 is at least 1/510 from the middle")
def all_bytes(source: Source) -> None:
    """Mixes of all bytes, alphas and coverages."""
    source.run(program="bytes.c")


@values("light", "shade/srgb.c", "value for each of the 65537 steps")
def light(source: Source) -> None:
    """The sRGB value of each step of light."""
    source.run(program="light.c")


@values("srgb-tables", "src/topleft/_core/base/color.py", "Return the light of each sRGB value, in steps")
def srgb_tables(source: Source) -> None:
    """The steps of light of 256 values and the values of 65,537 steps, beside powers of 30 digits."""
    wanted = ("LINEAR_ONE", "decode_srgb", "encode_srgb", "srgb_tables")
    tree = ast.parse("from __future__ import annotations\n" + source.lines("src/topleft/_core/base/color.py"))
    names = {id(node): getattr(node, "name", ast.unparse(node).split(" ")[0]) for node in tree.body}
    tree.body = tree.body[:1] + [node for node in tree.body if names[id(node)] in wanted]
    code: dict[str, Any] = {"np": np, "lru_cache": lru_cache}
    exec(compile(tree, "color.py", "exec"), code)
    decoded, encoded = code["srgb_tables"]()
    one = code["LINEAR_ONE"]

    def light(value: Decimal) -> Decimal:
        """The light of a value of 0 to 255, in steps: both formulas of sRGB, for both meet between steps and values."""
        srgb = value / 255
        power = ((srgb + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4")
        return one * (power if value > Decimal("10.4") else srgb / Decimal("12.92"))

    getcontext().prec, far = 30, Decimal("1e-6")
    for value, step in enumerate(decoded.tolist()):
        need(abs(light(Decimal(value)) - step) < Decimal("0.5") - far, f"the light of {value}")
    middles = [light(Decimal(value) - Decimal("0.5")) for value in range(1, 256)]
    need(all(abs(middle - round(middle)) > far for middle in middles), "a step is near a middle")
    need(encoded.tolist() == [bisect(middles, step) for step in range(one + 1)], "the sRGB value of a step")


@values("files", "pixels/png.c", "A band uses the filter, up or average")
def files(source: Source) -> None:
    """The filters of PNG for all bytes, the symbols of all lengths, and counts of masks up to 2^21, read back."""
    source.run(program="files.c")


@values("curves", "clusters/cluster_sort.c", "A number below 2^10 with two zeros between its bits")
def curves(source: Source) -> None:
    """Spread bits of all numbers of 10 and of 16 bits."""
    source.run(program="bits.c")


@values("roots", "points/cloud.c", "The largest whole number with a square of at most a, 0 <= a <= 2^60", is_long=True)
def roots(source: Source) -> None:
    """Whole roots, by the first and the last number of each."""
    source.run(program="roots.c")


@values("powers", "shade/light.c", "2^a for -126 <= a <= 127, with a relative error of 2^-22", is_long=True)
def powers(source: Source) -> None:
    """2^a for all float32 from -1/2 to 1/2, and by 256ths for other a."""
    source.run("exp2", program="functions.c")


@values("logarithms-of-light", "shade/texture.c", "log2 of positive numbers, with a", is_long=True)
def logarithms_of_light(source: Source) -> None:
    """log2 of all float32 from 2^-125 to 2^127."""
    source.run("log2", program="functions.c")


@values("unsigned", "lanes/lanes_avx2.h", "so the sum is the only rounding", is_long=True)
def unsigned(source: Source) -> None:
    """All integers of 32 bits as float32."""
    source.run("unsigned", program="functions.c")
