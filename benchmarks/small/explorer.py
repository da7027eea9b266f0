"""The explorer in a headless browser: the first picture, frames a second, and the loss between engine and screen.

`topleft explore FILE.ply` is started as a reader would; Chromium, already open, loads its page. The mesh turns by
itself in a frame of 1280x720, a question for each frame, the next one asked when the last one is here. Figures of time
are those of the machine as it is; CPU time of the two sides a frame says what they would be were it idle.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import topleft as tl
from benchmarks.harness.arguments import Options, count, option
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, tell
from benchmarks.report.study import Study
from benchmarks.report.tables import table
from benchmarks.scenes.arrays import write_ply

SIZE = (1280, 720)
N_TRIANGLES = (70_000, 1_000_000)
STYLE = """.explorer .stage.mesh {
  position: fixed !important; left: 0; top: 60px; width: 1280px !important; height: 720px !important; min-height: 0;
}"""
PAINTED = "() => document.querySelector('.explorer').app?.parts.mesh.frames.painted > 0"
AT_REST = "() => document.querySelector('.explorer').app.parts.mesh.frames.last.image instanceof ImageData"
WARM_UP = """async () => {
  const part = document.querySelector(".explorer").app.parts.mesh, {frames} = part, end = frames.painted + 8;
  part.change({spin: true});
  while (frames.painted < end) await new Promise(requestAnimationFrame);
}"""
"""Clusters are made at the second frame of a mesh."""
TURN = """async (seconds) => {
  const part = document.querySelector(".explorer").app.parts.mesh, {frames} = part, seen = [];
  const start = performance.now(), before = frames.painted;
  for (let last = null; performance.now() - start < 1000 * seconds; await new Promise(requestAnimationFrame)) {
    if (frames.last !== last) seen.push(last = frames.last);
  }
  const n = frames.painted - before, rate = 1000 * n / (performance.now() - start);
  part.change({spin: false});
  return {n, rate, seen: seen.map((one) => [one.draw_ms, one.encode_ms, one.took, one.decode + one.paint])};
}"""
ASK = """async ([size, background]) => {
  const {app} = document.querySelector(".explorer"), {view} = app.parts.mesh, start = performance.now();
  const asked = {...view, sampling: "center", size, ...(background ? {background} : {})};
  const frame = await app.line.ask("mesh.draw", asked);
  return [performance.now() - start - frame.draw_ms - frame.encode_ms, frame.encode_ms, frame.arrays.pixels.length];
}"""


def cpu_ms(*roots: int) -> float:
    """CPU time that processes and their children have used."""
    ticks, parents = {}, {}
    for entry in Path("/proc").iterdir():
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split() if entry.name.isdigit() else None
        except OSError:
            continue  # it has ended
        if fields:
            parents[int(entry.name)], ticks[int(entry.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
    found = set(roots)
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return 1000 * sum(ticks.get(pid, 0) for pid in found) / os.sysconf("SC_CLK_TCK")


def measure_mesh(browser: Any, path: Path, seconds: float) -> dict[str, Any]:
    """Open a file in the explorer, turn it, let it rest."""
    chromium = [int(pid) for pid in subprocess.check_output(["pgrep", "-P", str(os.getpid())]).split()]
    page = browser.new_context(bypass_csp=True, viewport={"width": 1600, "height": 860}).new_page()
    start = time.perf_counter()
    command = [sys.executable, "-m", "topleft", "explore", str(path), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            url = server.stdout.readline().split()[-1]
            page.goto(url)
            page.wait_for_function(PAINTED, timeout=300_000)
            first = time.perf_counter() - start
            page.add_style_tag(content=STYLE)
            others = [pid for pid in chromium if pid != server.pid]
            page.evaluate(WARM_UP)
            before = cpu_ms(server.pid), cpu_ms(*others)
            turned = page.evaluate(TURN, seconds)
            used = cpu_ms(server.pid) - before[0], cpu_ms(*others) - before[1]
            page.wait_for_function(AT_REST, timeout=60_000)
            asked = {"pixels": [], "JPEG": []}
            for _ in range(12):
                for name, background in (("pixels", None), ("JPEG", [255, 255, 255])):
                    asked[name].append(page.evaluate(ASK, [SIZE, background]))
            page.wait_for_timeout(1000)
            rested = cpu_ms(server.pid)
            page.wait_for_timeout(5000)
            idle = cpu_ms(server.pid) - rested
        finally:
            page.context.close()
            server.terminate()
    n = max(1, turned["n"])
    draw, encode, took, shown = (statistics.median(column) for column in zip(*turned["seen"], strict=True))
    return {
        "first_s": first, "frames_a_second": turned["rate"], "draw_ms": draw, "encode_ms": encode,
        "way_ms": took - draw - encode, "show_ms": shown, "server_cpu_ms": used[0] / n, "browser_cpu_ms": used[1] / n,
        "idle_cpu_ms_a_second": idle / 5, "load": os.getloadavg()[0],
        "ways": {name: [statistics.median(c) for c in zip(*rows, strict=True)] for name, rows in asked.items()},
    }  # fmt: skip


PICTURES = {
    "steps": ("light", (1280, 720), "#steps=", '{"scene":"","method":"bresenham_scanline","step":70}'),
    "mesh": ("dark", (1280, 720), "#mesh=", '{"layer":"smooth","lights":"three"}'),
    "race": ("light", (1280, 900), "#race=", '{"family":"fan","positions":[4],"seed":0}'),
    "mesh-phone": ("dark", (390, 844), "#mesh=", '{"layer":"overdraw"}'),
}
"""Pages of the guide: colour scheme, size, part, its state."""


def take_pictures(browser: Any, folder: Path) -> None:
    """Write the pictures of the guide, in few colours."""
    import io

    from PIL import Image

    with tl.explore("shared-edge", wait=False, browser=False) as explorer:
        for name, (scheme, (width, height), part, state) in PICTURES.items():
            viewport = {"width": width, "height": height}
            context = browser.new_context(bypass_csp=True, viewport=viewport, color_scheme=scheme)
            page = context.new_page()
            page.goto(explorer.url.split("#")[0] + part + quote(state))
            page.wait_for_timeout(6000)
            picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            picture.quantize(128).save(folder / f"explore-{name}.png", optimize=True)
            context.close()


@dataclass(frozen=True)
class ExplorerOptions(Options):
    triangles: Sequence[int] = count(N_TRIANGLES, "--triangles", nargs="*")
    pictures: Path | None = option(
        None, "--pictures", "write the pictures of the guide, too", type=Path, metavar="FOLDER"
    )
    seconds: int = count(5, "--seconds", "of turning")


def run(options: ExplorerOptions, _: Save) -> Record:
    """Measure each mesh.

    Raises
    ------
    ValueError
        If there is no browser, or no Playwright.
    """
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise ValueError("the explorer is measured with Playwright: pip install playwright") from None
    if chromium is None:
        raise ValueError("the explorer is measured in Chromium: apt-get install chromium")
    rows = []
    with sync_playwright() as running, tempfile.TemporaryDirectory() as folder:
        browser = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for n in options.triangles:
            path = Path(folder) / f"blob-{n}.ply"
            vertices, triangles = tl.scenes.blob(n)
            write_ply(path, vertices, triangles)
            rows.append({"triangles": len(triangles), **measure_mesh(browser, path, options.seconds)})
            tell(json.dumps(rows[-1]))
            path.unlink()
        if options.pictures:
            take_pictures(browser, options.pictures)
        version = browser.version
        browser.close()
    return {"kind": "explorer", "browser": version} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The tables: frames, and ways."""
    head = ["triangles", "first picture, s", "frames a second", "drawn, ms", "JPEG, ms", "way, ms", "shown, ms"]
    names = ["first_s", "frames_a_second", "draw_ms", "encode_ms", "way_ms", "show_ms"]
    yield from table(head, [
        [f"{row['triangles']:,}", *(f"{row[name]:.1f}" for name in names)] for row in record["rows"]
    ])  # fmt: skip
    yield ""
    head = ["triangles", "CPU ms a frame", "of the browser", "CPU ms a second at rest", "load of the machine"]
    names = ["server_cpu_ms", "browser_cpu_ms", "idle_cpu_ms_a_second", "load"]
    yield from table(head, [
        [f"{row['triangles']:,}", *(f"{row[name]:.1f}" for name in names)] for row in record["rows"]
    ])  # fmt: skip
    yield ""
    yield from table(["triangles", "sent as", "bytes", "encoded, ms", "way, ms"], [
        [f"{row['triangles']:,}", name, f"{int(n):,}", f"{encode:.1f}", f"{way:.1f}"]
        for row in record["rows"] for name, (way, encode, n) in row["ways"].items()
    ])  # fmt: skip


STUDY = Study("explorer", "frames a second of the explorer in a headless browser", ExplorerOptions, run, lines)
