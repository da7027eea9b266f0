"""`prove.py` sees a planted error of each kind, and docs/design/proofs.md lists its claims and what is only tested."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("z3")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/design/proofs.md").read_text(encoding="utf-8")

#: A claim that must fail, a file of csrc or of src, its text, and the error in its place.
PLANTED = {
    "a band halved": ("float-boxes", "raster/triangles_float.c", "0x1.8p-20f /* 24 u */", "0x1.8p-21f /* 24 u */"),
    "a slack of quotients halved": ("float-rows", "raster/refine.c", "BAND 0x1.2p-19f", "BAND 0x1.2p-20f"),
    "a comment that says more": ("float-rows", "raster/triangles_float.c", "< 5.01 u XY < M", "< 4.01 u XY < M"),
    "finer steps": ("steps", "raster/single_float.c", "TL_STEP_BITS 40", "TL_STEP_BITS 44"),
    "a smaller bound of signs": ("signs", "exact/sign.c", "(3.0 + 16.0 * 0x1p-53)", "(3.0 - 16.0 * 0x1p-53)"),
    "rounded weights": ("exact-weights", "pixels/weights_exact.c", "0x1p-32 > bound", "0x1p-29 > bound"),
    "slivers by float64": ("weights", "pixels/weights_exact.c", "0x1p12 >= box", "0x1p15 >= box"),
    "ties by float64": ("ties-of-colours", "pixels/paint.c", "- 0.5) < 0x1p-20)", "- 0.5) < 0x1p-24)"),
    "slivers by planes": ("depth", "vertex/setup.c", "TL_SLIVER_BITS 12", "TL_SLIVER_BITS 16"),
    "coarser areas": ("areas", "area/area.c", "TL_MAX_EDGE_BITS 14", "TL_MAX_EDGE_BITS 17"),
    "wider blocks": ("rests", "pixels/runs.c", "TL_RUN_BLOCK 32", "TL_RUN_BLOCK 64"),
    "less slack of tiles": ("spans", "tiles/spans.c", "TL_SPAN_SLACK 0x1p-44", "TL_SPAN_SLACK 0x1p-52"),
    "less room for depths": ("hidden-depths", "clusters/cluster_view.c", "error = 0x1p-33", "error = 0x1p-36"),
    "a smaller error of the stage": ("stage", "src/topleft/_core/raster/cluster_draw.py", "2.0**-49", "2.0**-51"),
    "a coefficient of angles": ("angles", "lanes/angle.h", "-0x1.5555555555555p-2", "-0x1.5555555555595p-2"),
    "a range doubled": ("edge-functions", "vertex/fixed.h", "TL_NARROW_LIMIT 0x1p30", "TL_NARROW_LIMIT 0x1p31"),
    "a wide range doubled": ("squares", "vertex/fixed.h", "TL_WIDE_LIMIT 0x1p62", "TL_WIDE_LIMIT 0x1p63"),
    "a larger box": ("lanes", "raster/state.h", "TL_MAX_BOX_PX 62 ", "TL_MAX_BOX_PX 64 "),
    "larger boxes on the grid": ("grid-edges", "raster/triangles_float.c", "BOX 64.0f", "BOX 256.0f"),
    "smaller numbers in sums": ("expansions", "exact/sign.c", ">= 0x1p-440", ">= 0x1p-540"),
    "fewer words": ("comparisons", "exact/sign.c", "TL_BIG_WORDS 68", "TL_BIG_WORDS 64"),
    "a larger shift": ("shifts", "lanes/lanes.h", "vd_set1(0x1.8p44)", "vd_set1(0x1.8p45)"),
    "finer sub-pixels": ("wide-edges", "src/topleft/_core/base/arrays.py", "must be in 0..16", "must be in 0..18"),
    "larger points": ("clouds", "src/topleft/_core/raster/points.py", "1 << 14", "1 << 15"),
    "larger polygons": ("rings", "polygons/polygons.h", "(1 << 24)", "(1 << 27)"),
    "farther windows": ("windows", "src/topleft/_core/raster/choices.py", "< 2**29", "< 2**31"),
    "a longer reference": ("references", "src/topleft/methods/reference/integers.py", "= 2**29", "= 2**30"),
    "a sample moved": ("samples", "src/topleft/_core/raster/sampling.py", "(7, -7)", "(7, -5)"),
    "a length left out": ("lengths", "pixels/png.c", "35, 43, 51", "35, 44, 51"),
    "a bias turned": (
        "bias", "raster/triangles_fixed.c", "vi_sub(doubled, vi_set1(1))", "vi_add(doubled, vi_set1(1))",
    ),
    "another edge function": ("one-owner", "vertex/fixed.h", "2E = dx * (2py - 2ay) -", "2E = dx * (2py - 2ay) +"),
    "a character of a count": ("counts", "pixels/rle.c", "(int)(x & 31)", "(int)(x & 15)"),
    "top turned to bottom": ("owners", "raster/walk.h", "(dy == 0 && dx > 0);", "(dy == 0 && dx < 0);"),
    "another corner of squares": ("owners", "raster/walk.h", "(col + (is_outer == (dy < 0)))", "(col + is_outer)"),
    "a bias of lanes turned": ("owners", "raster/triangles_fixed.c", "vi_sub(doubled, vi_set1(1))", "doubled"),
    "half a unit less": ("row-ends-short", "raster/row_edges.h", "vf_set1(0.5f)", "vf_set1(0.03125f)"),
    "a rounding of bytes": ("bytes", "blend/mix_u8.c", "vi_set1(0x00800080)", "vi_set1(0x007f007f)"),
    "a coefficient of light": ("light", "shade/srgb.c", "0x1.66b6eap-2f", "0x1.66c6eap-2f"),
    "a constant of sRGB": ("srgb-tables", "src/topleft/_core/base/color.py", "+ 0.055) / 1.055", "+ 0.056) / 1.055"),
    "a filter of PNG": ("files", "pixels/png.c", "(left ^ above[i]) >> 1", "(left ^ above[i]) >> 2"),
}  # fmt: skip


def path_of(root, name):
    return root / ("" if name.startswith("src/") else "csrc") / name


def prove(*arguments):
    command = [sys.executable, str(ROOT / ".ci/prove.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("claim", "name", "text", "error"), PLANTED.values(), ids=PLANTED)
def test_a_planted_error_is_seen(tmp_path, claim, name, text, error):
    for folder in ("csrc", "src/topleft/_core", "src/topleft/methods"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    path = path_of(tmp_path, name)
    whole = path.read_text(encoding="utf-8")
    assert text in whole
    path.write_text(whole.replace(text, error), encoding="utf-8")
    done = prove("--root", tmp_path, claim)
    assert re.match(rf"{claim} .* NOT PROVED", done.stdout), done.stdout + done.stderr
    assert done.returncode == 1


def test_page_lists_all_claims():
    rows = re.findall(r"^\| `([\w-]+)` \| `([\w./]+)` \|.*\| (\w+) \|", PAGE, re.MULTILINE)
    assert [" ".join(row) for row in rows] == prove("--list").stdout.split("\n")[:-1]


def test_page_names_files_and_constants_that_exist():
    assert [name for name in re.findall(r"`([\w/]+\.(?:c|h|py|pyx|pxi))`", PAGE) if not exists(name)] == []
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "csrc").glob("**/*.[ch]"))
    assert [name for name in re.findall(r"`(TL_\w+)`", PAGE) if name not in code] == []


def test_page_names_each_file_whose_comments_have_bounds():
    left_out = []
    for path in sorted((ROOT / "csrc").glob("**/*.[ch]")):
        comments = re.findall(r"/\*.*?\*/", path.read_text(encoding="utf-8"), re.DOTALL)
        name = path.relative_to(ROOT / "csrc").as_posix()
        left_out += [name] * ("2^" in "".join(comments) and f"`{name}`" not in PAGE)
    assert left_out == []


def exists(name):
    return path_of(ROOT, name).exists() or (ROOT / name).exists()
