"""The C compiler of tests that compile something, and the flags of each instruction set, as `setup.py` has them."""

import functools
import os
import platform
import shutil

FLAGS_AVX2 = ("-mavx2", "-mfma", "-mbmi", "-mbmi2", "-mlzcnt", "-mpopcnt")
FLAGS_AVX512 = (*FLAGS_AVX2, "-mavx512f", "-mavx512bw", "-mavx512dq", "-mavx512vl", "-mavx512cd")
FLAGS_SIMD128 = ("-msse4.1", "-mpopcnt", "-mno-mmx") if platform.machine() in ("x86_64", "AMD64") else ()
FLAGS_OF_ISA = {"simd128": FLAGS_SIMD128, "avx2": FLAGS_AVX2, "avx512": FLAGS_AVX512}


@functools.cache
def compiler() -> list[str]:
    """Return the command of the C compiler, empty when there is none."""
    for command in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        if command.strip() and shutil.which(command.split()[0]):
            return command.split()
    return []
