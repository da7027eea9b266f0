"""Check the contents of one sdist and one wheel: `check_dist.py FOLDER`."""

import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def files_below(*folders: str) -> set[str]:
    """Return the source files of the checkout below some folders, without what builds and tests leave there."""
    skipped = {"__pycache__", ".hypothesis"}
    paths = [path for folder in folders for path in ROOT.joinpath(folder).rglob("*") if path.is_file()]
    paths = [path for path in paths if path.suffix not in {".so", ".pyc"} and not skipped & set(path.parts)]
    return {path.relative_to(ROOT).as_posix() for path in paths if ".egg-info/" not in path.as_posix()}


def check(title: str, found: set[str], wanted: set[str], forbidden: set[str]) -> None:
    """End with a message when a wanted file is missing or a forbidden one is there."""
    for problem, names in (("lacks", wanted - found), ("must not hold", found & forbidden)):
        if names:
            sys.exit(f"{title} {problem}: {', '.join(sorted(names))}")
    print(f"{title}: {len(found)} files")


def main(folder: Path) -> None:
    (wheel,) = folder.glob("*.whl")
    (sdist,) = folder.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        in_wheel = set(archive.namelist())
    with tarfile.open(sdist) as archive:
        in_sdist = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}

    package = {name.removeprefix("src/") for name in files_below("src/topleft")}
    modules = {
        name for name in package if name.endswith((".py", ".pyi", "py.typed", ".json", ".html", ".css", ".js", ".wasm"))
    }
    units = {name.removesuffix(".pyx") for name in package if name.endswith(".pyx")}
    extensions = {name for name in in_wheel if name.endswith((".so", ".pyd"))}
    metadata = {name for name in in_wheel if ".dist-info/" in name}
    compiled = sorted(name.partition(".")[0] for name in extensions)
    if compiled != sorted(units) or not any(name.endswith("/licenses/LICENSE") for name in metadata):
        found = ", ".join(sorted(extensions | metadata))
        sys.exit(f"{wheel.name} must hold the license and these, compiled: {', '.join(sorted(units))}; got {found}")
    check(wheel.name, in_wheel, modules, in_wheel - modules - extensions - metadata)

    top = {
        "LICENSE",
        "MANIFEST.in",
        "README.md",
        "packaging/bindings.py",
        "packaging/size.py",
        "packaging/wasm.py",
        "pyproject.toml",
        "setup.py",
    }
    made = {"src/topleft/_core/engine/kernels.c", "src/topleft/_core/engine/kernels.pyi"}
    built = {name for name in in_sdist if name.endswith((".so", ".o", ".pyc"))} | made
    check(sdist.name, in_sdist, top | files_below("csrc", "src", "tests") - made, built)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
