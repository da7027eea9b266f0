"""The exceptions of the front door: what goes wrong between a file and an array, told in one line.

The core raises `ValueError`, `TypeError` and `IndexError`; what is here is for meshes, files and optional packages.
"""

from __future__ import annotations


class TopleftError(Exception):
    """Base of the exceptions that only this library raises."""


class MeshError(TopleftError, ValueError):
    """A mesh that cannot be used: a broken, empty or unsupported file."""


class ImageError(TopleftError, ValueError):
    """A picture that cannot be written in the format that the name of the file asks for."""


class MissingPackageError(TopleftError, ImportError):
    """An optional package that the call needs is not installed; the message says how to get it."""


class MeshWarning(UserWarning):
    """A part of a mesh file is not read, or a file that it names is missing: the picture will be without it."""
