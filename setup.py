"""Build `topleft._core.engine.kernels`: one Cython unit, one dispatcher, and the units of `csrc/unit_*.c` for each
instruction set; and the classics, `topleft.methods.classics.classic_kernels`: one Cython unit, for the compiler's
default instruction set.

Everything that is not about compiling stands in `pyproject.toml`. What the engine declares of csrc, and its types for
type checkers, are made by `packaging/bindings.py`. setuptools gives all sources of an extension the same
flags, so `BuildTopleft` compiles each unit by itself and links the objects.

Environment:

TOPLEFT_BUILD_ISA   comma list of the instruction sets to build, scalar always among them, an error when it cannot be;
                    "all": a wheel for other machines; without it the sets that this machine runs
TOPLEFT_WERROR      "1" turns warnings into errors
TOPLEFT_SANITIZE    sanitizers of the compiler, as of -fsanitize=; `.ci/sanitize` builds with them and runs the tests
TOPLEFT_URL         the address of the repository, for links and pictures in the metadata; the release workflow knows it
CC                  on Windows, which clang to take
"""

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from setuptools import Extension, setup
from setuptools.command.build import build
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError, PlatformError

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "packaging"))
import bindings  # noqa: E402

ENGINE = "topleft._core.engine.kernels"
CLASSICS = "topleft.methods.classics.classic_kernels"

WARNINGS = ["-Wall", "-Wextra"]
# -ffp-contract=off and -fno-fast-math stand after whatever CFLAGS holds: the same bits on every machine depend on them.
# What compiles sooner draws later. -O2 -fvect-cost-model=dynamic takes 0.78 of the time to build, and calls take 1.12
# (mean of 43 with AVX-512; up to 1.44); with -fpeel-loops, too, 0.85 and 1.05 (of 14; up to 1.16); -O3 -fno-gcse
# -fno-schedule-insns2 0.95 and 1.01 (of 14; up to 1.08); -O2 -fno-tree-vectorize 0.75 and 1.15 (of 75 with AVX2; 2.8).
# Link-time optimisation could move code between units of different instruction sets. Debug information, which Python
# asks for, would be nine tenths of the library and a third of the time: only `build_ext --debug` makes it.
FLAGS_C = [
    "-std=c11", "-O3", "-g0", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", "-fvisibility=hidden",
    "-fno-lto",
]  # fmt: skip
# Cython's output is not ours to clean: it has the usual harmless findings of generated code. It converts arguments; -O2
# takes twice the time to compile for no call that is measurably faster; -Og saves a third of it, and costs the smallest
# calls 5 %. Python's limited API, one wheel for every Python from 3.11 on, costs them 4 to 16 % (Zen 3, Cython 3.3.1).
FLAGS_CYTHON = [
    "-O1", "-g0", "-ffp-contract=off", "-fno-fast-math", "-fvisibility=hidden", "-fno-lto",
    "-Wno-unused-function", "-Wno-unused-parameter", "-Wno-missing-field-initializers", "-Wno-cast-function-type",
]  # fmt: skip
# The kernels of other units, which a unit includes with what it needs of their files. `csrc/kernels.c` has all.
FLAGS_UNIT = ["-Wno-unused-function"]
# The classics do their arithmetic in the unit that Cython makes, from their headers.
FLAGS_CLASSIC = [*FLAGS_CYTHON, "-O3", "-fno-math-errno"]
# For findings of a sanitizer: where they are, and integers whose overflow the language does not define. Pointers are
# checked by AddressSanitizer where memory is accessed: without three checks of UBSan a unit takes 0.6 of the time. The
# first finding ends the process, so that no code is made for what comes behind it: 0.92 of the time.
FLAGS_SANITIZED = [
    "-O1", "-g1", "-fno-omit-frame-pointer", "-fno-wrapv", "-fno-sanitize=null,object-size,pointer-overflow",
    "-fno-sanitize-recover=all",
]  # fmt: skip
# gcc 12 moves halves of vectors through a register of MMX, and leaves the floating point of x87 in ruins.
FLAGS_SSE41 = ["-msse4.1", "-mpopcnt", "-mno-mmx"]
FLAGS_AVX2 = ["-mavx2", "-mfma", "-mbmi", "-mbmi2", "-mlzcnt", "-mpopcnt"]
FLAGS_AVX512 = [
    *FLAGS_AVX2,
    *("-mavx512f", "-mavx512bw", "-mavx512dq", "-mavx512vl", "-mavx512cd", "-mprefer-vector-width=512"),
]

