"""How much of an accuracy record to measure, and how long."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.harness.arguments import Options, count, fraction, names
from benchmarks.peers import PEERS
from benchmarks.scenes.families import FRAME_PX


@dataclass(frozen=True)
class AccuracyOptions(Options):
    methods: Sequence[str] = names("--method", "all that fill unless given")
    peers: Sequence[str] = names("--peer", "peers; all unless given, none: no names", tuple(PEERS), "*")
    rounds: int = count(7, "--repeats", "rounds")
    seconds: float = fraction(0.02, "--seconds", "length of a turn, at least a call")
    edge_px: int = count(1_000_000, "--edge-pixels", "edge pixels to compare in each family, at least")
    frame_px: int = count(FRAME_PX, "--frame", "side", "PX")
    scale: float = fraction(1.0, "--scale", "of the numbers of triangles timed", "X")
    max_threads: int = count(os.cpu_count() or 1, "--threads", "how far threads are charted")
    parts: Sequence[str] = names("--part", "measure these alone, leave the rest of FILE.json")
