"""Writes the explorer as files that need no Python: the page, the kernels in WebAssembly, and scenes.

The page's worker answers its requests instead of Python (page/local.js): `data.json` holds the reply to `hello`, and
the scenes.
"""

from __future__ import annotations

import json
import math
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from topleft._apps.explore.content import SCENES, scene
from topleft._apps.explore.handlers import hello
from topleft._apps.explore.race import described
from topleft._apps.explore.session import SCRIPTS, Content, Session
from topleft._core.base.whole_file import write_whole
from topleft.errors import MissingPackageError
from topleft.methods import CLASSICS
from topleft.methods.classics.classic_kernels import FORMS
from topleft.scene_families import FAMILIES, walk

MODULE = "topleft.wasm"
"""The kernels; `packaging/wasm.py` compiles them."""

IN_PLACE_OF_PYTHON = ("worker.js", "local.js", "kernels.js", MODULE)
"""What answers the page."""

TABS = ("pixels", "steps", "race")
"""The parts of a page without Python: only Python draws meshes."""

N_SEEDS = 3
"""Of each scene of the part Race."""


def write_static(folder: Path, content: Content) -> list[Path]:
    """Write the page into a folder, which is created, and return the paths of the files."""
    if content.mesh is not None:
        raise ValueError(f"--export must have no mesh, got {content.name!r}: a page without Python draws none")
    page = files("topleft._apps.explore").joinpath("page")
    if not page.joinpath(MODULE).is_file():
        raise MissingPackageError(
            f"this installation has no {MODULE}: wheels of a release have it, and in a clone "
            "python packaging/wasm.py makes it (apt-get install clang lld wasi-libc libclang-rt-dev-wasm32)"
        )
    contents = {name: page.joinpath(name).read_bytes() for name in ("explore.css", *SCRIPTS, *IN_PLACE_OF_PYTHON)}
    contents["index.html"] = static_html(page).encode()
    contents["data.json"] = json.dumps(data_of(content), allow_nan=False, separators=(",", ":")).encode()
    contents["race.bin"] = race_scenes()[1]
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, text in contents.items():
        written.append(folder / name)
        write_whole(written[-1], lambda file, text=text: file.write(text))  # type: ignore[misc]
    return written


def static_html(page: Traversable) -> str:
    """The page, marked so that a worker answers its requests."""
    text = page.joinpath("index.html").read_text(encoding="utf-8")
    return text.replace('<div class="explorer">', '<div class="explorer" data-worker="worker.js">')


def data_of(content: Content) -> dict[str, Any]:
    """The data of the worker besides the kernels."""
    greeting = hello(Session(content), {}).header
    families = greeting["race"]["families"]
    for family in families.values():  # only Python computes scenes between the steps
        family["axes"] = [{**axis, "is_continuous": False} for axis in family["axes"]]
    shown = {"tabs": TABS, "saves": (), "has_plan": False, "race": {**greeting["race"], "n_seeds": N_SEEDS}}
    return {
        "hello": {**greeting, **shown},
        "states": {name: scene(name) for name in SCENES},
        "classics": classics(),
        "races": {"scenes": race_scenes()[0]},
    }


def race_scenes() -> tuple[dict[str, list[dict[str, Any]]], bytes]:
    """The scenes of all families, from mild to harsh, and their arrays: vertices of each seed, then triangles."""
    parts: list[bytes] = []
    scenes: dict[str, list[dict[str, Any]]] = {name: [] for name in FAMILIES}
    at = 0
    for name, family in FAMILIES.items():
        for _, values in walk(family):
            seeded = [family.make(*values, seed) for seed in range(N_SEEDS)]
            first = seeded[0]
            scenes[name].append({
                "at": at, "n_vertices": len(first.vertices), "n_triangles": len(first.triangles), **described(first),
            })  # fmt: skip
            parts += [*(scene.vertices.tobytes() for scene in seeded), first.triangles.tobytes()]
            parts.append(bytes(-sum(map(len, parts[-N_SEEDS - 1 :])) % 8))
            at += sum(map(len, parts[-N_SEEDS - 2 :]))
    return scenes, b"".join(parts)


def classics() -> dict[str, dict[str, Any]]:
    """The classics by name: the numbers of a method and its variant in classics.h, and its limits."""
    return {
        name: {
            "number": list(FORMS).index(name.partition("/")[0]),
            "form": FORMS[name.partition("/")[0]].index(name.partition("/")[2]),
            "limit": classic.limit if math.isfinite(classic.limit) else None,
            "has_bits": classic.has_subpixel_bits,
        }
        for name, classic in CLASSICS.items()
    }
