"""Levels of detail: a mesh and coarser meshes that replace it, each with a bound on its distance from the mesh.

In: a mesh. Out: `Levels`, which are cached with the mesh, and stored in a file on request.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_path, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.whole_file import write_whole
from topleft._meshes.camera.matrices import bounding_sphere
from topleft._meshes.io.limits.budget import Budget
from topleft._meshes.io.limits.npy import arrays_of
from topleft._meshes.lod.parts import PartedMesh, Parts, parts_of_arrays
from topleft._meshes.model.mesh import Mesh
from topleft.errors import MeshError

#: The arrays of a mesh, by their names in files.
ARRAYS = ("vertices", "triangles", "normals", "colors", "uv", "uv1", "material_of_triangle")


@dataclass(frozen=True, eq=False)
class Level:
    """A mesh that replaces a finer mesh.

    Attributes
    ----------
    mesh : Mesh
    bound : float
        An upper bound of the Hausdorff distance of the two surfaces, in units of object space.
    known : float
        A lower bound, but for rounding: `bound` is at most `bound / known` times too large. 0: not known.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(1))
    >>> tl.Level(ball, 0.0).bound
    0.0
    """

    mesh: Mesh
    bound: float = 0.0
    known: float = 0.0

    @cached_property
    def extent(self) -> F64:
        """The box of the mesh, lowest and highest x, y, z, and its sphere, centre and radius: (10,) float64."""
        box = self.mesh.bounds
        center, radius = bounding_sphere(self.mesh.extreme_points())
        if not (np.isfinite(box).all() and np.isfinite(radius)):
            return np.array([-math.inf] * 3 + [math.inf] * 3 + [0.0] * 3 + [math.inf])
        return np.array([*box.ravel(), *center, radius])


class Levels(Sequence[Level]):
    """A mesh and its coarser levels, the finest first: `levels[0]` is the mesh itself, its bound 0.

    Made by `topleft.simplify`.

    Parameters
    ----------
    mesh : Mesh
    coarser : sequence of Level
        Each with fewer triangles than the one before.
    parts : optional
        The parts that `simplify` has cut a large mesh into, for views that need finer and coarser parts.

    Examples
    --------
    >>> import topleft as tl
    >>> fine, coarse = tl.Mesh(*tl.scenes.icosphere(2)), tl.Mesh(*tl.scenes.icosphere(1))
    >>> levels = tl.Levels(fine, [tl.Level(coarse, 0.2)])
    >>> [len(level.mesh.triangles) for level in levels]
    [320, 80]
    """

    def __init__(self, mesh: Mesh, coarser: Sequence[Level] = (), parts: Parts | None = None) -> None:
        # A copy: a reference to the mesh, whose levels are cached with it, would keep both alive for ever.
        self._original = Level(replace(mesh))
        self._coarser = tuple(coarser)
        self.parts = parts

    @cached_property
    def parted(self) -> PartedMesh | None:
        """The levels of a large mesh in parts: computed at the first use, with copies of all arrays."""
        return None if self.parts is None else PartedMesh([level.mesh for level in self], self.parts)

    @cached_property
    def extents(self) -> F64:
        """The extents of the levels, (N, 10) float64."""
        return np.stack([level.extent for level in self])

    @cached_property
    def bounds(self) -> F64:
        """The bounds of the levels, (N,) float64."""
        return np.array([level.bound for level in self], np.float64)

    def __len__(self) -> int:
        return 1 + len(self._coarser)

    def __getitem__(self, i: Any) -> Any:
        """Return a level, or a tuple of levels for a slice."""
        return (self._original, *self._coarser)[i]

    def __iter__(self) -> Iterator[Level]:
        return iter((self._original, *self._coarser))

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(level.mesh.triangles):,} (bound {level.bound:.3g})" for level in self)
        return f"<Levels of {len(self)}: triangles {counts}>"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the coarser levels to a .npz file, atomically.

        Parameters
        ----------
        path : path
            Materials and the crease angle are not written: `load` copies them from the mesh.

        Raises
        ------
        ValueError
            If the name does not end in .npz.
        """
        path = _checked_path(path)
        arrays: dict[str, npt.NDArray[Any]] = {
            "mesh": np.array(digest_of(self[0].mesh)),
            "bound": np.array([level.bound for level in self[1:]], np.float64),
            "known": np.array([level.known for level in self[1:]], np.float64),
        }
        if self.parts is not None:
            arrays["order"] = self.parts.order
            for i in range(len(self)):
                arrays[f"starts_{i}"], arrays[f"bounds_{i}"] = self.parts.starts[i], self.parts.bounds[i]
        for i, level in enumerate(self[1:], 1):
            for name in ARRAYS:
                array = getattr(level.mesh, name)
                if array is not None:
                    arrays[f"{name}_{i}"] = array
        write_whole(path, lambda file: np.savez(file, **arrays))  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: str | os.PathLike[str], mesh: Mesh, *, max_unpacked_bytes: int | None = None) -> Levels:
        """Read the file of `save`, and cache the levels with the mesh.

        Parameters
        ----------
        path : path
        mesh : Mesh
            The mesh of the levels: its arrays must equal the saved mesh, to the bit.
        max_unpacked_bytes : int, optional
            The most bytes of all arrays of the levels; a file with more raises an error. The default is 33,554,432, or
            8 times the size of the file.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        MeshError
            If the file is broken, or holds the levels of another mesh.
        """
        import zipfile
        import zlib

        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh must be a Mesh, got {shown(mesh)}")
        path = _checked_path(path)
        budget = Budget(str(path), max_unpacked_bytes=max_unpacked_bytes)
        try:
            with arrays_of(path, budget) as array:
                digest = array("mesh")
                if digest is None:
                    raise MeshError("it has no array 'mesh'")
                if str(digest) != digest_of(mesh):
                    raise MeshError(
                        f"{str(path)!r} holds the levels of another mesh: make them anew with topleft.simplify"
                    )
                bounds, knowns = (as_bounds(array(name)) for name in ("bound", "known"))
                coarser = [
                    Level(
                        Mesh(
                            **{name: array(f"{name}_{i}") for name in ARRAYS},  # type: ignore[arg-type]
                            materials=mesh.materials,
                            crease=mesh.crease,
                            color_interpolation=mesh.color_interpolation,
                            up=mesh.up,
                        ),
                        bound,
                        known,
                    )
                    for i, (bound, known) in enumerate(zip(bounds, knowns, strict=True), 1)
                ]
                parts = parts_of_arrays(array, [mesh, *(level.mesh for level in coarser)])
        except FileNotFoundError:
            raise FileNotFoundError(f"there is no file {str(path)!r}") from None
        except MeshError as error:
            if repr(str(path)) in str(error):
                raise
            raise MeshError(f"cannot read {str(path)!r}: broken, or not levels of detail ({error})") from error
        except (ArithmeticError, AttributeError, EOFError, LookupError, MemoryError, OSError, RuntimeError, TypeError,
                ValueError, zipfile.BadZipFile, zlib.error) as error:  # fmt: skip
            if isinstance(error, OSError) and error.filename is not None:  # it is the file, not its content
                raise
            raise MeshError(f"cannot read {str(path)!r}: broken, or not levels of detail ({error})") from error
        return keep_levels(mesh, cls(mesh, coarser, parts))


