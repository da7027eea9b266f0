"""The gate's check of units, `check_units.py` of .ci, finds symbols beside its function and slow instructions."""

import platform
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest
from toolchain import FLAGS_OF_ISA, compiler

ROOT = Path(__file__).parents[2]
FUNCTION = "void tl_set_grad_avx2(void) {}\n"
PEXT = "unsigned long long pack(unsigned long long a, unsigned long long m) { return __builtin_ia32_pext_di(a, m); }"
GATHER = """#include <immintrin.h>
__m256i pack(const int *p, __m256i i) { return _mm256_i32gather_epi32(p, i, 4); }"""
STORE = """#include <immintrin.h>
void NAME(int *p, __m256i m, __m256i a) { _mm256_maskstore_epi32(p, m, a); }"""


@pytest.fixture
def problems(tmp_path, monkeypatch):
    """The problems that the check finds in a unit of AVX2 of a text, its visible functions kept in sight."""
    if platform.machine() not in ("x86_64", "AMD64") or not compiler() or not shutil.which("objdump"):
        pytest.skip("needs x86-64, a C compiler and objdump")
    check = runpy.run_path(str(ROOT / ".ci/check_units.py"))

    def found(text):
        source, made = tmp_path / "unit_grad_avx2.c", tmp_path / "unit_grad_avx2.o"
        source.write_text(FUNCTION + text)
        subprocess.run([*compiler(), "-O2", *FLAGS_OF_ISA["avx2"], "-c", source, "-o", made], check=True)
        return [*check["extra_symbols"](made), *check["slow_code"](made, "avx2")]

    return found


def test_function_alone_passes(problems):
    assert problems("") == []


@pytest.mark.parametrize(("text", "name"), [(PEXT, "pext"), (GATHER, "vpgatherdd")])
def test_planted_instruction_is_told_with_its_function(problems, text, name):
    assert any(f"unit_grad_avx2.o: pack has {name}: " in line for line in problems(text))


def test_masked_store_is_slow_but_in_the_functions_that_are_listed(problems):
    assert any("pack has vpmaskmovd" in line for line in problems(STORE.replace("NAME", "pack")))
    assert not any("vpmaskmovd" in line for line in problems(STORE.replace("NAME", "clear")))


def test_symbol_beside_the_function_is_told(problems):
    assert problems("int other(void) { return 0; }") == [
        "unit_grad_avx2.o must define tl_set_grad_avx2 alone, got ['other', 'tl_set_grad_avx2']"
    ]
