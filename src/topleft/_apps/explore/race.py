"""Computes scenes of the atlas for the page: families, their parameters under sliders, and the rows of the chart.

In: the name of a family, the positions of its sliders, a seed. Out: a scene. The page draws it by each method and
counts the pixels (page/race.js); `benchmarks/atlas` draws its record with these entries, over more seeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from topleft._apps.explore.session import Reply, Request, Session
from topleft.methods import CLASSICS, find_method
from topleft.scene_families import FAMILIES, Axis, PixelScene

NO_SNAP = "exact"

N_SEEDS = 100
"""Of the scenes that the page shows."""

PRODUCTION: dict[str, tuple[str, int | str]] = {
    "auto": ("auto", 8), "edge": ("edge", 8), "scanline": ("scanline", 8),
    "auto, 0 bits": ("auto", 0), "auto, 16 bits": ("auto", 16), "auto, exact": ("auto", NO_SNAP),
}  # fmt: skip
"""The engine's rows: method and sub-pixel bits, or NO_SNAP."""


@dataclass(frozen=True)
class Entry:
    """A row of the atlas: a method at a precision, or the engine with another sampling."""

    name: str
    method: str
    bits: int | str = 8
    sampling: str = "center"

    @property
    def snap(self) -> str:
        """The grid that the method snaps vertices to, an argument of `snapped`."""
        method = find_method(self.method)
        if self.bits == NO_SNAP:
            return NO_SNAP
        if method.code is not None or method.has_subpixel_bits:
            return str(self.bits)
        if method.claims.integer_vertices:
            return "px"
        return NO_SNAP if self.method.endswith("float64") else "float32"

    @property
    def rule(self) -> str:
        """The fill rule: which edges include the centres on them."""
        return "bottom-right" if self.method.endswith("bottom-right") else "top-left"

    def options(self) -> dict[str, Any]:
        """Arguments of the verbs."""
        options: dict[str, Any] = {"method": self.method}
        if self.snap.isdigit() or self.bits == NO_SNAP:
            options["subpixel_bits"] = self.bits
        return options | ({} if self.sampling == "center" else {"sampling": self.sampling})


def entries() -> list[Entry]:
    """All rows: the engine at three precisions, by both walkers and without a snap, every classic."""
    production = [Entry(name, *what) for name, what in PRODUCTION.items()]
    return production + [Entry(name, name) for name in CLASSICS if not name.endswith("/wireframe")]


def value_at(axis: Axis, position: float) -> tuple[str, Any]:
    """Return the text of the value at a position of the slider, and the value; between numbers in log scale."""
    names, values = list(axis.values), list(axis.values.values())
    position = min(max(position, 0.0), len(values) - 1.0)
    i = min(int(position), len(values) - 2)
    part = position - i
    low, high = values[i], values[i + 1]
    if part in (0.0, 1.0) or not is_continuous(axis) or low <= 0 or high <= 0:
        nearest = round(position)
        return names[nearest], values[nearest]
    between = math.exp(math.log(low) + part * (math.log(high) - math.log(low)))
    value = round(between) if isinstance(low, int) else between
    return f"{value:.3g}" if isinstance(value, float) else str(value), value


def is_continuous(axis: Axis) -> bool:
    """Return whether an axis has values between its steps."""
    return all(isinstance(value, int | float) for value in axis.values.values())


def scene_at(family: str, positions: Sequence[float], seed: int) -> tuple[PixelScene, list[str]]:
    """Return the scene of a family at positions of its sliders, and the texts of the values."""
    if family not in FAMILIES:
        raise ValueError(f"family must be one of {', '.join(map(repr, FAMILIES))}, got {family!r}")
    chosen = FAMILIES[family]
    if len(positions) != len(chosen.axes):
        raise ValueError(f"family {family!r} has {len(chosen.axes)} parameters, got {len(positions)} positions")
    if not all(map(math.isfinite, positions)) or not 0 <= seed < N_SEEDS:
        raise ValueError(f"positions must be finite and seed from 0 to {N_SEEDS - 1}, got {positions} and {seed}")
    values = [value_at(axis, position) for axis, position in zip(chosen.axes, positions, strict=True)]
    return chosen.make(*(value for _, value in values), seed), [written for written, _ in values]


def described(scene: PixelScene) -> dict[str, Any]:
    """Return size, origin and copies of a scene; the origin as text, since it may be beyond 2**53."""
    return {"size": scene.size, "origin": [str(at) for at in scene.origin], "copies": scene.copies}


def answer_scene(_: Session, request: Request) -> Reply:
    """Answer the page: a scene at positions of its sliders."""
    scene, written = scene_at(str(request["family"]), request["positions"], int(request["seed"]))
    return Reply({**described(scene), "values": written}, {"vertices": scene.vertices, "triangles": scene.triangles})


def lists() -> dict[str, Any]:
    """The families, their parameters, and the rows of the atlas, for a page that opens."""
    families = {
        name: {
            "what": family.what,
            "axes": [
                {"what": axis.what, "steps": list(axis.values), "is_continuous": is_continuous(axis)}
                for axis in family.axes
            ],
        }
        for name, family in FAMILIES.items()
    }
    rows = [
        {"name": entry.name, "method": entry.method, "bits": entry.bits, "snap": entry.snap,
         "winding": find_method(entry.method).claims.winding}
        for entry in entries()
    ]  # fmt: skip
    return {"families": families, "entries": rows, "n_seeds": N_SEEDS}


HANDLERS = {"race.scene": answer_scene}
