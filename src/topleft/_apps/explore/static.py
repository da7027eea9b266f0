"""Writes the explorer as files that need no Python: the page, the kernels in WebAssembly, tables and scenes.

The page's worker answers what needs no more than the kernels; words, colours and scenes are those of the Python side,
written to `data.json`, so that both say the same.
"""

from __future__ import annotations

import json
import math
from dataclasses import MISSING, fields
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, get_args

from topleft._apps.explore import pixels, race, trace
from topleft._apps.explore.content import MAX_SIDE_PX, MAX_TRIANGLES, MAX_VERTICES, SCENES, scene
from topleft._apps.explore.handlers import hello
from topleft._apps.explore.session import SCRIPTS, Content, Request, Session
from topleft._apps.explore.state import Look, PixelState, Turn
from topleft._core.base.whole_file import write_whole
from topleft.errors import MissingPackageError
from topleft.methods import CLASSICS, find_method
from topleft.methods.classics.classic_kernels import FORMS, list_kinds
from topleft.methods.reference import sampling
from topleft.scene_families import FAMILIES, walk
from topleft.typing import CullOption, DepthTestOption, SamplingOption

SETS = ("simd128", "scalar")
"""The instruction sets of the kernels; a page fetches one."""

IN_PLACE_OF_PYTHON = (
    "worker.js", "local.js", "kernels.js", "numbers.js", "state.js", "exact.js", "pixels.js", "probe.js", "steps.js",
    "race.js",
)  # fmt: skip
"""The modules that answer the page."""

TABS = ("pixels", "steps", "race")
"""The parts of a page without Python: meshes are drawn by Python alone."""

N_SEEDS = 3
"""Of each scene of the part Race."""


def write_static(folder: Path, content: Content) -> list[Path]:
    """Write the page into a folder, which is made, and return what was written."""
    if content.mesh is not None:
        raise ValueError(f"--export must have no mesh, got {content.name!r}: a page without Python draws none")
    page = files("topleft._apps.explore").joinpath("page")
    modules = {name: page.joinpath(name) for name in (f"topleft-{one}.wasm" for one in SETS)}
    if missing := [name for name, module in modules.items() if not module.is_file()]:
        raise MissingPackageError(
            f"this installation has no {' and no '.join(missing)}: wheels of a release have them, and in a clone "
            "python packaging/wasm.py makes them (apt-get install clang lld wasi-libc libclang-rt-dev-wasm32)"
        )
    made = {name: page.joinpath(name).read_bytes() for name in ("explore.css", *SCRIPTS, *IN_PLACE_OF_PYTHON)}
    made |= {name: module.read_bytes() for name, module in modules.items()}
    made["index.html"] = static_html(page).encode()
    made["data.json"] = json.dumps(data_of(content), allow_nan=False, separators=(",", ":")).encode()
    made["race.bin"] = race_scenes()[1]
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, text in made.items():
        written.append(folder / name)
        write_whole(written[-1], lambda file, text=text: file.write(text))  # type: ignore[misc]
    return written


def static_html(page: Traversable) -> str:
    """The page, marked as one whose questions a worker answers."""
    text = page.joinpath("index.html").read_text(encoding="utf-8")
    return text.replace('<div class="explorer">', '<div class="explorer" data-worker="worker.js">')


def data_of(content: Content) -> dict[str, Any]:
    """What the worker knows besides the kernels."""
    greeting: Request = dict(hello(Session(content), {}).header)
    defaults = {one.name: one.default for one in fields(PixelState) if one.default is not MISSING}
    words = {
        "sampling": SamplingOption,
        "cull": CullOption,
        "depth_test": DepthTestOption,
        "winding": Turn,
        "look": Look,
    }
    return {
        "hello": {**greeting, "tabs": TABS, "saves": (), "has_plan": False},
        "states": {name: scene(name) for name in SCENES},
        "defaults": defaults,
        "limits": {
            "max_side_px": MAX_SIDE_PX, "max_triangles": MAX_TRIANGLES, "max_vertices": MAX_VERTICES,
            "max_slow_tests": pixels.MAX_SLOW_TESTS,
            "words": {name: get_args(kind) for name, kind in words.items()},
        },
        "classics": classics(),
        "n_classics": len(FORMS),
        "steps": steps_data(),
        "race": race_data(),
        "samples": sampling.SAMPLE_POSITIONS,
        "colors": pixels.COLORS.tolist(),
        "triangle_colors": [pixels.css(color) for color in pixels.triangle_colors(21)],
        "heat": pixels.HEAT.tolist(),
        "differences": pixels.DIFFERENCES.tolist(),
        "ink": pixels.INK,
        "area_error": float(pixels.AREA_ERROR),
        "wrong": pixels.WRONG,
    }  # fmt: skip


def steps_data() -> dict[str, Any]:
    """What the part Steps knows besides the kernels."""
    return {
        "kinds": list_kinds(), "methods": trace.TRACED,
        "about": {name: trace.about(find_method(name)) for name in trace.TRACED},
        "max_steps": trace.MAX_STEPS, "max_side_px": trace.MAX_SIDE_PX, "max_triangles": trace.MAX_TRIANGLES,
    }  # fmt: skip


def race_data() -> dict[str, Any]:
    """What the part Race knows besides the numbers of its scenes; what lies between them is Python's."""
    greeting: Request = dict(race.answer_families(Session(Content()), {}).header)
    for family in greeting["families"].values():
        family["axes"] = [{**axis, "is_continuous": False} for axis in family["axes"]]
    entries = [
        {"name": one.name, "method": one.method, "bits": one.bits, "snap": one.snap,
         "winding": find_method(one.method).claims.winding}
        for one in race.entries()
    ]  # fmt: skip
    shown = {"n_seeds": N_SEEDS, "entries": entries, "shares": race.SHARES, "scenes": race_scenes()[0]}
    return {**greeting, **shown}


def race_scenes() -> tuple[dict[str, list[dict[str, Any]]], bytes]:
    """The scenes of all families, from mild to harsh, and their numbers: vertices of each seed, then triangles."""
    parts: list[bytes] = []
    scenes: dict[str, list[dict[str, Any]]] = {name: [] for name in FAMILIES}
    at = 0
    for name, family in FAMILIES.items():
        for _, values in walk(family):
            made = [family.make(*values, seed) for seed in range(N_SEEDS)]
            first = made[0]
            scenes[name].append({
                "at": at, "n_vertices": len(first.vertices), "n_triangles": len(first.triangles), "size": first.size,
                "origin": [str(one) for one in first.origin], "copies": first.copies,  # beyond what a number holds
            })  # fmt: skip
            parts += [*(one.vertices.tobytes() for one in made), first.triangles.tobytes()]
            parts.append(bytes(-sum(map(len, parts[-N_SEEDS - 1 :])) % 8))
            at += sum(map(len, parts[-N_SEEDS - 2 :]))
    return scenes, b"".join(parts)


def classics() -> dict[str, dict[str, Any]]:
    """The classics by name: the numbers of a method and its variant in classics.h, and what it takes."""
    return {
        name: {
            "number": list(FORMS).index(name.partition("/")[0]),
            "form": FORMS[name.partition("/")[0]].index(name.partition("/")[2]),
            "limit": one.limit if math.isfinite(one.limit) else None,
            "has_bits": one.has_subpixel_bits,
            "is_integer": one.claims.integer_vertices,
        }
        for name, one in CLASSICS.items()
    }
