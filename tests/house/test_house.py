"""The law of the house, where the linter cannot see it: names, maps, and what comments tell of files.

`lint-imports` holds the floors.
"""

import ast
import inspect
import os
import pickle
import pkgutil
import re
import subprocess
import sys
import typing
from collections import Counter
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest
from engine_cases import one_by_one

import topleft as tl
from topleft._core.engine import kernels

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src" / "topleft"
PUBLIC = [name for name in tl.__all__ if callable(getattr(tl, name))]
ROOMS = sorted(path.parent for path in SRC.rglob("__init__.py") if path.parent != SRC)
PYTHON = sorted(path for folder in ("src", "tests", "benchmarks", "examples") for path in (ROOT / folder).rglob("*.py"))
CYTHON = sorted([*SRC.rglob("*.pyx"), *SRC.rglob("*.pxi")])
C = sorted([*(ROOT / "csrc").rglob("*.c"), *(ROOT / "csrc").rglob("*.h")])

#: Where modules are found: those of the package, of the benchmarks, of tests/support and of the examples.
SUPPORT = ROOT / "tests" / "support"
PLACES = [ROOT / "src", ROOT, SUPPORT, SUPPORT / "hostile", SUPPORT / "references", ROOT / "examples"]


class Facts(NamedTuple):
    """What the tests ask of a file of Python."""

    head: str
    imports: list[ast.Import | ast.ImportFrom]
    attributes: set[tuple[str, str]]  # of plain names
    defined: set[str]
    members: set[str]
    has_products: bool


@cache
def facts(path):
    """The facts of a file; its tree is not kept, since the collector would go through all trees again and again."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = [*ast.walk(tree)]
    attributes = [node for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)]
    return Facts(
        ast.get_docstring(tree) or "",
        [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)],
        {(node.value.id, node.attr) for node in attributes},
        defined_by(tree),
        {name for node in nodes if isinstance(node, ast.ClassDef) for name in members_of(node)},
        any(isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult) for node in nodes),
    )


def defined_by(tree):
    """What a file defines at its top level, also under `if` and `try`."""
    found, waiting = set(), list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif not isinstance(node, ast.Import | ast.ImportFrom):
            stored = (inner for inner in ast.walk(node) if isinstance(inner, ast.Name))
            found |= {inner.id for inner in stored if isinstance(inner.ctx, ast.Store)}
            waiting += [inner for inner in ast.iter_child_nodes(node) if isinstance(inner, ast.stmt)]
    return found


def members_of(node):
    """Class.member of a class."""
    for one in node.body:
        yield f"{node.name}.{getattr(getattr(one, 'target', one), 'id', '')}"
        yield f"{node.name}.{getattr(one, 'name', '')}"


def short(path):
    return path.relative_to(ROOT).as_posix()


# Names


def test_namespace_is_exact():
    assert dir(tl) == sorted(tl.__all__)


def test_no_public_name_is_that_of_a_module_but_scenes():
    assert [name for name in tl.__all__ if find_spec(f"topleft.{name}")] == ["scenes"]


@one_by_one("name", PUBLIC)
def test_public_name_is_of_topleft_and_can_be_pickled_and_looked_into(name):
    value = getattr(tl, name)
    assert value.__module__ == "topleft"
    assert pickle.loads(pickle.dumps(value)) is value
    typing.get_type_hints(value)
    if not isinstance(value, type):
        assert inspect.getsource(value).startswith("def " + name)


def test_late_names_say_topleft_however_they_come():
    code = (
        "import sys, topleft as tl; import topleft._apps.batch.batch as batch;"
        "tl.render_layers; print(batch.Job.__module__, batch.render_batch.__module__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["topleft", "topleft"]


def test_no_two_classes_have_one_name():
    found = Counter()
    others = SRC / "compat"  # the names of other libraries
    for path in [*(path for path in SRC.rglob("*.py") if others not in path.parents), *CYTHON]:
        found.update(re.findall(r"^ *(?:cdef +)?class +(\w+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
    assert not [name for name, n in found.items() if n > 1]


# Imports


@cache
def file_of(module):
    """The file of a module by its dotted name, or None for those of others and compiled ones."""
    for place in PLACES:
        path = place.joinpath(*module.split("."))
        for file in (path / "__init__.py", path.with_suffix(".py")):
            if file.is_file():
                return file
    return None


def names_of(path):
    """What a file defines; of the package, what it says."""
    if path == SRC / "cli.py":  # a door
        return {"main"}
    if path == SRC / "__init__.py":
        return set(tl.__all__)
    if path == SRC / "_core" / "engine" / "__init__.py":  # the face of the compiled unit
        return {name for name in vars(kernels) if not name.startswith("_")}
    return facts(path).defined


@cache
def taken_by(path):
    """The modules of ours that a file imports, by the names it gives them, and what it takes out of others."""
    modules, taken = {}, set()
    for node in facts(path).imports:
        if isinstance(node, ast.Import):
            modules |= {alias.asname: alias.name for alias in node.names if alias.asname and file_of(alias.name)}
        elif file_of(node.module):
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                if file_of(module):
                    modules[alias.asname or alias.name] = module
                elif not SRC.parent.joinpath(*module.split(".")).with_suffix(".pyx").is_file():
                    taken.add((node.module, alias.name))
    return modules, taken


def used_by(path):
    """The attributes of modules of ours that a file uses."""
    modules = taken_by(path)[0]
    for name, attribute in facts(path).attributes:
        if name in modules and not attribute.startswith("__") and not file_of(f"{modules[name]}.{attribute}"):
            yield modules[name], attribute


def test_names_are_imported_from_the_file_that_defines_them():
    found = {(path, *pair) for path in PYTHON for pair in (*taken_by(path)[1], *used_by(path))}
    lost = [
        (path, module, name)
        for path, module, name in found
        if name not in names_of(file_of(module))
        and not module.startswith(("topleft.compat.", "topleft.annex."))  # which publish names of other files
    ]
    assert not lost, "\n".join(sorted(f"{short(path)}: {module}.{name}" for path, module, name in lost))


def test_private_names_stay_in_their_file():
    found = {(path, *pair) for path in PYTHON for pair in taken_by(path)[1]}
    found |= {(path, *pair) for path in PYTHON if ROOT / "tests" not in path.parents for pair in used_by(path)}
    lost = sorted(f"{short(path)}: {module}.{name}" for path, module, name in found if re.match("_[^_]", name))
    assert not lost, "\n".join(lost)


# Rooms


@one_by_one("room", ROOMS)
def test_room_says_what_it_is_and_lists_no_files(room):
    lines = facts(room / "__init__.py").head.splitlines()
    assert lines
    assert [line for line in lines if re.match(r"\w+\.(py|pyx|pxi) +\S", line)] == []


def test_head_of_a_file_says_what_it_is():
    lost = [path for path in PYTHON if not facts(path).head]
    begins = re.compile(r'(?:# cython:[^\n]*\n)*(?:# |/\* |""")\w')
    lost += [path for path in [*CYTHON, *C] if not begins.match(path.read_text(encoding="utf-8"))]
    assert not lost, "\n".join(map(short, lost))