CPUS_OF_WINDOWS = {"win-amd64": "x86_64", "win-arm64": "aarch64", "win32": "i686"}

# What a compiler has to accept before a unit is built, if it has the target. Scalar: C11, no excess precision.
PROBE_SCALAR = """
#include <float.h>
#if FLT_EVAL_METHOD != 0
#error "floating point has excess precision"
#endif
_Static_assert(sizeof(double) == 8, "float64");
"""
PROBE_SIMD128 = """
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "big-endian"
#endif
typedef float lanes __attribute__((vector_size(16)));
lanes probe(lanes a) { return a * a; }
"""
PROBE_AVX2 = """
#include <immintrin.h>
int probe(__m256i a) { return (int)_lzcnt_u32((unsigned)_mm256_movemask_epi8(_mm256_abs_epi32(a))); }
"""
PROBE_AVX512 = """
#include <immintrin.h>
__m512i probe(__m512i a, __mmask64 m) { return _mm512_mask_mullo_epi64(_mm512_lzcnt_epi32(a), (__mmask8)m, a, a); }
"""


@dataclass(frozen=True)
class Isa:
    """An instruction set on one target: a macro of the target's compilers, flags of its units, a text to try."""

    name: str
    target: str
    flags: list[str]
    probe: str
    is_built_unasked: bool = True


# On x86-64 vectors of 128 bits are for tests: a wheel would grow by 0.7 MB, and nearly every machine has AVX2. The unit
# has 128-bit integers of two words, so that the gate compares these with the compiler's. Nobody waits for its pictures:
# -O1 takes half the time to compile, and leaves the same bits.
ISAS = [
    Isa("scalar", "__STDC__", [], PROBE_SCALAR),
    Isa("simd128", "__aarch64__", [], PROBE_SIMD128),
    Isa("simd128", "__wasm__", ["-msimd128"], PROBE_SIMD128),
    Isa("simd128", "__x86_64__", [*FLAGS_SSE41, "-DTL_NO_INT128", "-O1"], PROBE_SIMD128, is_built_unasked=False),
    Isa("avx2", "__x86_64__", FLAGS_AVX2, PROBE_AVX2),
    Isa("avx512", "__x86_64__", FLAGS_AVX512, PROBE_AVX512),
]


def wanted_isas() -> set[str]:
    """Return the instruction sets named by TOPLEFT_BUILD_ISA, {"all"}, or none when the machine shall decide."""
    names = {name.strip() for name in os.environ.get("TOPLEFT_BUILD_ISA", "").split(",") if name.strip()}
    if not names or names == {"all"}:
        return names
    known = list(dict.fromkeys(isa.name for isa in ISAS))
    if unknown := sorted(names - set(known)):
        raise PlatformError(f"TOPLEFT_BUILD_ISA must list some of {', '.join(known)}, got {', '.join(unknown)}")
    return names | {"scalar"}


def digest(*parts: object) -> str:
    """Return a hash of values and of the contents of files."""
    result = hashlib.sha256()
    for part in parts:
        data = part.name.encode() + b"\0" + part.read_bytes() if isinstance(part, Path) else repr(part).encode()
        result.update(len(data).to_bytes(8, "little") + data)
    return result.hexdigest()


def files_in(folder: str, *suffixes: str) -> list[Path]:
    """Return the files in and below a folder that end in one of the suffixes, sorted."""
    return sorted(path for path in (ROOT / folder).rglob("*") if path.suffix in suffixes)


def with_includes(path: Path, found: dict[Path, None]) -> dict[Path, None]:
    """Add a file of csrc and all that it includes, which are named from that folder."""
    if path not in found:
        found[path] = None
        for name in re.findall(r'^#include "([^"]+)"', path.read_text(encoding="utf-8"), re.MULTILINE):
            with_includes(ROOT / "csrc" / name, found)
    return found


