"""Tells whether a file holds the picture of a job: by a record in it, of all that the picture was made of.

Input: a job, its scene, the files that were read for it. Output: a digest, and the names of the files.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from functools import lru_cache, partial
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np

from topleft import __version__


@dataclass(frozen=True)
class FromFile:
    """What is read from a file; it counts by the content of the file."""

    path: str


class Hash(Protocol):
    """An object of hashlib."""

    def update(self, content: Any, /) -> None:
        """Add bytes."""


PLAIN = frozenset([type(None), bool, int, float, complex, str, bytes, range])
PLAIN_KINDS = (Enum, np.generic)
"""Types of values whose `repr` tells them."""


class Contents:
    """The contents of what pictures are made of, as digests.

    Those of meshes, scenes and textures, which nobody changes while they live, are kept as long as they live.
    """

    def __init__(self) -> None:
        self._known: WeakKeyDictionary[Any, bytes] = WeakKeyDictionary()

    def record_of(self, parts: Iterable[object], home: str, files: Iterable[Path]) -> tuple[str, ...]:
        """A digest of parts and of the contents of files, and the names of the files, seen from the folder of `home`.

        Empty for parts whose content cannot be told, of a compiled function, say.
        """
        folder = Path(home).parent
        with suppress(TypeError, ValueError, RecursionError, OSError):  # ValueError: another drive of Windows
            names = dict.fromkeys(os.path.relpath(file, folder).replace(os.sep, "/") for file in files)
            found = hashlib.sha256(__version__.encode())
            self._add(found, tuple(parts))
            for name in names:
                found.update(f"{name}\n{_digest_of_file(folder / name)}\n".encode())
            return found.hexdigest(), *names
        return ()

    def _add(self, found: Hash, part: object) -> None:
        """Add the content of a value to a digest; a `TypeError` for one that has none that can be told."""
        found.update(f"{type(part).__module__}.{type(part).__qualname__}(".encode())
        if type(part) in PLAIN or isinstance(part, PLAIN_KINDS):
            found.update(repr(part).encode(errors="surrogatepass"))
        elif isinstance(part, (tuple, list)):
            for one in part:
                self._add(found, one)
        elif isinstance(part, os.PathLike):
            found.update(os.fspath(part).encode(errors="surrogatepass"))
        elif isinstance(part, np.ndarray):
            if part.dtype.hasobject:
                raise TypeError("nobody knows the content of objects")
            found.update(f"{part.dtype.str} {part.shape}".encode())
            found.update(np.ascontiguousarray(part).view(np.uint8).data if part.size else b"")
        elif isinstance(part, FromFile) and Path(part.path).suffix:
            self._add(found, tuple(vars(replace(part, path="")).items()) + (Path(part.path).suffix,))
        elif is_dataclass(part) and not isinstance(part, type):
            found.update(self._digest_of(part))
        elif isinstance(part, Mapping):
            self._add(found, tuple(part.items()))
        elif isinstance(part, partial):
            self._add(found, (part.func, part.args, part.keywords))
        elif isinstance(part, FunctionType):
            cells = tuple(cell.cell_contents for cell in part.__closure__ or ())
            self._add(found, (part.__code__, part.__defaults__, part.__kwdefaults__, cells))
        elif isinstance(part, CodeType):
            self._add(found, (part.co_code, part.co_names, part.co_consts))
        else:
            raise TypeError(f"nobody knows the content of {type(part).__name__}")
        found.update(b")")

    def _digest_of(self, part: Any) -> bytes:
        """The digest of the fields of a dataclass, kept for a frozen one that is compared by identity."""
        kind: Any = type(part)
        is_kept = kind.__hash__ is object.__hash__ and kind.__dataclass_params__.frozen
        known = self._known.get(part) if is_kept else None
        if known is None:
            inner = hashlib.sha256()
            self._add(inner, tuple((entry.name, getattr(part, entry.name)) for entry in fields(part)))
            known = inner.digest()
            if is_kept:
                self._known[part] = known
        return known


def _digest_of_file(path: Path) -> str:
    if not path.is_file():
        return "absent"
    status = path.stat()
    return _digest_of_content(str(path), status.st_mtime_ns, status.st_size)


@lru_cache(1024)
def _digest_of_content(path: str, mtime_ns: int, size: int) -> str:  # noqa: ARG001
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
