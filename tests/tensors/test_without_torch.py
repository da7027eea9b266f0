"""Where PyTorch or JAX is not installed, `topleft.torch` or `topleft.jax` says how to get it."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(("name", "written"), [("torch", "PyTorch"), ("jax", "JAX")])
def test_import_without_the_package_says_how_to_get_it(name, written):
    code = f"import sys; sys.modules['{name}'] = None\ntry: import topleft.{name}\nexcept ImportError as e: print(e)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"topleft.{name} needs {written}: pip install {name}\n"
