"""Compiles the kernels to WebAssembly, for the page that `topleft explore --export` writes.

`python packaging/wasm.py`. In: `src/topleft/_apps/explore/wasm`, `csrc` and the classics. Out: `topleft.wasm` in the
page's folder, which wheels and the sdist take from there; git does not keep it. Browsers have its vectors since 2023.

Needs a clang with the target wasm32-wasi, lld and wasi-libc: on Debian `apt-get install clang lld wasi-libc
libclang-rt-dev-wasm32`. TOPLEFT_WASM_CC names another clang, with its flags; that of a WASI SDK finds its libraries.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CLASSICS = ROOT / "src/topleft/methods/classics"
UNITS = [*sorted((ROOT / "src/topleft/_apps/explore/wasm").glob("*.c")), CLASSICS / "steps.c"]
PAGE = ROOT / "src/topleft/_apps/explore/page"
COMPILER = "clang --target=wasm32-wasi --sysroot=/usr"
FLAGS = [
    "-std=c11", "-O3", "-DNDEBUG", f"-I{ROOT / 'csrc'}", f"-I{CLASSICS}", "-ffp-contract=off", "-fno-fast-math",
    "-fno-math-errno", "-fvisibility=hidden", "-msimd128", "-Wall", "-Wextra", "-Wno-unused-function", "-Werror",
]  # fmt: skip
LINKED = ["-nostartfiles", "-Wl,--no-entry", "-Wl,--gc-sections", "-Wl,-s", "-Wl,-z,stack-size=1048576"]


def compiler() -> list[str]:
    """The compiler and its first flags."""
    return shlex.split(os.environ.get("TOPLEFT_WASM_CC", COMPILER))


def why_not() -> str:
    """What a compiler lacks, "" where it makes a module."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text("#include <math.h>\n#include <string.h>\nfloat probe(float a) { return fmaf(a, a, a); }\n")
        command = [*compiler(), *LINKED, str(source), "-lm", "-o", str(source.with_suffix(".wasm"))]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            return str(error)
        return done.stderr.strip()[:300] if done.returncode else ""


def build() -> Path:
    """Compile the module, unless one made of the same sources stands there."""
    out, stamp = PAGE / "topleft.wasm", ROOT / "build" / "topleft.wasm.key"
    sources = [*sorted((ROOT / "csrc").rglob("*.[ch]")), *sorted(CLASSICS.glob("*.h")), *UNITS, Path(__file__)]
    key = hashlib.sha256(b"\0".join([repr(compiler()).encode(), *(path.read_bytes() for path in sources)])).hexdigest()
    if out.exists() and stamp.exists() and stamp.read_text() == key:
        return out
    with tempfile.TemporaryDirectory() as folder:
        made, objects = Path(folder, out.name), [Path(folder, unit.stem + ".o") for unit in UNITS]
        # Two steps: with -O a clang that links calls Binaryen's wasm-opt where it finds one, and old ones know no SIMD.
        for unit, object_ in zip(UNITS, objects, strict=True):
            subprocess.run([*compiler(), *FLAGS, "-c", str(unit), "-o", str(object_)], check=True)
        subprocess.run([*compiler(), *LINKED, *map(str, objects), "-lm", "-o", str(made)], check=True)
        out.write_bytes(made.read_bytes())
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(key)
    return out


def main() -> int:
    """Build the module; 1 where no compiler can."""
    if told := why_not():
        sys.stderr.write(f"no WebAssembly: {told}\n")
        return 1
    path = build()
    sys.stdout.write(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
