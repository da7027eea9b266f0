"""Many small calls from several threads, against the same calls one after another.

`python tests/support/hostile/small_calls.py --calls 1000000 --threads 8` is the long run; the tests do
the same with fewer.
"""

import argparse
import hashlib
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import topleft as tl

N_SCENES = 64
SIZE = (24, 18)


def scene(i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, triangles and colours of one of the scenes."""
    rng = np.random.default_rng(i)
    return rng.uniform(-4, 28, (30, 3)), rng.integers(0, 30, (12, 3)), rng.integers(0, 256, (12, 3), dtype=np.uint8)


SCENES = [scene(i) for i in range(N_SCENES)]


def call(i: int, rasterizer: tl.Rasterizer | None = None) -> bytes:
    """Draw one of the scenes by one of the verbs; a hash of what comes back."""
    vertices, triangles, colors = SCENES[i % N_SCENES]
    arrays, verbs = (vertices, triangles), tl if rasterizer is None else rasterizer
    size = () if rasterizer else (SIZE,)
    match i // N_SCENES % 6:
        case 0:
            made = [verbs.coverage(*arrays, *size)]
        case 1:
            made = [verbs.overdraw(*arrays, *size, sampling="msaa4")]
        case 2:
            made = [verbs.fill(*arrays, colors, *size, per="triangle")]
        case 3:
            made = [verbs.coverage(*arrays, *size, sampling="area")]
        case 4:
            made = [verbs.wireframe(*arrays, *size)]
        case _:
            frags = verbs.rasterize(*arrays, *size)
            made = [frags.triangle, frags.depth, frags.barycentric()]
    return hashlib.blake2b(b"".join(each.tobytes() for each in made), digest_size=8).digest()


def differing(n_calls: int, n_threads: int) -> int:
    """Return how many calls of several threads give something else than the same call alone."""
    expected = [call(i) for i in range(6 * N_SCENES)]

    def draw(first: int) -> int:
        own = tl.Rasterizer(SIZE, threads=1)
        numbers = range(first, n_calls, n_threads)
        return sum(call(i, own if i % 3 == 0 else None) != expected[i % len(expected)] for i in numbers)

    with ThreadPoolExecutor(n_threads) as pool:
        return sum(pool.map(draw, range(n_threads)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--calls", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=8)
    options = parser.parse_args()
    start = time.monotonic()
    n = differing(options.calls, options.threads)
    whose = f"{options.calls:,} calls of {options.threads} threads"
    print(f"{n} of {whose} differ from the same call alone; {time.monotonic() - start:.0f} s")
    return n > 0


if __name__ == "__main__":
    sys.exit(main())
