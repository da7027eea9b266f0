"""A yardstick: how long `memset` takes for the bytes of the 4K pictures. `python -m benchmarks.small.memset`."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from benchmarks.scenes.cases import UHD

BYTES = {"large-4k": 1, "fill-4k": 4}
"""A pixel, by case."""


def main(n_calls: int = 60) -> None:
    """Print the shortest of many calls for each case."""
    for case, n_bytes in BYTES.items():
        memory = np.zeros(UHD[0] * UHD[1] * n_bytes, np.uint8)
        times = []
        for _ in range(n_calls):
            start = perf_counter()
            memory.fill(1)
            times.append(perf_counter() - start)
        print(f"{case}: {1e3 * min(times):.4f} ms")


if __name__ == "__main__":
    main()
