"""The members that docs/api promises, for the tests that hold other things to them."""

import public_names
import pytest


@pytest.fixture(scope="session")
def promised():
    """The names of the pages with their members."""
    return public_names.members()
