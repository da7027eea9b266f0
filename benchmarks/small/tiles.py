"""Huge rasters: 20,000,000 triangles to 40,000 x 40,000 labels, with the mesh in mapped files; beside other programs.

`python -m benchmarks tiles` draws a planar mesh window by window and throws the windows away, writes it as uncompressed
Zarr, and draws one window of 4096 x 4096 with `rasterize` in memory as a yardstick. `--peers` sets 2,000,000 triangles
at 10,000 x 10,000 beside rasterio, GDAL's own program and datashader with and without Dask, each in a process of its
own. Memory is the largest resident size of the process, mapped files included.
"""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, option, switch
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study

WINDOW, ONE = 2048, 4096
TURNS = 5
WAYS = ("windows", "zarr", "one window")
PEERS = ("topleft", "topleft, exact", "rasterio", "gdal_rasterize", "datashader", "datashader, Dask")


def write_mesh(folder: Path, n_triangles: int, side: int) -> None:
    """Write a planar mesh, a grid with points moved by up to 0.3 of its step, as two .npy files, in blocks."""
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
    begin, begin_cpu = time.perf_counter(), time.process_time()
    n_spans = raster.index.n_spans
    index_s, index_cpu_s = time.perf_counter() - begin, time.process_time() - begin_cpu
    for window in raster.windows(reuse=True):
        assert window.pixels[0, 0] >= -1
    seconds, cpu_s = time.perf_counter() - begin, time.process_time() - begin_cpu
    return {"seconds": seconds, "index_s": index_s, "spans": n_spans, "all_cpu_s": cpu_s, "index_cpu_s": index_cpu_s}


def write_zarr(folder: Path, side: int) -> dict[str, float]:
    """Write all windows as uncompressed Zarr."""
    import topleft as tl

    begin = time.perf_counter()
    tl.tiles(mesh_of(folder), (side, side), window=WINDOW).to_zarr(folder / "labels.zarr", compression="none")
    seconds = time.perf_counter() - begin
    n_bytes = sum(path.stat().st_size for path in (folder / "labels.zarr").rglob("*") if path.is_file())
    shutil.rmtree(folder / "labels.zarr")
    return {"seconds": seconds, "bytes": n_bytes}


def one_window(folder: Path, side: int) -> Callable[[], None]:
    """Return a draw of a window of 4096 x 4096 in memory by `rasterize`: of its triangles alone, into one array."""
    import topleft as tl

    vertices, triangles = mesh_of(folder)
    n = round((len(triangles) / 2) ** 0.5)
    edge = min(side, ONE)
    n_rows = min(n, int(edge / side * n) + 2)
    rows = np.array(triangles[: 2 * n * n_rows]).reshape(n_rows, n, 2, 3)[:, :n_rows].reshape(-1, 3)
    used, index = np.unique(rows, return_inverse=True)
    points, own = np.array(vertices[used]), index.reshape(-1, 3).astype(np.int32)
    ids = np.empty((edge, edge), np.int32)
    return lambda: tl.rasterize(points, own, edge, out=(ids, None)) and None


