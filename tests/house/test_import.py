"""What `import topleft` brings along: nothing that is optional, and nothing heavy that most programs do without."""

import subprocess
import sys

import pytest

import topleft as tl

LATE = ["PIL", "trimesh", "meshio", "pyvista", "tqdm", "scipy", "matplotlib", "concurrent.futures", "multiprocessing"]
LATE += ["torch", "argparse", "logging", "shutil", "tempfile", "traceback", "tomllib", "json", "fast_simplification"]
LATE += [f"topleft.{name}" for name in ("_apps.batch.batch", "_apps.batch.jobs", "_meshes.picture.transparent")]
LATE += ["topleft.methods.classics.classic_kernels"]


def test_import_leaves_what_most_programs_do_without_for_later():
    code = "import sys, numpy; before = {*sys.modules}; import topleft; print(*{*sys.modules} - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "topleft._core.engine.kernels" in done.stdout.split()
    assert {*LATE} & {*done.stdout.split()} == set()


def test_import_and_calls_ask_for_nothing_that_windows_lacks():
    posix = ["fork", "geteuid", "pread", "register_at_fork", "sched_getaffinity", "sysconf"]
    code = f"import os, numpy; [vars(os).pop(name, None) for name in {posix}]; import topleft as tl; "
    code += "print(tl.coverage([(0, 0), (4, 0), (0, 4)], [(0, 1, 2)], (4, 4), threads=2).sum())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "6"


def test_every_public_name_is_there():
    for name in tl.__all__:
        assert getattr(tl, name) is not None
        assert name in dir(tl)
    with pytest.raises(AttributeError, match="module 'topleft' has no attribute 'nothing'"):
        getattr(tl, "nothing")  # noqa: B009
