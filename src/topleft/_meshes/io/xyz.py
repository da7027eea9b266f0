"""Reads XYZ: rows of coordinates, with columns of normals or colours behind them.

Input: a text, unchecked. Output: a cloud of its points; columns of numbers that are neither are noted.
"""

from __future__ import annotations

import numpy as np

from topleft._core.base.array_types import Array
from topleft._meshes.io.references import Cloud, InputFile, numbers_of_text, utf8_of
from topleft._meshes.model.mesh import Mesh
from topleft.errors import MeshError

UNIT_ERROR = 0.01
"""How far the length of a normal may be from 1: files have two digits and more."""


def read_xyz(source: InputFile) -> list[Mesh]:
    """No meshes: the points become a cloud."""
    text = utf8_of(source.content()).replace(b",", b" ")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith((b"#", b"//"))]
    source.budget.spend("max_lines", len(lines))
    source.budget.spend("max_vertices", len(lines))
    counts = {len(line.split()) for line in lines}
    if len(counts) != 1 or min(counts) < 3:
        raise MeshError(f"its rows have {', '.join(map(str, sorted(counts)[:3])) or 'no'} numbers, not all 3 or more")
    rows = numbers_of_text(b" ".join(lines)).reshape(len(lines), -1)
    colors: Array | None = None
    normals: Array | None = None
    at, n = 3, rows.shape[1]
    while at + 3 <= n:
        part = rows[:, at : at + 3]
        if normals is None and (np.abs(np.sqrt((part * part).sum(axis=1)) - 1) <= UNIT_ERROR).all():
            normals = part
        elif colors is None and _are_bytes(part):
            has_opacity = n == at + 4 and _are_bytes(rows[:, at + 3 :])
            colors = np.pad(rows[:, at : at + 3 + has_opacity], ((0, 0), (0, 1 - has_opacity)), constant_values=255)
            at += has_opacity
        else:
            break
        at += 3
    if at < n:
        source.notes.add("columns of numbers behind the coordinates not read", f"{at + 1} to {n}")
    source.clouds.append(Cloud(rows[:, :3], None if colors is None else colors.astype(np.uint8), normals))
    return []


def _are_bytes(values: Array) -> bool:
    return bool(((values >= 0) & (values <= 255) & (values == np.rint(values))).all())
