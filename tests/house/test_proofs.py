"""`prove.py` sees a planted error of each kind, and docs/design/proofs.md lists its claims."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("z3")

ROOT = Path(__file__).parents[2]

#: A claim that must fail, a file of csrc, its text, and the error in its place.
PLANTED = {
    "a band halved": ("float-boxes", "raster/triangles_float.c", "0x1.8p-20f /* 24 u */", "0x1.8p-21f /* 24 u */"),
    "a slack of quotients halved": ("float-rows", "raster/refine.c", "BAND 0x1.2p-19f", "BAND 0x1.2p-20f"),
    "a smaller bound of signs": ("signs", "exact/sign.c", "(3.0 + 16.0 * 0x1p-53)", "(3.0 - 16.0 * 0x1p-53)"),
    "slivers by float64": ("weights", "pixels/weights_exact.c", "0x1p12 >= box", "0x1p15 >= box"),
    "slivers by planes": ("depth", "vertex/setup.c", "TL_SLIVER_BITS 12", "TL_SLIVER_BITS 16"),
    "coarser areas": ("areas", "area/area.c", "TL_MAX_EDGE_BITS 14", "TL_MAX_EDGE_BITS 17"),
    "a length left out": ("lengths", "pixels/png.c", "35, 43, 51", "35, 44, 51"),
    "a range doubled": ("edge-functions", "vertex/fixed.h", "TL_NARROW_LIMIT 0x1p30", "TL_NARROW_LIMIT 0x1p31"),
    "a larger box": ("lanes", "raster/state.h", "TL_MAX_BOX_PX 62 ", "TL_MAX_BOX_PX 64 "),
    "a bias turned": (
        "bias", "raster/triangles_fixed.c", "vi_sub(doubled, vi_set1(1))", "vi_add(doubled, vi_set1(1))",
    ),
    "half a unit less": ("row-ends-short", "raster/row_edges.h", "vf_set1(0.5f)", "vf_set1(0.03125f)"),
    "a rounding of bytes": ("bytes", "blend/mix_u8.c", "vi_set1(0x00800080)", "vi_set1(0x007f007f)"),
    "a coefficient of light": ("light", "shade/srgb.c", "0x1.66b6eap-2f", "0x1.66c6eap-2f"),
    "a comment that says more": ("float-rows", "raster/triangles_float.c", "< 5.01 u XY < M", "< 4.01 u XY < M"),
}  # fmt: skip


def prove(*arguments):
    command = [sys.executable, str(ROOT / ".ci/prove.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("claim", "name", "text", "error"), PLANTED.values(), ids=PLANTED)
def test_a_planted_error_is_seen(tmp_path, claim, name, text, error):
    shutil.copytree(ROOT / "csrc", tmp_path / "csrc")
    path = tmp_path / "csrc" / name
    path.write_text(path.read_text(encoding="utf-8").replace(text, error), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != (ROOT / "csrc" / name).read_text(encoding="utf-8")
    done = prove("--csrc", tmp_path / "csrc", claim)
    assert re.match(rf"{claim} .* NOT PROVED", done.stdout), done.stdout + done.stderr
    assert done.returncode == 1


def test_page_lists_all_claims():
    page = (ROOT / "docs/design/proofs.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| `csrc/([\w./]+)` \|.*\| (\w+) \|", page, re.MULTILINE)
    listed = prove("--list").stdout.split("\n")
    assert [" ".join(row) for row in rows] == listed[:-1]
