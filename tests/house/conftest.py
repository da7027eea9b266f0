"""The members that docs/api.md promises, for the tests that hold other things to them."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "api.md"
ENTRY = re.compile(r"^\.\. auto\w+:: topleft\.(\w+)(?:\n   :members: (.+(?:\n {8,}.+)*))?$", re.MULTILINE)


@pytest.fixture(scope="session")
def promised():
    """The names of the page with their members."""
    found = ENTRY.findall(PAGE.read_text(encoding="utf-8"))
    assert len({name for name, _ in found}) == len(found)
    return {name: re.split(r",\s+", members) if members else [] for name, members in found}
