"""What `import topleft` brings along: nothing that is optional, and nothing heavy that most programs do without."""

import subprocess
import sys

import pytest

LATE = ["PIL", "trimesh", "tqdm", "isal", "scipy", "matplotlib", "concurrent.futures", "multiprocessing"]
LATE += ["argparse", "logging", "shutil", "tempfile", "traceback", "tomllib", "json"]


@pytest.mark.parametrize("name", LATE)
def test_import_leaves_for_later(name):
    there = f"{name!r} in sys.modules"
    code = f"import sys, numpy; before = {there}; import topleft; print(before, {there})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    before, after = done.stdout.split()
    assert before == "True" or after == "False"
