"""How much of an accuracy record to measure, and how long."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.scenes.families import FRAME_PX


@dataclass(frozen=True)
class Options:
    """How much to do."""

    methods: Sequence[str] = ()
    """All that fill for none."""
    peers: Sequence[str] = ()
    rounds: int = 7
    seconds: float = 0.02
    edge_px: int = 1_000_000
    """Edge pixels of a family that errors are counted on, at least."""
    frame_px: int = FRAME_PX
    scale: float = 1.0
    """Of the numbers of triangles."""
    max_threads: int = os.cpu_count() or 1