def test_exports_are_listed_in_public_files_alone():
    listed = [path for path in PYTHON if "__all__" in names_of(path)]
    assert [short(path) for path in listed if re.search("/_[^_]", short(path))] == []


# Numbers

#: On the way from a camera to a picture: NumPy's products, inverses and most of its angles are those of libraries that
#: choose their code by the processor, and differ in last bits. `engine.product` and its neighbours do not.
SAME_EVERYWHERE = (
    "_core/raster", "_meshes/camera", "_meshes/io", "_meshes/model", "_meshes/picture", "_meshes/scene", "_apps/tiles",
)  # fmt: skip
CHOSEN_BY_PROCESSOR = {
    *("dot", "einsum", "inner", "linalg", "matmul", "tensordot", "vdot"),
    *("acos", "arccos", "arcsin", "arctan", "arctan2", "asin", "atan", "atan2", "cbrt", "cos", "exp", "hypot", "log"),
    *("log2", "pow", "power", "sin", "tan"),
}
ALLOWED = {
    "src/topleft/_meshes/camera/camera.py": {"linalg", "arctan"},  # the error, and four digits for people
    "src/topleft/_meshes/camera/matrices.py": {"linalg"},  # the error
    "src/topleft/_meshes/model/joined.py": {"linalg"},  # of a matrix without an inverse
    "src/topleft/_meshes/picture/bend.py": {"@", "arccos"},  # whole numbers; what cannot show, with room to spare
}


@pytest.mark.parametrize("room", SAME_EVERYWHERE)
def test_pictures_do_not_depend_on_code_that_the_processor_chooses(room):
    found = {}
    for path in (SRC / room).glob("*.py"):
        used = {attribute for name, attribute in facts(path).attributes if name in ("np", "math")}
        products = {"@"} if facts(path).has_products else set()
        found[short(path)] = used & CHOSEN_BY_PROCESSOR | products
    assert {path: names for path, names in found.items() if names - ALLOWED.get(path, set())} == {}


# Comments

FILE_NAME = r"(?<![\w*{<])((?:[\w-]+/)*[\w-]+\.(?:py|pyx|pxi|pyi|c|h|md))\b(?![*}])"


