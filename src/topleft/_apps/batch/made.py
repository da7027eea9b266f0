"""Tells whether a file holds the picture of a job: by a record in it, of all that the picture was made of.

Input: a job, its scene, the files that were read for it. Output: a digest, and the names of the files.
"""

from __future__ import annotations

import hashlib
import os
import weakref
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from functools import lru_cache, partial
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Protocol

import numpy as np

from topleft import __version__

_digests: dict[int, tuple[weakref.ref[Any], bytes]] = {}
"""Digests of arrays that nobody writes to, by `id`."""


@dataclass(frozen=True)
class FromFile:
    """What is read from a file; it counts by the content of the file."""

    path: str


class Hash(Protocol):
    """An object of hashlib."""

    def update(self, content: Any, /) -> None:
        """Add bytes."""


def record_of(parts: Iterable[object], home: str, files: Iterable[Path]) -> tuple[str, ...]:
    """A digest of parts and of the contents of files, and the names of the files, as seen from the folder of `home`.

    Empty for parts whose content cannot be told, of a compiled function, say.
    """
    folder = Path(home).parent
    with suppress(TypeError, ValueError, RecursionError, OSError):  # ValueError: another drive of Windows
        names = dict.fromkeys(os.path.relpath(file, folder).replace(os.sep, "/") for file in files)
        found = hashlib.sha256(__version__.encode())
        _add(found, tuple(parts))
        for name in names:
            found.update(f"{name}\n{_digest_of_file(folder / name)}\n".encode())
        return found.hexdigest(), *names
    return ()


def _add(found: Hash, part: object) -> None:
    """Add the content of a value to a digest; a `TypeError` for one that has none that can be told."""
    found.update(f"{type(part).__module__}.{type(part).__qualname__}(".encode())
    if part is None or isinstance(part, bool | int | float | complex | str | bytes | Enum | np.generic | range):
        found.update(repr(part).encode(errors="surrogatepass"))
    elif isinstance(part, tuple | list):
        for one in part:
            _add(found, one)
    elif isinstance(part, os.PathLike):
        found.update(os.fspath(part).encode(errors="surrogatepass"))
    elif isinstance(part, np.ndarray):
        found.update(f"{part.dtype.str} {part.shape}".encode() + _digest_of_array(part))
    elif isinstance(part, FromFile) and Path(part.path).suffix:
        _add(found, tuple(vars(replace(part, path="")).items()) + (Path(part.path).suffix,))
    elif is_dataclass(part) and not isinstance(part, type):
        _add(found, tuple((entry.name, getattr(part, entry.name)) for entry in fields(part)))
    elif isinstance(part, Mapping):
        _add(found, tuple(part.items()))
    elif isinstance(part, partial):
        _add(found, (part.func, part.args, part.keywords))
    elif isinstance(part, FunctionType):
        cells = tuple(cell.cell_contents for cell in part.__closure__ or ())
        _add(found, (part.__code__, part.__defaults__, part.__kwdefaults__, cells))
    elif isinstance(part, CodeType):
        _add(found, (part.co_code, part.co_names, part.co_consts))
    else:
        raise TypeError(f"nobody knows the content of {type(part).__name__}")
    found.update(b")")


def _digest_of_array(array: np.ndarray[Any, Any]) -> bytes:
    """The digest of the numbers, kept for arrays that are read-only."""
    known = _digests.get(id(array))
    if known is not None and known[0]() is array:
        return known[1]
    if array.dtype.hasobject:
        raise TypeError("nobody knows the content of objects")
    digest = hashlib.sha256(np.ascontiguousarray(array).view(np.uint8).data if array.size else b"").digest()
    if not array.flags.writeable:
        key = id(array)
        _digests[key] = weakref.ref(array, lambda _: _digests.pop(key, None)), digest
    return digest


def _digest_of_file(path: Path) -> str:
    if not path.is_file():
        return "absent"
    status = path.stat()
    return _digest_of_content(str(path), status.st_mtime_ns, status.st_size)


@lru_cache(1024)
def _digest_of_content(path: str, mtime_ns: int, size: int) -> str:  # noqa: ARG001
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