def draw_in_turns(folder: Path, side: int) -> dict[str, float]:
    """Draw one window, all windows, one window, ...: seconds, CPU seconds, and the ratios of the rates of pixels."""
    draw, n_pixels = one_window(folder, side), min(side, ONE) ** 2
    draw()
    turns = []
    for _ in range(TURNS):
        one = [timed(draw) for _ in range(8)]
        every = timed(lambda: draw_windows(folder, side))
        one = np.median([*one, *(timed(draw) for _ in range(8))], axis=0)
        turns.append([*one, *every, *(one / n_pixels / (np.array(every) / side**2))])
    seconds, cpu_s, run_s, run_cpu_s, ratio, cpu_ratio = np.median(turns, axis=0).tolist()
    return {
        "seconds": seconds, "pixels": n_pixels, "cpu_s": cpu_s, "run_s": run_s, "run_cpu_s": run_cpu_s,
        "ratio": ratio, "cpu_ratio": cpu_ratio,
    }  # fmt: skip


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds, and CPU seconds of all threads."""
    begin, begin_cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - begin, time.process_time() - begin_cpu


def topleft_labels(vertices: np.ndarray, triangles: np.ndarray, side: int, **options: Any) -> np.ndarray:
    import topleft as tl

    return tl.tiles((vertices, triangles), (side, side), window=WINDOW, depth_test=None, **options)[:]


def rasterio_labels(vertices: np.ndarray, triangles: np.ndarray, side: int) -> np.ndarray:
    from rasterio.features import rasterize

    corners = vertices[triangles[:, [0, 1, 2, 0]]].tolist()
    shapes = (({"type": "Polygon", "coordinates": [ring]}, i) for i, ring in enumerate(corners))
    return rasterize(shapes, (side, side), fill=-1, dtype="int32")


def write_flatgeobuf(path: Path, vertices: np.ndarray, triangles: np.ndarray, side: int) -> None:
    """Write triangles as polygons with their labels, y up as GDAL has it."""
    from pyogrio.raw import write

    ring = [("head", "u1"), ("kind", "<u4"), ("n_rings", "<u4"), ("n", "<u4"), ("points", "<f8", (4, 2))]
    rows = np.zeros(len(triangles), ring)
    rows["head"], rows["kind"], rows["n_rings"], rows["n"] = 1, 3, 1, 4
    rows["points"] = vertices[triangles[:, [0, 1, 2, 0]]] * (1, -1) + (0, side)
    content, step = rows.tobytes(), rows.dtype.itemsize
    polygons = np.array([content[i : i + step] for i in range(0, len(content), step)], object)
    labels = np.arange(len(triangles), dtype=np.int32)
    write(str(path), polygons, [labels], ["label"], geometry_type="Polygon", driver="FlatGeobuf", SPATIAL_INDEX="NO")


def gdal_labels(vertices: np.ndarray, triangles: np.ndarray, side: int) -> np.ndarray:
    """Run gdal_rasterize, from a file of polygons to one of pixels: making the first is no part of its time."""
    import tifffile

    with tempfile.TemporaryDirectory() as name:
        polygons, pixels = Path(name, "polygons.fgb"), Path(name, "labels.tif")
        write_flatgeobuf(polygons, vertices, triangles, side)
        how = ["-q", "-a", "label", "-init", "-1", "-ot", "Int32", "-te", "0", "0", str(side), str(side)]
        begin = time.perf_counter()
        subprocess.run(["gdal_rasterize", *how, "-ts", str(side), str(side), str(polygons), str(pixels)], check=True)
        OWN_TIME["gdal_rasterize"] = time.perf_counter() - begin
        return tifffile.imread(pixels)


def datashader_labels(vertices: np.ndarray, triangles: np.ndarray, side: int, n_parts: int = 0) -> np.ndarray:
    import datashader
    import pandas as pd

    points = pd.DataFrame({"x": vertices[:, 0], "y": vertices[:, 1]})
    simplices = pd.DataFrame(triangles, columns=["a", "b", "c"])
    simplices["label"] = np.arange(len(triangles), dtype=np.float64)
    canvas = datashader.Canvas(side, side, (0, side), (0, side))
    mesh = None
    if n_parts:  # rows of corners, turned as datashader draws them, in partitions of whole triangles
        import dask.dataframe as dd
        from datashader.utils import mesh as mesh_of_tables

        corners = mesh_of_tables(points, simplices)
        mesh = dd.from_pandas(corners, chunksize=3 * -(-len(triangles) // n_parts), sort=False)
    found = canvas.trimesh(points, simplices, mesh=mesh, interpolate="nearest", agg=datashader.max("label"))
    return np.nan_to_num(found.values, nan=-1).astype(np.int32)


DRAWN: dict[str, Callable[[np.ndarray, np.ndarray, int], np.ndarray]] = {
    "topleft": topleft_labels, "topleft, exact": partial(topleft_labels, subpixel_bits="exact"),
    "rasterio": rasterio_labels, "gdal_rasterize": gdal_labels, "datashader": datashader_labels,
    "datashader, Dask": partial(datashader_labels, n_parts=4),
}  # fmt: skip

#: The time of a program by itself, where making its input is no part of its time.
OWN_TIME: dict[str, float] = {}


def draw_peer(name: str, folder: Path, side: int) -> dict[str, float]:
    """Draw with one program, and count the pixels that differ from the exact rule."""
    vertices, triangles = map(np.array, mesh_of(folder))
    DRAWN[name](vertices, triangles[:4], 64)  # imports, and compilation at the first call
    begin = time.perf_counter()
    labels = DRAWN[name](vertices, triangles, side)
    seconds = OWN_TIME.get(name, time.perf_counter() - begin)
    peak = peak_bytes(children=name in OWN_TIME)
    wrong = sum(int((labels[window.slices] != window.pixels).sum()) for window in exact_windows(folder, side))
    return {"seconds": seconds, "wrong": wrong, "bytes_at_peak": peak}


def exact_windows(folder: Path, side: int) -> Any:
    """The windows of the mesh as it is: with vertices that are not snapped."""
    import topleft as tl

    return tl.tiles(mesh_of(folder), (side, side), window=WINDOW, depth_test=None, subpixel_bits="exact")


def peak_bytes(*, children: bool = False) -> int:
    return resource.getrusage(resource.RUSAGE_CHILDREN if children else resource.RUSAGE_SELF).ru_maxrss * 1024


MEASURED: dict[str, Callable[[Path, int], dict[str, float]]] = {
    "windows": draw_windows, "zarr": write_zarr, "one window": draw_in_turns,
}  # fmt: skip


def in_process(way: str, folder: Path, side: int) -> dict[str, float]:
    """Measure one way in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.small.tiles", way, str(folder), str(side)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"error": 1.0, "said": done.stderr.strip().splitlines()[-1]}  # type: ignore[dict-item]
    return json.loads(done.stdout)


def run(options: TileOptions, _: Save) -> Record:
    """Make the mesh and measure."""
    rows: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder, side = Path(name), options.side
        write_mesh(folder, options.triangles, side)
        n_triangles = len(mesh_of(folder)[1])
        for way in PEERS if options.peers else WAYS:
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
        if "ratio" in row:
            more.append(
                f"all windows in turns with it: {row['run_s']:.2f} s, {row['ratio']:.2f} of its pixels a second; "
                f"in CPU time {row['run_cpu_s']:.2f} s, {row['cpu_ratio']:.2f}"
            )
        more += [f"{row['wrong']:,} pixels differ"] if "wrong" in row else []
        made.append(f"| {way} | {row['seconds']:.2f} | {rate:.0f} | {peak:.2f} | {', '.join(more)} |")
    return made


@dataclass(frozen=True)
class TileOptions(Options):
    triangles: int = count(20_000_000, "--triangles", "about so many")
    side: int = count(40_000, "--side", "of the raster, pixels")
    peers: bool = switch("--peers", "beside other programs, the raster as a whole in memory")
    folder: str | None = option(None, "--folder", "where mesh and store go for the time (the system's)", metavar="DIR")


STUDY = Study("tiles", "huge rasters by windows: time and memory", TileOptions, run, lines)

if __name__ == "__main__":  # one way, in a process of its own
    way, place, length = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    found = MEASURED[way](place, length) if way in MEASURED else draw_peer(way, place, length)
    print(json.dumps({"bytes_at_peak": peak_bytes(), **found}))
