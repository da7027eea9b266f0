"""The examples of the docstrings, those of classes and methods too, print what stands there."""

import ast
import doctest
from importlib import import_module
from inspect import cleandoc, ismodule
from pathlib import Path

import pytest
from engine_cases import one_by_one

import topleft as tl

SRC = Path(__file__).parents[2] / "src"
MODULES = {
    ".".join(path.relative_to(SRC).with_suffix("").parts): path
    for path in sorted(SRC.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
}


def examples_of(name):
    """The examples of a file; by what it defines, since public names say that they are of `topleft`."""
    module = import_module(name)
    finder = doctest.DocTestFinder(exclude_empty=True)
    defined = [node for node in ast.parse(MODULES[name].read_text(encoding="utf-8")).body if hasattr(node, "name")]
    found = [
        test
        for node in defined
        for test in finder.find(getattr(module, node.name), node.name, module=False, globs=dict(vars(module)))
    ]
    return found + [doctest.DocTestParser().get_doctest(module.__doc__ or "", vars(module), name, name, 0)]


@pytest.mark.parametrize("name", MODULES)
def test_examples_print_what_stands_there(name):
    if name in ("topleft.torch", "topleft.jax"):
        pytest.importorskip(name.rpartition(".")[2])
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    tests = examples_of(name)
    for test in tests:
        runner.run(test)
    n_written = MODULES[name].read_text(encoding="utf-8").count(">>> ")
    assert sum(len(test.examples) for test in tests) == n_written
    assert runner.failures == 0


def public_docstrings():
    """Name and docstring of each function and class that the package promises; from its file, whatever it inherits."""
    found = {name: getattr(tl, name) for name in tl.__all__ if not name.startswith("__")}
    return {name: cleandoc(thing.__doc__ or "") for name, thing in found.items() if not ismodule(thing)}


@one_by_one("name", sorted(public_docstrings()))
def test_public_name_has_an_example_that_runs(name):
    """The test above runs it."""
    assert "\nExamples\n--------\n" in public_docstrings()[name]
    assert ">>> " in public_docstrings()[name].partition("Examples\n")[2]
