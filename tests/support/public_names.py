"""Names, parameters and defaults that the library promises, as lines of text, and the file of those that must stay.

`python tests/support/public_names.py` writes the file anew: `git diff` shows what a change gives and what it breaks
(docs/guide/promises.md). It needs PyTorch and JAX.
"""

import argparse
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import topleft as tl
from topleft._apps.cli import parser_of_commands
from topleft._core.raster.view import ViewOptions
from topleft._meshes.camera.viewpoints import FramingOptions
from topleft._meshes.picture.shade import LookOptions

FILE = Path(__file__).with_name("public_names.txt")
PAGES = sorted((Path(__file__).parents[2] / "docs" / "api").glob("*.md"))
ENTRY = re.compile(r"^\.\. auto\w+:: topleft\.(\w+)(?:\n   :members: (.+(?:\n {8,}.+)*))?$", re.MULTILINE)

MODULES = ("topleft", "topleft.scenes", "topleft.typing", "topleft.testing", "topleft.torch", "topleft.jax")
SECTIONS = (*MODULES, "keywords", "commands")

#: Options that functions take as one `**name`.
KEYWORDS = (ViewOptions, LookOptions, FramingOptions)

#: Classes that functions return: their constructors are not promised, their attributes are.
RESULTS = (
    tl.Baked, tl.DepthLayers, tl.Detail, tl.Explorer, tl.Fragments, tl.FragmentsBatch, tl.ObjectMasks, tl.Overlap,
    tl.Plan, tl.PointFragments, tl.SceneDepthLayers, tl.SceneFragments, tl.Tiles, tl.ViewLayers,
    tl.VisibleFaces, tl.Voxels, tl.Window,
)  # fmt: skip


def members() -> dict[str, list[str]]:
    """Return the names of `topleft` that the pages of docs/api list, each with the members listed there."""
    found = [entry for page in PAGES for entry in ENTRY.findall(page.read_text(encoding="utf-8"))]
    assert len({name for name, _ in found}) == len(found)
    return {name: re.split(r",\s+", listed) if listed else [] for name, listed in found}


def signature(thing: Any) -> str:
    """Return the parameters and defaults of a function or class, nothing for other things; types are not promised."""
    if not callable(thing) or thing in RESULTS or (isinstance(thing, type) and issubclass(thing, BaseException)):
        return ""
    given = [one.replace(annotation=one.empty) for one in inspect.signature(thing).parameters.values()]
    return str(inspect.Signature([one for one in given if one.name != "self" and not one.name.startswith("_")]))


def attributes(result: type) -> list[str]:
    """Return what the docstring of a class lists as its attributes."""
    section = re.search(r"Attributes\n-+\n(.*?)(?=\n\s*\n|\Z)", inspect.getdoc(result) or "", re.DOTALL)
    return re.split(r",\s+", ", ".join(re.findall(r"(?m)^([\w, ]+?) :", section[1]))) if section else []


def public_lines() -> Iterator[str]:
    """Yield the lines of `topleft`: a function with its parameters, a class with its members."""
    for name, listed in members().items():
        thing = getattr(tl, name)
        yield name + signature(thing)
        if not isinstance(thing, ModuleType):
            kept = {*listed, *(attributes(thing) if thing in RESULTS else ())}
            yield from (f"{name}.{one}{signature(getattr(thing, one, None))}" for one in kept)


def module_lines(module: ModuleType) -> Iterator[str]:
    """Yield the lines of a module: a function with its parameters, an option with its words."""
    for name in members()["scenes"] if module is tl.scenes else module.__all__:
        thing = getattr(module, name)
        words = get_args(thing)
        yield f"{name} = {' | '.join(words)}" if words else name + signature(thing)


def keyword_lines() -> Iterator[str]:
    """Yield the names of options that functions take as `**view` and its kind."""
    for options in KEYWORDS:
        yield f"{options.__name__} = {' | '.join(sorted(options.__annotations__))}"


def command_lines() -> Iterator[str]:
    """Yield each command of a shell with its options."""
    (commands,) = (one for one in parser_of_commands()._actions if isinstance(one, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        yield " ".join([name, *sorted(text for one in command._actions for text in one.option_strings)])


def lines(section: str) -> list[str]:
    """Return the lines of a section, as the code has them now."""
    of = {"topleft": public_lines, "keywords": keyword_lines, "commands": command_lines}.get(section)
    return sorted(of() if of else module_lines(import_module(section)))


def kept_lines(section: str) -> list[str]:
    """Return the lines of a section of the file."""
    _, _, rest = FILE.read_text(encoding="utf-8").partition(f"[{section}]\n")
    return rest.partition("\n[")[0].splitlines()


if __name__ == "__main__":
    FILE.write_text("\n".join("\n".join([f"[{one}]", *lines(one)]) for one in SECTIONS) + "\n")
