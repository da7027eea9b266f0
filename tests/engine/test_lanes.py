"""The functions of the lanes give the numbers of scalar on every instruction set, where machines differ most."""

import ctypes
import platform
import shutil
import subprocess
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on
from toolchain import FLAGS_OF_ISA, compiler

import topleft as tl

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "tests/portable/lanes.c"
FLAGS = ["-std=c11", "-O1", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", f"-I{ROOT / 'csrc'}"]

#: Other machines, their compilers and what runs their programs.
NODE = "node --no-warnings tests/portable/run_wasi.mjs"
ELSEWHERE = {
    "aarch64": ("aarch64-linux-gnu-gcc -static -DTL_USE_SIMD128", "qemu-aarch64"),
    "WebAssembly": ("clang --target=wasm32-wasi --sysroot=/usr -msimd128 -DTL_USE_SIMD128", NODE),
}


def lines_of(folder, command, flags, runner=()):
    """Compile the program for a set, run it, and return what it prints."""
    program = folder / "lanes"
    made = subprocess.run([*command, *flags, *FLAGS, SOURCE, "-o", program, "-lm"], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return subprocess.run([*runner, program], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    return lines_of(tmp_path_factory.mktemp("scalar"), compiler(), [])


@pytest.mark.parametrize("isa", ["simd128", "avx2", "avx512"])
def test_functions_of_the_lanes_give_the_numbers_of_scalar(isa, expected, tmp_path):
    if isa not in tl.build_info()["isa_available"] and (isa != "simd128" or platform.machine() != "x86_64"):
        pytest.skip(f"{isa} does not run here")
    flags = [*FLAGS_OF_ISA[isa], *(["-DTL_USE_SIMD128"] if isa == "simd128" else [])]
    assert lines_of(tmp_path, compiler(), flags) == expected


@pytest.mark.parametrize("machine", ELSEWHERE)
def test_functions_of_the_lanes_give_the_same_numbers_elsewhere(machine, expected, tmp_path):
    command, runner = (text.split() for text in ELSEWHERE[machine])
    for name in (command[0], runner[0]):
        if not shutil.which(name):
            pytest.skip(f"{name} is not installed")
    if machine == "WebAssembly" and not Path("/usr/include/wasm32-wasi").is_dir():
        pytest.skip("wasi-libc is not installed")
    assert lines_of(tmp_path, command, [], runner) == expected


def boxes_that_end_at(columns):
    """Upright boxes from every column near the first word's end, `columns` wide, and the triangles of each alone."""
    corners, faces = [], []
    for k in range(8):
        left, top, right = 26.0 + k, 3.0 + 9 * k, 26.0 + k + columns
        corners += [(left, top), (right, top + 0.6), (left + 0.3, top + 7.9)]
        faces.append((3 * k, 3 * k + 1, 3 * k + 2))
    return np.array(corners), np.array(faces, np.int32)


@ON_EACH_ISA
@pytest.mark.parametrize("columns", [15, 16, 17, 30, 31, 32, 33, 61, 62, 63, 64, 65])
@pytest.mark.parametrize("bits", [8, "exact"])
def test_rows_that_end_where_words_do_have_the_bits_of_scalar(isa, columns, bits):
    """An int32 has 31 columns of a row, a word of a mask 64; counts run through the code of masks."""
    vertices, triangles = boxes_that_end_at(columns)
    vertices = np.column_stack([vertices, np.linspace(0.1, 0.9, len(vertices))])
    scene, made = (vertices, triangles, (97, 80)), {}
    for name in ("scalar", isa):
        with on(name):
            drawn = tl.rasterize(*scene, subpixel_bits=bits)
            made[name] = [tl.coverage(*scene, subpixel_bits=bits), tl.overdraw(*scene, subpixel_bits=bits)]
            made[name] += [drawn.triangle, drawn.depth]
    for got, wanted in zip(made[isa], made["scalar"], strict=True):
        assert_same(got, wanted)


@ON_EACH_ISA
def test_kernels_leave_the_floating_point_of_the_host_as_it_was(isa):
    """A register of MMX, which gcc 12 once moved colours through, makes NaN of what x87 computes afterwards."""
    vertices, triangles = tl.scenes.blob(2000)
    camera = tl.Camera.look_at((0.2, 0.1, 3), near=0.01, far=100)
    mesh = tl.Mesh(vertices.astype(np.float32), triangles)
    with on(isa):
        for sampling, shading in product(("center", "msaa4"), ("smooth", "ids")):
            tl.render(mesh, camera, (60, 40), sampling=sampling, shading=shading)
            tl.fill(*soup_of(40, 1), np.full((40, 4), 99, np.uint8), (60, 40), per="triangle", blend="over")
            assert np.longdouble(7) % np.longdouble(4) == 3
            assert np.isfinite(np.float32([5.5, 6.5, 7.5]) % np.float32(1)).all()


def soup_of(n, seed):
    """Triangles of 1 to 60 pixels, with depth."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0, 90, (n, 1, 3)) + rng.uniform(-0.5, 0.5, (n, 3, 3)) * rng.uniform(1, 60, (n, 1, 1))
    return corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)


FLUSH = """
#if defined(__aarch64__)
void flush(int is_on)
{
    unsigned long word;
    __asm__ volatile("mrs %0, fpcr" : "=r"(word));
    word = is_on ? word | 1ul << 24 : word & ~(1ul << 24);
    __asm__ volatile("msr fpcr, %0" ::"r"(word));
}
#else
#include <xmmintrin.h>
void flush(int is_on) { _mm_setcsr(is_on ? _mm_getcsr() | 0x8040 : _mm_getcsr() & ~0x8040u); }
#endif
"""


@pytest.fixture(scope="module")
def flush(tmp_path_factory):
    """Sets, as a host library may, that this thread takes numbers below 2^-126, and in float64 2^-1022, for 0."""
    if not compiler() or platform.machine() not in ("x86_64", "aarch64") or platform.system() != "Linux":
        pytest.skip("no C compiler, or no machine that this is written for")
    library = tmp_path_factory.mktemp("flush") / "flush.so"
    library.with_suffix(".c").write_text(FLUSH, encoding="utf-8")
    subprocess.run([*compiler(), "-shared", "-fPIC", "-O1", library.with_suffix(".c"), "-o", library], check=True)
    function = ctypes.CDLL(str(library)).flush
    yield lambda is_on: function(int(is_on))
    function(0)


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [8, "exact"])
def test_host_that_flushes_tiny_numbers_to_zero_gets_the_same_bits(isa, bits, flush):
    """No kernel makes such numbers on its way; those of the caller, a depth of 1e-40, may become 0."""
    scene, made = (*soup_of(300, 2), (97, 80)), []
    mesh = tl.Mesh(*(np.asarray(array) for array in tl.scenes.blob(2000)))
    camera = tl.Camera.look_at((0.2, 0.1, 3), near=0.01, far=100)
    for is_on in (False, True):
        flush(is_on)
        try:
            assert (np.float32(2e-38) * np.float32(0.25) == 0) == is_on
            with on(isa):
                drawn = tl.rasterize(*scene, subpixel_bits=bits)
                colors = np.linspace(0, 1, 1200, dtype=np.float32).reshape(300, 4)
                filled = tl.fill(*scene[:2], colors, scene[2], per="triangle", blend="over", subpixel_bits=bits)
                picture = tl.render(mesh, camera, (60, 40), subpixel_bits=bits)
                made.append([drawn.triangle, drawn.depth, drawn.barycentric(), filled, picture])
        finally:
            flush(False)
    for got, wanted in zip(made[1], made[0], strict=True):
        assert_same(got, wanted)