#: A comment of Python, or a string; those that begin a line are docstrings.
COMMENT_OR_STRING = re.compile(
    r"""\#[^\n]*|(?P<start>^[ \t]*)?[rbfuRBFU]{0,2}(?:\"{3}(?:[^"\\]|\\.|"(?!""))*\"{3}|'{3}(?:[^'\\]|\\.|'(?!''))*'{3}
    |"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')""",
    re.MULTILINE | re.DOTALL | re.VERBOSE,
)


@cache
def comments_of(path):
    """The comments and docstrings of a file."""
    text = path.read_text(encoding="utf-8")
    if path in C:
        return "\n".join(re.findall(r"/\*.*?\*/|//[^\n]*", text, flags=re.DOTALL))
    found = COMMENT_OR_STRING.finditer(text)
    return "\n".join(one[0] for one in found if one[0].startswith("#") or one["start"] is not None)


@cache
def project_files():
    """The files of the project, and what makes and tests them."""
    tops = [path for path in ROOT.iterdir() if path.name != "build" and (path.name[0] != "." or path.name == ".ci")]
    return [path for top in tops for path in ([top] if top.is_file() else top.rglob("*"))]


@cache
def known_files():
    """The files of the project, by every end of their paths."""
    paths = [path.relative_to(ROOT).parts for path in project_files()]
    return {"/".join(parts[i:]) for parts in paths for i in range(len(parts))}


def test_files_and_names_in_comments_exist():
    members = set().union(*(facts(path).members for path in SRC.rglob("*.py")))
    lost = []
    for path in [*PYTHON, *CYTHON, *C]:
        text = comments_of(path)
        names = [name for name in re.findall(FILE_NAME, text) if name not in known_files()]
        names += [name for name in re.findall(r"`(topleft(?:\.\w+)+)", text) if not resolves(name)]
        names += [name for name in re.findall(r"\bsee `([A-Z]\w+\.\w+)`", text) if name not in members]
        lost += [f"{short(path)}: {name}" for name in names]
    assert not lost, "\n".join(lost)


#: Names of other programs and formats that comments tell of, and examples of names.
FOREIGN = {
    "_get_mask_funcs", "_get_rasterize_funcs", "inverted_cdf", "map_Pm", "pos_clip", "read_write_model", "to_raster",
}  # fmt: skip


def code_without_comments(path):
    """The text of a file without its comments, of a page its blocks of code."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".md", ".rst"):
        return "\n".join(re.findall(r"```.*?```", text, flags=re.DOTALL))
    if path.suffix in (".c", ".h", ".js", ".mjs", ".css"):
        return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.DOTALL)
    return re.sub(r'"""(?!, ).*?"""|#[^\n]*', " ", text, flags=re.DOTALL) if path in {*PYTHON, *CYTHON} else text


def test_names_in_backticks_exist():
    """Of comments, and of the pages for who changes things: users' pages tell of other programs."""
    suffixes = {".c", ".h", ".py", ".pyx", ".pxi", ".js", ".mjs", ".css", ".html", ".md", ".toml", ".yml", ".json"}
    files = [path for path in project_files() if "records" not in path.parts]
    texts = [code_without_comments(path) for path in files if path.suffix in suffixes]
    known = set(re.findall(r"\w+", "\n".join([*texts, *(path.stem for path in files)])))
    pages = [ROOT / "CONTRIBUTING.md", *ROOT.glob("csrc/*.md"), *(ROOT / "docs/design").glob("*.md")]
    told = {path: comments_of(path) for path in [*PYTHON, *CYTHON, *C] if "tests" not in path.parts}
    told |= {path: re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL) for path in pages}
    lost = []
    for path, text in told.items():
        names = re.findall(r"\b_?[a-z]\w+_\w+\b", " ".join(re.findall(r"`([^`\n]+)`", text)))
        lost += [f"{short(path)}: {name}" for name in names if name not in known | FOREIGN and "NAME" not in name]
    assert not lost, "\n".join(lost)


@cache
def resolves(name):
    if file_of(name):  # `topleft.torch` needs PyTorch to be imported
        return True
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError):
        return False
    return True


def test_gate_fails_when_more_tests_skip_than_its_list_allows(tmp_path):
    (tmp_path / "may_skip.txt").write_text("# none of these\n")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "xdist.plugin", "-n", "1"]
    command += ["tests/base/test_interpreters.py", "-k", "test_python_without_a_gil"]
    environment = {**os.environ, "TOPLEFT_MAY_SKIP": str(tmp_path / "may_skip.txt")}
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # half of the time is theirs
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert ended.returncode == 1, ended.stdout
    assert "may_skip.txt allows: 1 th" in ended.stdout
