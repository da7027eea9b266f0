"""Reads VTK and the formats of solvers by meshio.

Input: a file, unchecked. Output: a `Mesh` part, of the cells that `as_mesh` draws of a mesh of meshio.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib import import_module
from typing import Any

import numpy as np

from topleft._meshes.io.limits.budget import Budget
from topleft._meshes.io.references import Cloud, InputFile
from topleft._meshes.model.cells import Polygons, of_cells
from topleft._meshes.model.mesh import Mesh
from topleft.errors import MeshError, MissingPackageError


def read_by_meshio(source: InputFile, readers: Sequence[str]) -> list[Mesh]:
    """The triangles of the cells of a file; cells that are not drawn are noted; modules of meshio are tried in turn."""
    theirs, polygons = read_cells(source, readers)
    if polygons is None:
        points = np.asarray(theirs.points)
        source.clouds.append(Cloud(np.pad(points, ((0, 0), (0, 3 - points.shape[1])))))
        return []
    return [Mesh(polygons.points_in_space, polygons.triangles)]


def read_cells(source: InputFile, readers: Sequence[str]) -> tuple[Any, Polygons | None]:
    """The mesh of meshio of a file, and the triangles of its cells; None of points alone."""
    source.content()  # which is counted
    theirs = _read(source, readers)
    kinds = list(dict.fromkeys(block.type for block in theirs.cells))
    source.budget.spend("max_vertices", len(theirs.points))
    if set(kinds) <= {"vertex"}:
        return theirs, None
    try:
        polygons = of_cells(theirs)
    except ValueError as error:
        raise MeshError(f"{str(source.path)!r}: {error}") from None
    source.budget.spend("max_triangles", len(polygons.triangles))
    for kind in polygons.not_drawn:
        source.notes.add("cells not drawn", kind)
    return theirs, polygons


def note_lost_views(source: InputFile) -> None:
    """Note the data of Gmsh that meshio loses: all time steps of a view but the last."""
    views = Counter(re.findall(rb'\$(Node|Element)Data\s+\d+\s+"?([^"\r\n]*)', source.content()))
    for (_, name), n_steps in views.items():
        if n_steps > 1:
            source.notes.add("views of which the last step alone is read", name.decode(errors="replace"))


def _read(source: InputFile, readers: Sequence[str]) -> Any:
    """The mesh of meshio; its messages are notes."""
    reasons = []
    for name in readers:
        try:
            module = import_module(f"meshio.{name}")
        except ImportError:
            needed = f"reading {str(source.path)!r} needs another package: pip install meshio"
            raise MissingPackageError(needed) from None
        said = io.StringIO()
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said), counted_vtu(source.budget):
                mesh = module.read(str(source.path))
        except MeshError:
            raise
        except Exception as error:  # readers meet broken bytes in their ways
            reasons.append(f"{name}: {' '.join(str(error).split()) or type(error).__name__}")
            continue
        if said.getvalue().strip():
            source.notes.add("read with a warning of meshio", " ".join(said.getvalue().split()))
        return mesh
    raise MeshError("; ".join(reasons))


_unpacking: ContextVar[Budget | None] = ContextVar("_unpacking", default=None)


class _CountedModule:
    """A module that unpacks, on the budget of the file that is being read."""

    def __init__(self, module: Any, unpacker: str) -> None:
        self._module, self._unpacker = module, unpacker

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)

    def decompress(self, content: bytes) -> bytes:
        """All that the module unpacks of some bytes; a `MeshError` if it is more than allowed."""
        budget = _unpacking.get()
        if budget is None:
            return self._module.decompress(content)
        unpacker = getattr(self._module, self._unpacker)()
        most = budget.limit("max_unpacked_bytes") + 1
        unpacked: bytes = unpacker.decompress(content, most)
        budget.spend("max_unpacked_bytes", len(unpacked))
        return unpacked


@contextmanager
def counted_vtu(budget: Budget) -> Iterator[None]:
    """Have meshio unpack the arrays of a VTU file on its budget; elsewhere it reads as ever."""
    with contextlib.suppress(ImportError):
        from meshio.vtu import _vtu

        for name, unpacker in (("zlib", "decompressobj"), ("lzma", "LZMADecompressor")):
            if not isinstance(getattr(_vtu, name), _CountedModule):
                setattr(_vtu, name, _CountedModule(getattr(_vtu, name), unpacker))
    token = _unpacking.set(budget)
    try:
        yield
    finally:
        _unpacking.reset(token)
