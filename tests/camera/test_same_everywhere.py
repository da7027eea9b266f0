"""Cameras and pictures do not depend on what the libraries below NumPy do on this processor."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PROGRAM = Path(__file__).with_name("same_everywhere.py")

#: Of NumPy 1.26 and 2.4, with every OpenBLAS tried.
EXPECTED = "f2cbfe5cd7294d5b5eedf9c894d77a340d3025a035ec960e5bb6064d0efb26e6"

#: OpenBLAS has other kernels for each processor, glibc and NumPy other sines with and without fused multiply-add.
PROCESSORS = {
    "this one": {},
    "old": {
        "OPENBLAS_CORETYPE": "Prescott",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
        "NPY_DISABLE_CPU_FEATURES": " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])),
    },
    "sandybridge": {"OPENBLAS_CORETYPE": "Sandybridge"},
    "haswell": {"OPENBLAS_CORETYPE": "Haswell"},
}


def hash_on(processor):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", PROGRAM],
        env=os.environ | processor,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


@pytest.mark.parametrize("name", PROCESSORS)
def test_cameras_are_the_same_on_every_processor(name):
    assert hash_on(PROCESSORS[name]) == EXPECTED
