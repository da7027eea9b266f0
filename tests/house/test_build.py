"""What `setup.py` builds: the instruction sets of the machine that its compiler builds for."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from toolchain import compiler

import topleft as tl

ROOT = Path(__file__).parents[2]
LIST_ISAS = """
import runpy, sys, types
from concurrent.futures import ThreadPoolExecutor
import setuptools
setuptools.setup = lambda **words: None
sys.argv[0] = "setup.py"
build = runpy.run_path("setup.py")["BuildTopleft"](setuptools.Distribution())
build.compiler = types.SimpleNamespace(compiler_so=sys.argv[1:])
print(*(isa.name for isa in build.isas_to_build(ThreadPoolExecutor(1))))
"""
IS_X86 = platform.machine() in ("x86_64", "AMD64")


def list_isas(*command, **environment):
    """The sets that a build with a compiler would have."""
    if not command or not shutil.which(command[0]):
        pytest.skip(f"{command[0] if command else 'a C compiler'} is not installed")
    pytest.importorskip("setuptools")
    env = {key: value for key, value in os.environ.items() if key != "TOPLEFT_BUILD_ISA"} | environment
    return subprocess.run(
        [sys.executable, "-c", LIST_ISAS, *command], cwd=ROOT, env=env, capture_output=True, text=True
    )


def test_build_for_aarch64_has_its_vectors_wherever_it_runs():
    assert list_isas("aarch64-linux-gnu-gcc").stdout.split() == ["scalar", "simd128"]


def test_build_for_webassembly_has_its_vectors():
    assert list_isas("clang", "--target=wasm32-wasi").stdout.split() == ["scalar", "simd128"]


@pytest.mark.skipif(not IS_X86, reason="of x86-64")
def test_a_build_has_the_sets_of_its_machine_unless_all_are_asked_for():
    assert list_isas(*compiler(), TOPLEFT_BUILD_ISA="all").stdout.split() == ["scalar", "avx2", "avx512"]
    runs = [*tl.build_info()["isa_available"], *tl.build_info()["isa_missing"]]
    assert list_isas(*compiler()).stdout.split() == [name for name in ("scalar", "avx2", "avx512") if name in runs]


@pytest.mark.skipif(not IS_X86, reason="of x86-64")
def test_vectors_of_128_bits_are_built_on_x86_when_they_are_asked_for():
    assert "simd128" not in list_isas(*compiler()).stdout.split()
    assert list_isas(*compiler(), TOPLEFT_BUILD_ISA="simd128").stdout.split() == ["scalar", "simd128"]


def test_sets_of_another_machine_are_refused():
    done = list_isas("aarch64-linux-gnu-gcc", TOPLEFT_BUILD_ISA="simd128,avx2")
    assert "TOPLEFT_BUILD_ISA asks for avx2, which this compiler cannot build" in done.stderr
