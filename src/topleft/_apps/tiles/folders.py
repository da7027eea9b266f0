"""Chunks in a folder or behind a URL: each is whole or not there.

Input: names with slashes, bytes. On disk a chunk is written under another name and renamed.
"""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from topleft._core.base.arrays import shown
from topleft._core.base.remote import RemotePath, as_place
from topleft._core.base.whole_file import write_whole

__all__ = ["DiskFolder", "Folder", "check_space", "folder_of"]


class Folder(Protocol):
    """Where chunks are kept."""

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""

    def exists(self) -> bool:
        """Whether anything is there."""

    def absolute(self) -> Folder:
        """The same folder for processes that run in other ones."""


class DiskFolder:
    """A folder on a disk."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        path = self.path / name
        if not path.parent.is_dir():
            path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, lambda file: file.write(content))

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return (self.path / name).read_bytes()
        except FileNotFoundError:
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return (self.path / name).is_file()

    def exists(self) -> bool:
        """Whether anything is there but what a killed process had not renamed yet."""
        if not self.path.is_dir():
            return self.path.exists()
        return any(not name.startswith(".") for name in os.listdir(self.path))

    def absolute(self) -> DiskFolder:
        """The same folder for processes that run in other ones."""
        return DiskFolder(self.path.absolute())

    def sweep(self) -> None:
        """Remove what a killed process had not renamed yet."""
        for left in self.path.rglob(".*.part"):
            left.unlink(missing_ok=True)


class RemoteFolder:
    """What fsspec reaches."""

    def __init__(self, path: RemotePath) -> None:
        self._path = path
        path.exists()  # what is wrong with the URL is told before anything is drawn

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        (self._path / name).write_bytes(content)

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return (self._path / name).read_bytes()
        except FileNotFoundError:
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return (self._path / name).exists()

    def exists(self) -> bool:
        """Whether anything is there."""
        return self._path.exists()

    def absolute(self) -> RemoteFolder:
        """The same folder for processes that run in other ones."""
        return self


def folder_of(path: str | os.PathLike[str], storage: dict[str, Any] | None = None) -> DiskFolder | RemoteFolder:
    """Return where chunks of a path or URL are kept."""
    if not (storage is None or isinstance(storage, dict)):
        raise TypeError(f"storage must be a dict or None, got {shown(storage)}")
    place = as_place("path", path)
    if isinstance(place, RemotePath):
        return RemoteFolder(replace(place, storage=tuple((storage or {}).items())))
    return DiskFolder(place)


def check_space(folder: Path, n_bytes: int, what: str) -> None:
    """Raise an error unless so many bytes are free where a folder is, or is to be.

    Raises
    ------
    OSError
        If they are not.
    """
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    if n_bytes > free:
        raise OSError(f"{what} takes up to {n_bytes:,} bytes, and {place} has {free:,} free: nothing was written")
