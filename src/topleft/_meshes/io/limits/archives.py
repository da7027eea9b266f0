"""Unpacks archives into a new folder: zip, tar, and single files that gzip or bzip2 have compressed.

Input: a file, unchecked. Output: files in a folder, and which of them are meshes.
"""

from __future__ import annotations

import bz2
import gzip
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Protocol

from topleft._core.base.notes import Notes
from topleft._meshes.io.limits.budget import Budget
from topleft.errors import MeshError

MESH_SUFFIXES = (
    ".gltf", ".glb", ".vrm", ".obj", ".ply", ".stl", ".stl_ascii", ".off", ".dae", ".3mf",
)  # fmt: skip
"""Suffixes of members that are read as meshes; these may name the others."""

PIECE_BYTES = 1 << 20
NODES_OF_MEMBER = 6
"""Nodes of glTF that take as long as a member that is written and read: 0.3 ms."""

MOST_FOLDERS = 32
"""Folders in the name of a member."""

BROKEN = (zipfile.BadZipFile, tarfile.TarError, EOFError, NotImplementedError, RuntimeError, zlib.error)


class SupportsRead(Protocol):
    """A stream that gives its content in pieces."""

    def read(self, size: int, /) -> bytes:
        """The next bytes, none at the end."""
        ...


@contextmanager
def unpacked(archive: Path, budget: Budget, notes: Notes) -> Iterator[tuple[Path, list[Path]]]:
    """A folder that goes when the block ends, and the mesh files of an archive in it, in their order."""
    with tempfile.TemporaryDirectory(prefix="topleft-") as name:
        folder = Path(name).resolve()
        try:
            with archive.open("rb") as file:
                budget.read(archive.stat().st_size)
                paths = _written(file, archive, budget, folder, notes)
        except BROKEN as error:
            raise MeshError(f"its archive is broken ({error})") from error
        if not paths:
            raise MeshError(f"cannot read {str(archive)!r}: its archive holds no {' '.join(MESH_SUFFIXES)}")
        try:
            yield folder, paths
        except MeshError as error:
            raise MeshError(str(error).replace(str(folder), str(archive))) from error


class Counted:
    """A reader whose bytes are counted as they are unpacked."""

    def __init__(self, content: SupportsRead, budget: Budget) -> None:
        self._content = content
        self._budget = budget

    def read(self, size: int) -> bytes:
        """The next bytes; a `MeshError` if they are more than allowed."""
        piece = self._content.read(min(size, PIECE_BYTES))
        self._budget.spend("max_unpacked_bytes", len(piece))
        return piece


def _written(file: IO[bytes], packed: Path, budget: Budget, folder: Path, notes: Notes) -> list[Path]:
    """Write the files of an archive into a folder; return the meshes among them."""
    suffix = packed.suffix.lower()
    if suffix in (".zip", ".zae"):
        return _written_of_zip(file, budget, folder, notes)
    stem = Path(packed.stem)
    with bz2.BZ2File(file) if suffix == ".bz2" else gzip.GzipFile(fileobj=file) as content:
        counted = Counted(content, budget)
        if suffix != ".tgz" and stem.suffix.lower() != ".tar":
            _write(counted, folder / stem.name)
            return [folder / stem.name]
        paths = []
        with tarfile.open(fileobj=counted, mode="r|") as archive:  # type: ignore[call-overload]
            for row in archive:
                # holes of sparse members are not in the archive, and so not counted
                path = _place(folder, row.name, budget) if row.isreg() and not row.issparse() else None
                member = None if path is None else archive.extractfile(row)
                if path is not None and member is not None:
                    _write(member, path)
                    paths.append(path)
    return [path for path in paths if is_mesh(path)]


def _written_of_zip(file: IO[bytes], budget: Budget, folder: Path, notes: Notes) -> list[Path]:
    paths, broken = [], []
    with zipfile.ZipFile(file) as archive:
        budget.check("max_unpacked_bytes", sum(row.file_size for row in archive.infolist()))
        for row in archive.infolist():
            _check_method(row)
            path = None if row.is_dir() else _place(folder, row.filename, budget)
            if path is not None:
                try:
                    with archive.open(row) as member:
                        _write(Counted(member, budget), path)
                    paths.append(path)
                except BROKEN as error:
                    path.unlink(missing_ok=True)
                    broken.append(error)
                    notes.add("members of its archive left out", f"{row.filename} ({error})")
    meshes = [path for path in paths if is_mesh(path)]
    if broken and not meshes:
        raise broken[0]
    return meshes


def is_junk(name: str) -> bool:
    """Whether macOS has added a member to an archive."""
    parts = name.split("/")
    return "__MACOSX" in parts or parts[-1].startswith("._") or parts[-1] == ".DS_Store"


def is_mesh(path: Path) -> bool:
    """Whether an unpacked member is to be read as a mesh."""
    return path.suffix.lower() in MESH_SUFFIXES and not is_junk(path.as_posix())


def _check_method(row: zipfile.ZipInfo) -> None:
    """Raise an error for methods that take as much memory as a member asks for."""
    if row.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2):
        raise MeshError(f"{row.filename[:80]!r} in its archive is compressed by method {row.compress_type}")


def _place(folder: Path, name: str, budget: Budget) -> Path | None:
    """Where a member goes; None for places outside, too deep, or of another member."""
    budget.spend("max_nodes", NODES_OF_MEMBER)
    parts = [part for part in name.replace("\\", "/").split("/") if part not in ("", ".")]
    if not 0 < len(parts) <= MOST_FOLDERS or any(part == ".." or ":" in part or len(part) > 200 for part in parts):
        return None
    path = folder.joinpath(*parts)
    try:
        if len(parts) > 1:
            path.parent.mkdir(parents=True, exist_ok=True)
        return None if path.exists() else path
    except OSError:  # a file of the name of the folder, or a name that no disk can have
        return None


def _write(content: SupportsRead, path: Path) -> None:
    with path.open("xb") as file:
        while piece := content.read(PIECE_BYTES):
            file.write(piece)


def check_zip(path: Path, budget: Budget) -> zipfile.ZipFile | None:
    """The archive that a file of any suffix is, counted as if all of it were unpacked; None if it is none."""
    if not zipfile.is_zipfile(path):
        return None
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise MeshError(f"its archive is broken ({error})") from error
    for row in archive.infolist():
        _check_method(row)
        budget.spend("max_unpacked_bytes", row.file_size)
    return archive
