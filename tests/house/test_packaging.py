"""What the installed package promises: its floor, its dependencies, its build, the choice of the instruction set."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from importlib import import_module, metadata, resources
from inspect import ismodule
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import topleft as tl

ROOT = Path(__file__).parents[2]
ISAS = ["scalar", "simd128", "avx2", "avx512"]


def requirements_of(extra: str) -> set[str]:
    """Names of the distributions that an extra adds, "" for the runtime dependencies, one level deep."""
    found = [Requirement(line) for line in metadata.requires("topleft") or []]
    base = {r.name for r in found if not r.marker or r.marker.evaluate({"extra": ""})}
    if not extra:
        return base
    return {r.name for r in found if r.marker and r.marker.evaluate({"extra": extra})} - base


def run_python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    env = {key: value for key, value in os.environ.items() if key != "TOPLEFT_ISA"} | environment
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=120)


def test_metadata_python_floor_is_3_11():
    floor = SpecifierSet(metadata.metadata("topleft")["Requires-Python"])
    assert ["3.10" in floor, "3.11" in floor, "3.13" in floor] == [False, True, True]


@pytest.mark.parametrize(
    ("extra", "packages"),
    [
        ("", {"numpy", "pillow"}),
        ("render", {"trimesh", "tqdm"}),
        ("torch", {"torch"}),
        ("explore", {"anywidget", "starlette", "uvicorn", "websockets"}),
        ("simplify", {"fast-simplification"}),
    ],
)
def test_metadata_extra_adds_its_packages_alone(extra, packages):
    assert requirements_of(extra) == packages


def test_metadata_runtime_dependencies_state_a_floor():
    found = [Requirement(line) for line in metadata.requires("topleft") or []]
    assert all(r.specifier for r in found if not r.marker)


def test_metadata_extras_are_the_documented_ones():
    documented = ["all", "bench", "dask", "dev", "docs", "explore", "formats", "jax", "peers", "render", "simplify"]
    assert sorted(metadata.metadata("topleft").get_all("Provides-Extra")) == [*documented, "test", "tiles", "torch"]


def test_metadata_version_is_that_of_the_binary():
    assert tl.build_info()["version"] == metadata.version("topleft")


def test_metadata_of_a_release_names_what_the_readme_shows_by_its_address(tmp_path):
    pytest.importorskip("setuptools", minversion="77")
    command = [sys.executable, "setup.py", "-q", "egg_info", "-e", str(tmp_path)]
    address = "https://example.org/team/topleft"
    subprocess.run(command, cwd=ROOT, env=os.environ | {"TOPLEFT_URL": address}, check=True, capture_output=True)
    (folder,) = tmp_path.iterdir()
    text = (folder / "PKG-INFO").read_text(encoding="utf-8")
    assert f"Project-URL: Issues, {address}/issues\n" in text
    assert f"![A torus knot, drawn by topleft]({address}/raw/HEAD/docs/images/torus-knot.png)" in text
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert f"{address}/blob/HEAD/docs/guide/install.md" in targets
    assert all(target.startswith(address) for target in targets)


def test_metadata_license_is_mit():
    assert metadata.metadata("topleft")["License-Expression"] == "MIT"


def test_metadata_command_is_topleft():
    (command,) = metadata.distribution("topleft").entry_points.select(group="console_scripts")
    assert (command.name, command.value) == ("topleft", "topleft.cli:main")


#: The engine, and the kernels of the classics.
UNITS = ["_core.engine.kernels", "methods.classics.classic_kernels"]


@pytest.mark.parametrize("name", ["py.typed", *(unit.replace(".", "/") + ".pyi" for unit in UNITS)])
def test_package_is_typed(name):
    assert resources.files("topleft").joinpath(name).is_file()


def public_names(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    named = {getattr(node, "name", None) or getattr(getattr(node, "target", None), "id", "_"): node for node in body}
    return {name: node for name, node in named.items() if not name.startswith("_") and not is_alias(node)}


def is_alias(node: ast.stmt) -> bool:
    """Tell whether a statement of a stub names a type for the others."""
    return isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation) == "TypeAlias"


@pytest.mark.parametrize("unit", UNITS)
def test_stub_declares_what_the_compiled_module_has(unit):
    module = import_module(f"topleft.{unit}")
    path = resources.files("topleft").joinpath(unit.replace(".", "/") + ".pyi")
    stub = public_names(ast.parse(path.read_text(encoding="utf-8")).body)
    there = {name for name, value in vars(module).items() if not name.startswith("_") and not ismodule(value)}
    assert set(stub) - {"np", "NDArray"} == there
    for name, node in stub.items():
        if isinstance(node, ast.ClassDef):
            own = set(public_names(node.body))
            bases = [stub[base.id].body for base in node.bases if isinstance(base, ast.Name)]
            there = {n for n in vars(getattr(module, name)) if not n.startswith("_")}
            assert own <= there <= own.union(*map(public_names, bases))


@pytest.mark.parametrize("text", ["typedef union { int a; } tl_other;", "typedef long tl_number;", "extern int tl_n;"])
def test_bindings_of_a_header_that_they_cannot_read_is_an_error(text, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "packaging")
    bindings = import_module("bindings")
    monkeypatch.setattr(bindings, "CSRC", tmp_path)
    header = tmp_path / "dispatch.h"
    header.write_text("typedef struct { const int *a, *b; } tl_pair; /* two */\n")
    assert "ctypedef struct tl_pair:\n        const int *a\n        const int *b\n" in bindings.contract()
    header.write_text(text)
    with pytest.raises(ValueError, match="headers must hold what packaging"):
        bindings.contract()


def test_classics_use_no_engine():
    folder = Path(str(resources.files("topleft.methods") / "__init__.py")).parent
    sources = [path for path in folder.rglob("*") if path.name.endswith((".py", ".pyx", ".pxi"))]
    lines = [line for path in sources for line in path.read_text(encoding="utf-8").splitlines()]
    assert not [line for line in lines if "engine" in line and "import" in line]


def test_build_info_has_the_documented_keys():
    assert list(tl.build_info()) == ["version", "compiler", "flags", "isa_built", "isa_available", "isa_missing", "isa"]


def test_build_info_names_isas_from_plain_to_wide():
    info = tl.build_info()
    assert info["isa_built"] == [isa for isa in ISAS if isa in info["isa_built"]]
    assert info["isa_available"] == [isa for isa in info["isa_built"] if isa in info["isa_available"]]
    assert "scalar" in info["isa_available"]


def test_build_info_missing_isas_are_wider_than_all_available():
    info = tl.build_info()
    assert not set(info["isa_missing"]) & set(info["isa_built"])
    assert all(ISAS.index(isa) > ISAS.index(info["isa_available"][-1]) for isa in info["isa_missing"])


def test_build_info_flags_of_each_unit_forbid_contraction():
    info = tl.build_info()
    assert list(info["flags"]) == info["isa_built"]
    assert all("-ffp-contract=off" in flags.split() for flags in info["flags"].values())


def test_build_info_names_the_compiler():
    assert tl.build_info()["compiler"].split()[0] in {"gcc", "clang"}


@pytest.mark.parametrize("isa", [None, "", *tl.build_info()["isa_available"]])
def test_isa_is_the_one_asked_for_or_the_widest_available(isa):
    asked = {} if isa is None else {"TOPLEFT_ISA": isa}
    done = run_python("import topleft as tl; print(tl.build_info()['isa'])", **asked)
    assert done.stdout.split() == [isa or tl.build_info()["isa_available"][-1]], done.stderr


def test_isa_override_unknown_name_lists_the_choices():
    done = run_python("import topleft", TOPLEFT_ISA="sse9")
    choices = ", ".join(tl.build_info()["isa_available"])
    message = f"TOPLEFT_ISA must be one of {choices}, got 'sse9', which is no instruction set that topleft knows"
    assert (done.returncode, done.stderr.splitlines()[-1]) == (1, "ValueError: " + message)


@pytest.mark.parametrize(
    ("built", "reason"), [(["scalar", "avx2"], "which this machine cannot run"), (["scalar"], "which was not built")]
)
def test_isa_override_unavailable_says_why(monkeypatch, built, reason):
    from topleft._core.engine import isa as _isa
    from topleft._core.engine import kernels

    monkeypatch.setenv("TOPLEFT_ISA", "avx2")
    monkeypatch.setattr(kernels, "isa_built", lambda: built)
    monkeypatch.setattr(kernels, "isa_available", lambda: ["scalar"])
    with pytest.raises(ValueError, match=f"TOPLEFT_ISA must be one of scalar, got 'avx2', {reason}"):
        _isa.select()


def test_use_isa_unknown_name_is_an_error_and_changes_nothing():
    from topleft._core import engine

    before = engine.isa_in_use()
    with pytest.raises(ValueError, match="instruction set must be one of scalar"):
        engine.use_isa("sse9")
    assert engine.isa_in_use() == before


def test_version_stands_in_pyproject_and_everything_else_agrees():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    newest = re.search(r"^## \[(\d[^\]]*)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    assert newest is not None
    assert newest[1] == version
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    recipe = ROOT / "packaging/conda/meta.yaml"
    if recipe.exists():  # not in an sdist
        assert f'version = "{version}"' in recipe.read_text(encoding="utf-8")