def make_once(target: Path, key: str, make) -> None:
    """Call `make` unless `target` was made from the same key before. Contents decide, not time stamps.

    `make` works in a folder of its own and moves the result here, so that two builds at a time never see half a file.
    """
    stamp = target.with_name(target.name + ".key")
    if target.exists() and stamp.exists() and stamp.read_text() == key:
        return
    stamp.unlink(missing_ok=True)
    make()
    stamp.write_text(key)


class BuildAnew(build):
    """Begin with an empty folder: a module that is gone would stay in it, and come into the wheel.

    A compiler that is missing is told before anything is copied, so that the sentence stands alone.
    """

    def run(self) -> None:
        command = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "")
        if os.name != "nt" and command and shutil.which(command[0]) is None:
            raise CompileError(f"topleft needs gcc or clang, and finds no {command[0]!r}: install one, or set CC")
        shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()


class BuildTopleft(build_ext):
    """Compile each unit with its own flags, rebuild what changed, link."""

    cython_lock = Lock()  # Cython's compiler is not made for threads

    def finalize_options(self) -> None:
        super().finalize_options()
        self.parallel = self.parallel or os.cpu_count()

    def build_extensions(self) -> None:
        """Compile the units of all extensions in one pool, and link each extension as soon as its units are there."""
        # pip gives an editable build a folder that it deletes: the next build in the checkout would begin anew.
        kept = ROOT / "build" / f"temp.{self.plat_name}-{sys.implementation.cache_tag}"
        self.temp = (kept if self.editable_mode else Path(self.build_temp).resolve()) / "topleft"
        self.temp.mkdir(parents=True, exist_ok=True)
        if os.name == "nt":
            self.compiler = self.clang_for_windows()
        compiler = self.compiler.compiler_so
        try:
            version = subprocess.run([compiler[0], "--version"], capture_output=True, check=False).stdout
        except OSError as error:
            raise CompileError(f"topleft needs gcc or clang, and cannot run {compiler[0]!r}: {error}") from error
        self.identity = (compiler, version, self.include_dirs)

        warnings = [*WARNINGS, *(["-Werror"] if os.environ.get("TOPLEFT_WERROR") == "1" else [])]
        sanitizers = os.environ.get("TOPLEFT_SANITIZE")
        last = [f"-fsanitize={sanitizers}", *FLAGS_SANITIZED] if sanitizers else []
        plain = ["-O0"] if sanitizers else []
        with ThreadPoolExecutor(self.parallel) as pool:
            waiting = []
            for ext in self.extensions:  # the engine first
                units = self.engine_units(ext, pool) if ext.name == ENGINE else self.classic_units(ext)
                # The engine's unit of Cython only converts arguments: without sanitizers, in 0.4 of the time of -O1.
                checks = [last if ext.name != ENGINE or isinstance(source, Path) else plain for source, _, _ in units]
                jobs = [
                    pool.submit(self.compile_unit, source, [*warnings, *own, *check], define)
                    for (source, own, define), check in zip(units, checks, strict=True)
                ]
                waiting.append((ext, jobs))
            for ext, jobs in waiting:
                self.link(ext, [str(job.result()) for job in jobs], last)

    def clang_for_windows(self):
        """Return clang, with Microsoft's headers and libraries, in place of the compiler that Python has chosen.

        Microsoft's has neither the attributes nor the built-in functions that the kernels use. gcc for Windows has, but
        aligns vectors of 32 and 64 bytes on the stack to 16 (GCC bug 54412), which ends the process.
        """
        from distutils.ccompiler import new_compiler  # that of setuptools

        clang = shutil.which(os.environ.get("CC", "clang"))
        if clang is None:
            raise PlatformError("topleft needs clang on Windows: install LLVM, or let CC name its clang")
        command = [clang, f"--target={CPUS_OF_WINDOWS[self.plat_name]}-pc-windows-msvc", "-DNDEBUG"]
        compiler = new_compiler(compiler="unix")
        # The linker makes an import library, which is not for the wheel.
        shared = ["-shared", "-fuse-ld=lld", "-Xlinker", f"-implib:{self.temp / 'import.lib'}"]
        compiler.set_executables(compiler_so=command, linker_so=[*command, *shared])
        compiler.macros = self.compiler.macros  # Py_GIL_DISABLED, where it is
        compiler.set_library_dirs(self.library_dirs)
        return compiler

    def link(self, ext: Extension, objects: list[str], flags: list[str]) -> None:
        """Link the objects of an extension; on Windows headers name the libraries, Python's, too."""
        self.compiler.link_shared_object(
            objects,
            self.get_ext_fullpath(ext.name),
            libraries=[] if os.name == "nt" else [*self.get_libraries(ext), "m"],
            library_dirs=ext.library_dirs,
            runtime_library_dirs=ext.runtime_library_dirs,
            export_symbols=self.get_export_symbols(ext),
            extra_postargs=flags,
            debug=self.debug,
            build_temp=str(self.temp),
            target_lang="c",
        )

    def engine_units(
        self, ext: Extension, pool: ThreadPoolExecutor
    ) -> list[tuple[Path | Extension, list[str], list[tuple[str, str]]]]:
        """Return the units of the engine: source, or extension that Cython translates; flags; macros.

        What takes longest stands first, so that no core waits for it at the end.
        """
        isas = self.isas_to_build(pool)
        flags = {isa.name: FLAGS_C + isa.flags for isa in isas}
        macros = [("TL_VERSION", quoted(self.distribution.get_version()))]
        for name, unit_flags in flags.items():
            # Paths say where a machine keeps things, not how the code was compiled.
            told = [flag for flag in [*self.compiler.compiler_so[1:], *unit_flags] if "/" not in flag]
            macros += [(f"TL_HAVE_{name.upper()}", "1"), (f"TL_FLAGS_{name.upper()}", quoted(" ".join(told)))]

        units = [(ext, FLAGS_CYTHON, [])]
        for name, unit_flags in reversed(flags.items()):
            for source in sorted((ROOT / "csrc").glob("unit_*.c")):
                own_macros = [("TL_ISA", name), ("TL_UNIT", source.stem.removeprefix("unit_"))]
                own_macros += [("TL_USE_SIMD128", "1")] * (name == "simd128")
                units.append((source, unit_flags + FLAGS_UNIT, own_macros))
        return [*units, (ROOT / "csrc/dispatch.c", FLAGS_C, macros)]

    def classic_units(self, ext: Extension) -> list[tuple[Path | Extension, list[str], list[tuple[str, str]]]]:
        """Return the units of the classics: what draws, and what draws with its steps told."""
        return [(ext, FLAGS_CLASSIC, []), (ROOT / Path(ext.sources[0]).with_name("steps.c"), FLAGS_C, [])]

    def isas_to_build(self, pool: ThreadPoolExecutor) -> list[Isa]:
        """Return the sets to build: those asked for, all that the compiler can build, or those of this machine."""
        wanted = wanted_isas()
        accepted = [isa for isa, is_accepted in zip(ISAS, pool.map(self.can_build, ISAS), strict=True) if is_accepted]
        names = {isa.name for isa in accepted}
        if "scalar" not in names:
            raise CompileError("topleft needs gcc or clang with C11, and a machine without excess precision")
        if missing := sorted(wanted - names - {"all"}):
            raise CompileError(f"TOPLEFT_BUILD_ISA asks for {', '.join(missing)}, which this compiler cannot build")
        unasked = [isa for isa in accepted if isa.is_built_unasked]
        if wanted == {"all"}:
            return unasked
        return [isa for isa in accepted if isa.name in wanted] if wanted else self.of_this_machine(unasked)

    def of_this_machine(self, isas: list[Isa]) -> list[Isa]:
        """Return the sets that this machine runs; all where the compiler builds for other machines."""
        native = [*FLAGS_C, "-march=native"]
        return [isa for isa in isas if self.accepts(native, isa.probe)] if self.accepts(native, "") else isas

    def can_build(self, isa: Isa) -> bool:
        """Whether the compiler builds for the target of a unit, which may be no machine like this, and the unit."""
        if not self.accepts(FLAGS_C, f"#ifndef {isa.target}\n#error another target\n#endif\n"):
            return False
        if not self.accepts(FLAGS_C + isa.flags, isa.probe):
            self.warn(f"no {isa.name} unit: this compiler cannot build it")
            return False
        return True

    def accepts(self, flags: list[str], text: str) -> bool:
        """Whether the compiler takes the flags and compiles the text."""
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder, "probe.c")
            source.write_text(text)
            command = [*self.compiler.compiler_so, *flags, "-c", str(source), "-o", str(source.with_suffix(".o"))]
            return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def cython(self, ext: Extension) -> Path:
        """Return the C file made from the .pyx file, in the build folder: the source tree stays as it is."""
        import Cython
        from Cython.Compiler.Main import CompilationOptions, compile_single

        source = ROOT / ext.sources[0]
        target = self.temp / (source.stem + ".c")
        contract = bindings.contract()

        def make() -> None:
            self.temp.joinpath("contract.pxi").write_text(contract, encoding="utf-8")
            with tempfile.TemporaryDirectory(dir=self.temp) as folder:
                made = Path(folder, target.name)
                options = CompilationOptions(output_file=str(made), language_level=3, include_path=[str(self.temp)])
                if compile_single(str(source), options, ext.name).num_errors:
                    raise CompileError(f"Cython found errors in {source.relative_to(ROOT)}")
                os.replace(made, target)

        included = files_in(str(source.parent.relative_to(ROOT)), ".pxd", ".pxi")
        with self.cython_lock:
            make_once(target, digest(Cython.__version__, ext.name, contract, source, *included), make)
        return target

    def compile_unit(self, source: Path | Extension, flags: list[str], macros: list[tuple[str, str]]) -> Path:
        """Return the object of one source, compiled again when the source, a header or a flag changed."""
        folder = (ROOT / source.sources[0] if isinstance(source, Extension) else source).parent
        own_headers = [] if folder.is_relative_to(ROOT / "csrc") else files_in(str(folder.relative_to(ROOT)), ".h")
        if isinstance(source, Extension):
            source = self.cython(source)
        target = self.temp / f"{'_'.join([source.stem, *filter(None, [dict(macros).get('TL_ISA')])])}.o"
        is_ours = source.is_relative_to(ROOT / "csrc")  # other units include the headers of the contract alone
        headers = with_includes(source if is_ours else ROOT / "csrc/dispatch.h", {})
        sources = [source, *headers, *own_headers]

        def make() -> None:
            with tempfile.TemporaryDirectory(dir=self.temp) as folder:
                (made,) = self.compiler.compile(
                    [os.path.relpath(source)],
                    output_dir=folder,
                    macros=macros,
                    include_dirs=[str(ROOT / "csrc"), *{str(path.parent) for path in own_headers}, *self.include_dirs],
                    debug=self.debug,
                    extra_postargs=[*flags, "-g"] if self.debug else flags,
                )
                os.replace(made, target)

        make_once(target, digest(self.identity, flags, macros, self.debug, *sources), make)
        return target


