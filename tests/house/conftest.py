"""The script that lists the public names, for the tests that hold other things to its list."""

import importlib.util
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def make_api():
    spec = importlib.util.spec_from_file_location("make_api", Path(__file__).parents[2] / "docs" / "make_api.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
