"""`cached_property` without a lock, as Python has it since 3.12."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property as cached_property
else:

    class cached_property(functools.cached_property):  # noqa: N801
        """An attribute that is computed when it is first read.

        Python 3.11 locks the attribute of all objects of a class meanwhile: threads that read it of different objects
        wait for each other, and a child of ``fork`` waits forever if a thread of its parent held the lock. Without the
        lock two threads may both compute it; both get the value of the thread that ends first.
        """

        def __get__(self, instance: Any, owner: type[Any] | None = None) -> Any:
            """Compute the value and keep it in the ``__dict__`` of the object."""
            if instance is None:
                return self
            return instance.__dict__.setdefault(self.attrname, self.func(instance))
