"""Huge rasters: 20,000,000 triangles to 40,000 x 40,000 labels, with the mesh in mapped files; beside other programs.

`python -m benchmarks tiles` draws a planar mesh window by window and throws the windows away, writes it as uncompressed
Zarr, and draws one window of 4096 x 4096 with `rasterize` in memory as a yardstick. `--peers` sets 2,000,000 triangles
at 10,000 x 10,000 beside rasterio (GDAL) and datashader, each in a process of its own. Memory is the largest resident
size of the process, mapped files included.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study

WINDOW, ONE = 2048, 4096
WAYS = ("windows", "zarr", "one window")
PEERS = ("topleft", "rasterio", "datashader")


def write_mesh(folder: Path, n_triangles: int, side: int) -> None:
    """Write a planar mesh, a grid whose points are moved by up to 0.3 of its step, as two .npy files, in blocks."""
    n = max(1, round((n_triangles / 2) ** 0.5))
    step = side / n
    vertices = np.lib.format.open_memmap(folder / "v.npy", "w+", np.float64, ((n + 1) ** 2, 2))
    triangles = np.lib.format.open_memmap(folder / "t.npy", "w+", np.int32, (2 * n * n, 3))
    rng = np.random.default_rng(1)
    for row in range(n + 1):
        at = slice(row * (n + 1), (row + 1) * (n + 1))
        vertices[at, 0] = step * (np.arange(n + 1) + rng.uniform(-0.3, 0.3, n + 1))
        vertices[at, 1] = step * (row + rng.uniform(-0.3, 0.3, n + 1))
    corner = np.arange(n)
    for row in range(n):
        a = row * (n + 1) + corner
        quads = np.stack([a, a + 1, a + n + 2, a, a + n + 2, a + n + 1], axis=1)
        triangles[2 * n * row : 2 * n * (row + 1)] = quads.reshape(-1, 3)
    vertices.flush()
    triangles.flush()


def mesh_of(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    return np.load(folder / "v.npy", mmap_mode="r"), np.load(folder / "t.npy", mmap_mode="r")


def draw_windows(folder: Path, side: int) -> dict[str, float]:
    """Draw all windows and throw them away."""
    import topleft as tl

    raster = tl.tiles(mesh_of(folder), (side, side), window=WINDOW)
    begin = time.perf_counter()
    n_spans = raster.index.n_spans
    index_s = time.perf_counter() - begin
    for window in raster.windows(reuse=True):
        assert window.pixels[0, 0] >= -1
    return {"seconds": time.perf_counter() - begin, "index_s": index_s, "spans": n_spans}


def write_zarr(folder: Path, side: int) -> dict[str, float]:
    """Write all windows as uncompressed Zarr."""
    import topleft as tl

    begin = time.perf_counter()
    tl.tiles(mesh_of(folder), (side, side), window=WINDOW).to_zarr(folder / "labels.zarr", compression="none")
    seconds = time.perf_counter() - begin
    n_bytes = sum(path.stat().st_size for path in (folder / "labels.zarr").rglob("*") if path.is_file())
    shutil.rmtree(folder / "labels.zarr")
    return {"seconds": seconds, "bytes": n_bytes}


def draw_one(folder: Path, side: int) -> dict[str, float]:
    """Draw the first window by `rasterize`, of the triangles in it alone; the fastest of five."""
    import topleft as tl

    vertices, triangles = mesh_of(folder)
    n = round((len(triangles) / 2) ** 0.5)
    edge = min(side, ONE)
    n_rows = min(n, int(edge / side * n) + 2)
    rows = np.array(triangles[: 2 * n * n_rows]).reshape(n_rows, n, 2, 3)[:, :n_rows].reshape(-1, 3)
    used, index = np.unique(rows, return_inverse=True)
    points, own = np.array(vertices[used]), index.reshape(-1, 3).astype(np.int32)
    ids = np.empty((edge, edge), np.int32)
    best = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        tl.rasterize(points, own, edge, out=(ids, None))
        best = min(best, time.perf_counter() - begin)
    return {"seconds": best, "pixels": edge * edge}


def topleft_labels(vertices: np.ndarray, triangles: np.ndarray, side: int) -> np.ndarray:
    import topleft as tl

    return tl.tiles((vertices, triangles), (side, side), window=WINDOW, depth_test=None)[:]


def rasterio_labels(vertices: np.ndarray, triangles: np.ndarray, side: int) -> np.ndarray:
    from rasterio.features import rasterize

    corners = vertices[triangles[:, [0, 1, 2, 0]]].tolist()
    shapes = (({"type": "Polygon", "coordinates": [ring]}, i) for i, ring in enumerate(corners))
    return rasterize(shapes, (side, side), fill=-1, dtype="int32")


def datashader_labels(vertices: np.ndarray, triangles: np.ndarray, side: int) -> np.ndarray:
    import datashader
    import pandas as pd

    points = pd.DataFrame({"x": vertices[:, 0], "y": vertices[:, 1]})
    simplices = pd.DataFrame(triangles, columns=["a", "b", "c"])
    simplices["label"] = np.arange(len(triangles), dtype=np.float64)
    canvas = datashader.Canvas(side, side, (0, side), (0, side))
    found = canvas.trimesh(points, simplices, interpolate="nearest", agg=datashader.max("label"))
    return np.nan_to_num(found.values, nan=-1).astype(np.int32)


DRAWN: dict[str, Callable[[np.ndarray, np.ndarray, int], np.ndarray]] = {
    "topleft": topleft_labels, "rasterio": rasterio_labels, "datashader": datashader_labels,
}  # fmt: skip


def draw_peer(name: str, folder: Path, side: int) -> dict[str, float]:
    """Draw with one program, and count the pixels that differ from the exact rule."""
    vertices, triangles = map(np.array, mesh_of(folder))
    DRAWN[name](vertices, triangles[:1], 64)  # imports, and what compiles at its first call
    begin = time.perf_counter()
    labels = DRAWN[name](vertices, triangles, side)
    seconds = time.perf_counter() - begin
    peak = peak_bytes()
    wrong = 0
    if name != "topleft":
        for window in exact_windows(folder, side):
            wrong += int((labels[window.slices] != window.pixels).sum())
    return {"seconds": seconds, "wrong": wrong, "bytes_at_peak": peak}


def exact_windows(folder: Path, side: int) -> Any:
    import topleft as tl

    return tl.tiles(mesh_of(folder), (side, side), window=WINDOW, depth_test=None, subpixel_bits=16)


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


MEASURED: dict[str, Callable[[Path, int], dict[str, float]]] = {
    "windows": draw_windows, "zarr": write_zarr, "one window": draw_one,
}  # fmt: skip


def in_process(way: str, folder: Path, side: int) -> dict[str, float]:
    """Measure one way in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.small.tiles", way, str(folder), str(side)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"error": 1.0, "said": done.stderr.strip().splitlines()[-1]}  # type: ignore[dict-item]
    return json.loads(done.stdout)