def as_bounds(values: npt.NDArray[Any] | None) -> list[float]:
    """Return distances of levels after checking them."""
    if (
        values is None
        or values.ndim != 1
        or values.dtype.kind != "f"
        or not (np.isfinite(values) & (values >= 0)).all()
    ):
        raise ValueError("bounds must be finite and at least 0")
    return [float(value) for value in values]


def digest_of(mesh: Mesh) -> str:
    """A hash of the arrays of a mesh."""
    result = hashlib.sha256()
    for name in ARRAYS:
        array = getattr(mesh, name)
        result.update(f"{name} {None if array is None else (array.shape, array.dtype.str)}\n".encode())
        if array is not None:
            result.update(np.ascontiguousarray(array).data)
    return result.hexdigest()


_levels: WeakKeyDictionary[Mesh, Levels] = WeakKeyDictionary()


def keep_levels(mesh: Mesh, levels: Levels) -> Levels:
    """Cache levels for as long as their mesh lives, and return them."""
    _levels[mesh] = levels
    return levels


def kept_levels(mesh: Mesh) -> Levels | None:
    """The cached levels of a mesh, or None."""
    return _levels.get(mesh)


def _checked_path(path: str | os.PathLike[str]) -> Path:
    checked = as_path("path", path)
    if checked.suffix != ".npz":
        raise ValueError(f"levels are kept in a file that ends in .npz, got {str(checked)!r}")
    return checked
