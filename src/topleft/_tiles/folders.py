"""Chunks in a folder or behind a URL: each is whole or not there.

Input: names with slashes, bytes. On disk a chunk is written under another name and renamed.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any, Protocol

from topleft._base.arrays import shown
from topleft._base.whole_file import write_whole
from topleft.errors import MissingPackageError

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

    def sweep(self) -> None:
        """Remove what a killed process had not renamed yet."""
        for left in self.path.rglob(".*.part"):
            left.unlink(missing_ok=True)


class RemoteFolder:
    """What fsspec reaches; an object is there when it is whole."""

    def __init__(self, url: str, storage: dict[str, Any] | None) -> None:
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise MissingPackageError(
                f"writing to {url} needs the package fsspec: pip install 'topleft[tiles]'"
            ) from None
        self._fs, self._root = url_to_fs(url, **(storage or {}))

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        path = f"{self._root}/{name}"
        self._fs.makedirs(path.rpartition("/")[0], exist_ok=True)
        self._fs.pipe_file(path, content)

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return bytes(self._fs.cat_file(f"{self._root}/{name}"))
        except FileNotFoundError:
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return bool(self._fs.exists(f"{self._root}/{name}"))

    def exists(self) -> bool:
        """Whether anything is there."""
        return bool(self._fs.exists(self._root))


def folder_of(path: str | os.PathLike[str], storage: dict[str, Any] | None = None) -> DiskFolder | RemoteFolder:
    """Return where chunks of a path or URL are kept."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path or a URL, got {shown(path)}")
    if not (storage is None or isinstance(storage, dict)):
        raise TypeError(f"storage must be a dict or None, got {shown(storage)}")
    text = os.fspath(path)
    return RemoteFolder(text, storage) if "://" in text else DiskFolder(Path(text))


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