def predict(folder: Path, side: int, n_triangles: int) -> dict[str, dict[str, float]]:
    """Unit costs of an eighth of the work, what they say of the whole, and what that takes; the fastest of three."""
    small, large = folder / "small", folder / "large"
    eighth = round(side / 8**0.5)
    for place, n, length in ((small, n_triangles // 8, eighth), (large, n_triangles, side)):
        place.mkdir()
        write_mesh(place, n, length)
    rounds = [(draw_windows(small, eighth), draw_windows(large, side)) for _ in range(3)]
    one, all_of = ({key: min(row[key] for row in rows) for key in rows[0]} for rows in zip(*rounds, strict=True))
    per_triangle = one["index_s"] / len(mesh_of(small)[1])
    per_pixel = (one["seconds"] - one["index_s"]) / eighth**2
    said = per_triangle * len(mesh_of(large)[1]) + per_pixel * side**2
    costs = {"seconds": one["seconds"], "pixels": eighth**2, "index_ns": 1e9 * per_triangle, "draw_ns": 1e9 * per_pixel}
    return {
        "an eighth": costs,
        "predicted": {"seconds": said, "pixels": side**2},
        "measured": {"seconds": all_of["seconds"], "pixels": side**2, "bytes_at_peak": peak_bytes()},
    }


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Make the mesh and measure."""
    rows: dict[str, dict[str, float]] = {}
    if arguments.predict:
        with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
            rows = predict(Path(name), arguments.side, arguments.triangles)
        return {"kind": "tiles", "triangles": arguments.triangles, "side": arguments.side, "rows": rows, **describe()}
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
        folder, side = Path(name), arguments.side
        write_mesh(folder, arguments.triangles, side)
        n_triangles = len(mesh_of(folder)[1])
        for way in PEERS if arguments.peers else WAYS:
            rows[way] = in_process(way, folder, side)
    about = describe("rasterio", "datashader")
    return {"kind": "tiles", "triangles": n_triangles, "side": side, "rows": rows, **about}


def lines(record: Record) -> list[str]:
    """A table: seconds, pixels a second, memory."""
    side = record["side"]
    made = [f"{record['triangles']:,} triangles, {side:,} x {side:,} px, int32 labels", ""]
    made += ["| | seconds | Mpx/s | peak memory, GB | |", "|---|---:|---:|---:|---|"]
    for way, row in record["rows"].items():
        if "seconds" not in row:
            made.append(f"| {way} | - | - | - | {row['said']} |")
            continue
        rate = row.get("pixels", side * side) / row["seconds"] / 1e6
        peak = row.get("bytes_at_peak", 0) / 1e9
        more = [f"index {row['index_s']:.1f} s, {row['spans']:,} spans"] if "index_s" in row else []
        more += [f"{row['bytes'] / 1e9:.1f} GB written"] if "bytes" in row else []
        if "index_ns" in row:
            more.append(f"{row['index_ns']:.0f} ns a triangle, {row['draw_ns']:.1f} ns a pixel")
        more += [f"{row['wrong']:,} pixels differ"] if row.get("wrong") else []
        made.append(f"| {way} | {row['seconds']:.2f} | {rate:.0f} | {peak:.2f} | {', '.join(more)} |")
    return made


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--triangles", type=int, default=20_000_000, metavar="N", help="about so many (%(default)s)")
    parser.add_argument("--side", type=int, default=40_000, metavar="N", help="of the raster, pixels (%(default)s)")
    parser.add_argument("--peers", action="store_true", help="beside other programs, the raster as a whole in memory")
    parser.add_argument("--predict", action="store_true", help="measure an eighth of the work, and check what it says")
    parser.add_argument("--folder", metavar="DIR", help="where mesh and store go for the time (the system's)")


STUDY = Study("tiles", "huge rasters by windows: time and memory", add_arguments, run, lines)

if __name__ == "__main__":  # one way, in a process of its own
    way, place, length = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    found = MEASURED[way](place, length) if way in MEASURED else draw_peer(way, place, length)
    print(json.dumps({"bytes_at_peak": peak_bytes(), **found}))
