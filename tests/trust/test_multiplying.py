"""Small files that multiply two of their parts: each is read or refused in words, within 5 s of the CPU and 1 GB."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "support/hostile/multiplying.py"

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="fork and limits of memory are POSIX")

PAIRS = """
    glb:vertices:indices glb:instances:nodes glb:nodes:stored_indices glb:nodes:joints glb:views:pixels
    glb:primitives:degenerate glb:primitives:colors glb:sparse:set_rows glb:targets:stored_vertices glb:nodes:targets
    glb:channels:targets glb:channels:stored_keys glb:animations:channels glb:nodes:cameras glb:lines:nodes
    glb:overlapping:influences glb:nodes:skins
    obj:spellings:libraries obj:names:pixels obj:uses:materials collada:doubled:lists collada:shared:polygons
    3mf:doubled:triangles 3mf:elsewhere:triangles zip:bytes:shift tar:bytes:members gz:bytes:lines
    packed_ply:strip:pixels levels:other:levels
"""
"""Of the many that the script tries by itself, with files of 5 MB."""


def test_small_files_that_multiply_their_parts_end_in_time():
    command = [sys.executable, SCRIPT, *PAIRS.split(), "--bytes", "200000"]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, f"{ended.stdout[-3000:]}\n{ended.stderr[-1500:]}"
    assert f"{len(PAIRS.split())} files, 0 that must not be" in ended.stdout
