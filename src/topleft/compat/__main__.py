"""Runs a program of another library on topleft as it is: `python -m topleft.compat NAME PROGRAM ...`.

NAME says whose calls topleft answers, one or several with commas between. PROGRAM is a file, or `-m MODULE`; what
follows are its arguments.
"""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import MappingProxyType

USAGE = "usage: python -m topleft.compat NAME[,NAME] (PROGRAM | -m MODULE) [its arguments]\nNAME is one of "


def stands_for(*names: str, module: str) -> Callable[[], None]:
    """What has `import NAME` give a module of topleft, under each of these names."""

    def install() -> None:
        sys.modules.update(dict.fromkeys(names, import_module(f"topleft.compat.{module}")))

    return install


def install_pyrender() -> None:
    """Have `import pyrender` give `topleft.compat.pyrender`, with `pyrender.constants`."""
    stands_for("pyrender", module="pyrender")()
    stands_for("pyrender.constants", module="pyrender.values")()


def install_pytorch3d() -> None:
    """Have PyTorch3D call `rasterize_meshes` of topleft, its `MeshRasterizer` too."""
    own = import_module("topleft.compat.pytorch3d")
    for name in ("renderer", "renderer.mesh.rasterize_meshes", "renderer.mesh.rasterizer"):
        setattr(import_module(f"pytorch3d.{name}"), "rasterize_meshes", own.rasterize_meshes)  # noqa: B010


def install_trimesh() -> None:
    """Have `scene.save_image` of trimesh be that of `topleft.compat.trimesh`, and pyglet open no window on import."""
    os.environ.setdefault("PYGLET_SHADOW_WINDOW", "0")
    import_module("topleft.compat.trimesh").install()


def install_of(module: str) -> Callable[[], None]:
    """The `install` of a module of topleft."""
    return lambda: import_module(f"topleft.compat.{module}").install()


INSTALL: Mapping[str, Callable[[], None]] = MappingProxyType({
    "pyrender": install_pyrender,
    "trimesh": install_trimesh,
    "mujoco": install_of("mujoco"),
    "bop": stands_for("bop_toolkit_lib.rendering.renderer", module="bop"),
    "nvdiffrast": install_of("nvdiffrast"),
    "pytorch3d": install_pytorch3d,
    "custom_rasterizer": stands_for("custom_rasterizer", module="custom_rasterizer"),
    "texture_baker": stands_for("texture_baker", module="texture_baker"),
})  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program that the arguments name; returns the exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    is_module = given[1:2] == ["-m"]
    rest = given[2:] if is_module else given[1:]
    names = given[0].split(",") if given else []
    if not rest or not all(name in INSTALL for name in names):
        sys.stderr.write(f"{USAGE}{', '.join(INSTALL)}\n")
        return 0 if given in (["-h"], ["--help"]) else 2
    if not (is_module or Path(rest[0]).is_file()):
        sys.stderr.write(f"topleft.compat: there is no file {rest[0]!r}\n")
        return 2
    for name in names:
        INSTALL[name]()
    sys.argv = rest
    sys.path.insert(0, str(Path.cwd() if is_module else Path(rest[0]).resolve().parent))
    if is_module:
        runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(rest[0], run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main())