def quoted(text: str) -> str:
    """Return a C string literal."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


PAGES = {
    "Homepage": "", "Source": "", "Documentation": "/tree/HEAD/docs", "Issues": "/issues",
    "Changelog": "/blob/HEAD/CHANGELOG.md",
}  # fmt: skip


def readme(url: str | None) -> str:
    """Return README.md; its files, which are beside it in the repository alone, by their addresses there."""
    text = Path(ROOT, "README.md").read_text(encoding="utf-8")
    if not url:
        return text
    elsewhere = r"(?!https?:|#)"
    text = re.sub(rf"(!\[[^]]*\]\(){elsewhere}", rf"\g<1>{url}/raw/HEAD/", text)
    return re.sub(rf"(\[[^]]*\]\(){elsewhere}", rf"\g<1>{url}/blob/HEAD/", text)


url = os.environ.get("TOPLEFT_URL")
bindings.write_stub()  # before any command: a wheel holds it, and type checkers read it in a checkout
setup(
    long_description=readme(url),
    long_description_content_type="text/markdown",
    ext_modules=[Extension(name, [f"src/{name.replace('.', '/')}.pyx"]) for name in (ENGINE, CLASSICS)],
    cmdclass={"build": BuildAnew, "build_ext": BuildTopleft},
    project_urls={name: url + path for name, path in PAGES.items()} if url else {},
)
