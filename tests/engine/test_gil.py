"""Large work lets other threads run; small work keeps the GIL, for to take it back costs more than the work.

As a program: draws small scenes, then a large one, and prints how often another thread ran meanwhile.
"""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import topleft as tl

VERTICES, TRIANGLES = np.random.default_rng(1).uniform(0, 1, (60, 3)), np.arange(60).reshape(-1, 3)
VIEWED, IN_PIXELS, FLAT = VERTICES.astype(np.float32), 64 * VERTICES, 64 * VERTICES[:, :2]
UNIT = np.eye(4)


def draw_small(kept):
    """Nothing but topleft: NumPy lets go of the GIL now and then."""
    for _ in range(20):
        kept.rasterize(IN_PIXELS, TRIANGLES)
        kept.rasterize(VIEWED, TRIANGLES, transform=UNIT)
        kept.coverage(FLAT, TRIANGLES)


def draw_large(kept, has_run):
    vertices, triangles = tl.scenes.blob(100_000)
    for _ in range(1000):
        kept.rasterize(vertices, triangles, transform=np.diag([0.5, 0.5, 0.5, 1]))
        if has_run():
            break


def main():
    """Another thread runs whenever the GIL is let go of, and at no other time."""
    turns, end = [0], threading.Event()

    def run():
        while not end.is_set():
            turns[0] += 1
            time.sleep(0)

    small, large = tl.Rasterizer((64, 64), threads=1), tl.Rasterizer((1000, 1000), threads=1)
    sys.setswitchinterval(1000.0)  # nobody is made to let go of it
    thread = threading.Thread(target=run)
    thread.start()
    draw_small(small)
    before = turns[0]
    draw_small(small)
    while_small = turns[0] - before
    before += while_small
    draw_large(large, lambda: turns[0] != before)
    print(while_small, turns[0] != before)
    end.set()
    sys.setswitchinterval(0.005)
    thread.join()


@pytest.mark.skipif(not getattr(sys, "_is_gil_enabled", lambda: True)(), reason="there is no GIL")
def test_small_work_keeps_the_gil_and_large_work_does_not():
    run = subprocess.run([sys.executable, __file__], capture_output=True, text=True, check=True)
    assert run.stdout == "0 True\n"


if __name__ == "__main__":
    main()
