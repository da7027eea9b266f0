"""A yardstick: how long `memset` takes for the bytes of the 4K pictures. `python -m benchmarks memset`."""

from __future__ import annotations

import argparse
from functools import partial
from time import perf_counter

import numpy as np

from benchmarks.harness.records import Record, Save
from benchmarks.harness.ways import least_ms
from benchmarks.report.study import Study
from benchmarks.scenes.cases import UHD

BYTES = {"large-4k": 1, "fill-4k": 4}
"""A pixel, by case."""


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure the shortest of many calls for each case."""
    shortest = {}
    for case, n_bytes in BYTES.items():
        memory = np.zeros(UHD[0] * UHD[1] * n_bytes, np.uint8)
        shortest[case] = least_ms(partial(memory.fill, 1), arguments.seconds, perf_counter)
    return {"kind": "memset", "ms": shortest}


def lines(record: Record) -> list[str]:
    """The line for the pattern of a yardstick."""
    return [f"{case}: {ms:.4f} ms" for case, ms in record["ms"].items()]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seconds", type=float, default=0.2, metavar="S", help="of each case (%(default)s)")


STUDY = Study("memset", "a yardstick: how long memset takes for the 4K pictures", add_arguments, run, lines)
