"""Interpreters other than the usual one: without the GIL, and several in a process."""

import subprocess
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path

import pytest

SRC = Path(__file__).parents[2] / "src"
UNITS = sorted(SRC.rglob("*.pyx"))

SECOND_INTERPRETER = """
import sys
import topleft
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
code = f"import sys\\nsys.path[:] = {sys.path!r}\\nimport topleft"
try:
    told = interpreters.run_string(interpreters.create(), code)
except Exception as error:
    told = error
print(getattr(told, "formatted", told))
"""


def run(code, *flags):
    return subprocess.run([sys.executable, *flags, "-c", code], capture_output=True, text=True)


@pytest.mark.skipif(
    not (find_spec("_interpreters") or find_spec("_xxsubinterpreters")), reason="this Python has one interpreter"
)
def test_second_interpreter_of_a_process_is_refused_in_a_sentence():
    done = run(SECOND_INTERPRETER)
    assert done.returncode == 0, done.stderr
    assert "ImportError" in done.stdout


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.stem)
def test_compiled_module_declares_that_it_needs_no_gil(unit):
    assert "# cython: freethreading_compatible=True\n" in unit.read_text(encoding="utf-8").splitlines(keepends=True)[:2]


@pytest.mark.skipif(not sysconfig.get_config_var("Py_GIL_DISABLED"), reason="this Python has a GIL")
def test_python_without_a_gil_stays_without_one():
    modules = [path.relative_to(SRC).with_suffix("").as_posix().replace("/", ".") for path in UNITS]
    done = run(f"import sys, {', '.join(modules)}; print(sys._is_gil_enabled())", "-W", "error")
    assert done.stdout.strip() == "False", done.stderr
