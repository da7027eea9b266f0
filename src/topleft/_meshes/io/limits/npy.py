"""Reads arrays of .npy and .npz files by name, after a check of their headers.

Input: a file, unchecked. Output: arrays; no memory is taken for more than the file holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from topleft._core.base.array_types import Array
from topleft._meshes.io.limits.budget import Budget
from topleft.errors import MeshError


def check_header(file: IO[bytes], n_bytes: int) -> None:
    """Raise an error unless an array of a file of so many bytes may be read."""
    try:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(file)
    except (ValueError, EOFError, TypeError, SyntaxError) as error:
        raise MeshError(f"it is no array of NumPy ({error})") from error
    if dtype.hasobject:
        raise MeshError("its array holds objects of Python, which are not read")
    n_wanted = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or n_wanted > n_bytes:
        raise MeshError(f"its array of shape {shape} of {dtype} has {n_bytes} of {n_wanted} bytes")


@contextmanager
def arrays_of(path: Path, budget: Budget) -> Iterator[Callable[[str], Array | None]]:
    """A function that reads an array of an .npz file by its name; None if there is none.

    A `MeshError` if an array is broken, or all that are asked for have more bytes than allowed.
    """
    import zipfile  # which few need, and which imports much

    budget.read(path.stat().st_size)
    with zipfile.ZipFile(path) as archive:

        def array(name: str) -> Array | None:
            try:
                row = archive.getinfo(f"{name}.npy")
            except KeyError:
                return None
            budget.spend("max_unpacked_bytes", row.file_size)
            with archive.open(row) as file:
                check_header(file, row.file_size)
            with archive.open(row) as file:
                return np.lib.format.read_array(file, allow_pickle=False)

        yield array
