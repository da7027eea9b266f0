"""`python -m topleft.compat NAME PROGRAM`: what programs of others get for what they import."""

import sys
from types import ModuleType

import pytest

from topleft.compat import bop, custom_rasterizer, pytorch3d, texture_baker
from topleft.compat.__main__ import main


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs a program, which leaves what it finds in `sys.found`, with empty packages of these names."""

    def run_program(client, line, *packages):
        for name in packages:
            monkeypatch.setitem(sys.modules, name, ModuleType(name))
        for name, value in (("path", sys.path.copy()), ("argv", sys.argv), ("found", None)):
            monkeypatch.setattr(sys, name, value, raising=False)
        program = tmp_path / "program.py"
        program.write_text(f"import sys\n{line}\nsys.found = found\n")
        assert main([client, str(program)]) == 0
        return sys.found

    return run_program


@pytest.mark.parametrize(
    ("client", "line", "expected"),
    [
        ("bop", "from bop_toolkit_lib.rendering.renderer import create_renderer as found", bop.create_renderer),
        ("custom_rasterizer", "import custom_rasterizer as found", custom_rasterizer),
        ("texture_baker", "from texture_baker import TextureBaker as found", texture_baker.TextureBaker),
    ],
)
def test_program_gets_the_module_for_that_of_its_library(run, client, line, expected):
    own = ["bop_toolkit_lib", "bop_toolkit_lib.rendering", "bop_toolkit_lib.rendering.renderer"]
    assert run(client, line, *(own if client == "bop" else [client])) is expected


def test_program_of_pytorch3d_calls_topleft_wherever_it_imports_the_function_from(run):
    names = [f"pytorch3d.renderer{name}" for name in ("", ".mesh", ".mesh.rasterize_meshes", ".mesh.rasterizer")]
    line = "from pytorch3d.renderer import rasterize_meshes as found"
    assert run("pytorch3d", line, "pytorch3d", *names) is pytorch3d.rasterize_meshes
    found = [getattr(sys.modules[name], "rasterize_meshes", None) for name in names[2:]]
    assert found == [pytorch3d.rasterize_meshes] * 2
