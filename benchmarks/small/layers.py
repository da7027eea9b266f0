"""Time each layer of a view beside its picture: a mesh of 70,000 triangles at 512x512, shaded, on one thread.

    python -m benchmarks.small.layers [--rounds N]

Every round asks for each layer alone, so the visibility buffer is drawn for each of them; the fastest and the median
round are printed, and the median over that of the picture.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

SIZE = (512, 512)
N_TRIANGLES = 70_000
N_ROUNDS = 40


def contestants() -> dict[str, Callable[[], object]]:
    """A call for each layer, the picture first."""
    import topleft as tl
    from topleft._render.layers import LAYERS

    vertices, triangles = tl.scenes.blob(N_TRIANGLES)
    uv = np.random.default_rng(0).random((len(vertices), 2), np.float32)
    mesh = tl.Mesh(vertices, triangles, uv=uv)
    camera = tl.Camera.framing(mesh, aspect=1.0)
    end = replace(camera, view=tl.Camera.framing(mesh, aspect=1.0, azimuth_deg=40).view)
    rasterizer = tl.Rasterizer(SIZE, threads=1)
    options = {"cull": "back", "threads": 1, "rasterizer": rasterizer, "camera_to": end}
    made: dict[str, Callable[[], object]] = {
        name: lambda name=name: tl.render_layers(mesh, camera, SIZE, layers=(name,), **options) for name in LAYERS
    }
    values = vertices.astype(np.float32)
    made["attribute of 3"] = lambda: tl.render_layers(
        mesh, camera, SIZE, layers=(), attributes={"own": values}, **options
    )
    return made


def measure(draws: dict[str, Callable[[], object]], n_rounds: int) -> dict[str, list[float]]:
    """Milliseconds of each call, round by round; one round is not counted."""
    times: dict[str, list[float]] = {name: [] for name in draws}
    for k in range(n_rounds + 1):
        for name, draw in draws.items():
            start = time.perf_counter()
            draw()
            if k:
                times[name].append(1e3 * (time.perf_counter() - start))
    return times


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.small.layers", description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    times = measure(contestants(), parser.parse_args().rounds)
    shaded = statistics.median(times["color"])
    print("| layer | fastest, ms | median, ms | over the picture |\n|---|---|---|---|")
    for name, own in times.items():
        median = statistics.median(own)
        print(f"| {name} | {min(own):.2f} | {median:.2f} | {median / shaded:.2f} |")


if __name__ == "__main__":
    main()
