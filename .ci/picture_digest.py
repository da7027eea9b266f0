"""Print a hash of the buffers that each verb makes of seeded scenes: every build has to print the same lines."""

import hashlib
from collections.abc import Iterator

import numpy as np

import topleft as tl

SIZE = (193, 131)
METHODS = ("edge", "scanline", "auto")


def scenes() -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield name, vertices and triangles: pixel space of all sizes, far outside the frame, cut by the near plane."""
    rng = np.random.default_rng(20240607)
    sizes = (("small", 4.0, 3000), ("large", 90.0, 200), ("huge", 1e5, 60), ("wide", 1e12, 40))
    for name, extent, n_triangles in sizes:
        centres = rng.uniform(0, SIZE[0], (n_triangles, 1, 3))
        vertices = (centres + rng.uniform(-extent, extent, (n_triangles, 3, 3))).reshape(-1, 3)
        yield name, vertices, np.arange(3 * n_triangles).reshape(-1, 3)
        yield name + "32", vertices.astype(np.float32), np.arange(3 * n_triangles).reshape(-1, 3)
    vertices = rng.normal(0, 1, (600, 4)) * [1, 1, 1, 0.7] + [0, 0, 0, 0.4]
    yield "clip", vertices, np.arange(600).reshape(-1, 3)


def buffers(vertices: np.ndarray, triangles: np.ndarray, method: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and contents of every kind of buffer."""
    rng = np.random.default_rng(1)
    yield "coverage", tl.coverage(vertices, triangles, SIZE, method=method)
    yield "overdraw", tl.overdraw(vertices, triangles, SIZE, method=method)
    colors = rng.integers(0, 256, (len(vertices), 3), dtype=np.uint8)
    yield "fill uint8", tl.fill(vertices, triangles, colors, SIZE, per="vertex", method=method)
    colors = rng.uniform(0, 1, (len(vertices), 4)).astype(np.float32)
    yield "fill float32", tl.fill(vertices, triangles, colors, SIZE, per="vertex", method=method)
    for depth_test in ("less", "greater", None):
        fragments = tl.rasterize(vertices, triangles, SIZE, depth_test=depth_test, method=method)
        yield f"triangle {depth_test}", fragments.triangle
        yield f"depth {depth_test}", fragments.depth
        yield f"barycentric {depth_test}", fragments.barycentric()
        yield f"interpolate {depth_test}", fragments.interpolate(colors)


def main() -> None:
    total = hashlib.sha256()
    for scene, vertices, triangles in scenes():
        kinds: dict[str, set[str]] = {}
        for method in METHODS:
            for kind, buffer in buffers(vertices, triangles, method):
                kinds.setdefault(kind, set()).add(hashlib.sha256(np.ascontiguousarray(buffer)).hexdigest()[:16])
        for kind, digests in kinds.items():
            print(scene, kind, *sorted(digests), sep="\t")
            total.update(" ".join((scene, kind, *sorted(digests))).encode())
            if len(digests) > 1:
                raise SystemExit(f"{scene}, {kind}: the methods differ")
    print("total", total.hexdigest()[:16])


if __name__ == "__main__":
    main()
