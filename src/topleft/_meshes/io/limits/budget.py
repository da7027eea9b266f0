"""Counts all contents that a file makes of its bytes, and refuses more than its options allow.

Input: numbers that a file declares, before memory is asked for. Output: an error that names the number and the option.

Limits without an option grow with the bytes of the file: one that holds its triangles one by one is
never refused, one that multiplies them is. The least of each ends within 5 seconds and 1 GB.
"""

from __future__ import annotations

from numbers import Integral
from typing import NamedTuple

from topleft._core.base.arrays import shown
from topleft.errors import MeshError


class Limit(NamedTuple):
    """The limit of a file, for contents of one kind, without an option."""

    what: str
    least: int
    per_byte: float


LIMITS = {
    "max_bytes": Limit("bytes with the files that it names", 1 << 33, 0),
    "max_unpacked_bytes": Limit("bytes when it is unpacked", 1 << 25, 8),
    "max_lines": Limit("lines and elements", 1 << 19, 0.25),
    "max_vertices": Limit("vertices", 1 << 22, 1),
    "max_triangles": Limit("triangles", 1 << 22, 1),
    "max_nodes": Limit("parts (nodes, instances, materials, joints, names and members of files)", 1 << 15, 0.01),
    "max_texture_pixels": Limit("pixels of textures", 1 << 26, 16),
}
"""By the options of `topleft.load`. 8 bytes of text are one in an archive; 16 pixels a byte are plain ones of PNG."""


class OverLimitError(MeshError):
    """More than the limits of a file allow: no member of it is read then."""


class Budget:
    """The part of its limits that a file, with all that it names and holds, has used.

    `name`: of the file, for errors. Options of `LIMITS` that are not given, or None, follow the bytes of the file.
    """

    def __init__(self, name: str, **limits: int | None) -> None:
        for option, limit in limits.items():
            if option not in LIMITS:
                raise TypeError(f"limits are {', '.join(LIMITS)}, got {option!r}")
            if limit is not None and (isinstance(limit, bool) or not isinstance(limit, Integral)):
                raise TypeError(f"{option} must be a whole number, got {shown(limit)}")
            if limit is not None and limit < 0:
                raise ValueError(f"{option} must be at least 0, got {limit}")
        self._name = name
        self._given = limits
        self._n_bytes = 0
        self._spent = dict.fromkeys(LIMITS, 0)

    def limit(self, option: str) -> int:
        """The most that the file may have."""
        given = self._given.get(option)
        return max(LIMITS[option].least, int(LIMITS[option].per_byte * self._n_bytes)) if given is None else int(given)

    def has(self, option: str, n: int) -> bool:
        """Whether so many more are allowed."""
        return self._spent[option] + n <= self.limit(option)

    def check(self, option: str, n: int) -> None:
        """Raise an error unless so many more are allowed; they are not counted yet."""
        if not self.has(option, n):
            raise OverLimitError(
                f"{self._name!r} has {self._spent[option] + n} {LIMITS[option].what}, more than the "
                f"{self.limit(option)} of {option}"
            )

    def spend(self, option: str, n: int) -> None:
        """Count so many more; errors as of `check`."""
        self.check(option, n)
        self._spent[option] += n

    def read(self, n_bytes: int) -> None:
        """Count the bytes of a file on disk; errors as of `check`."""
        self.spend("max_bytes", n_bytes)
        self._n_bytes += n_bytes
