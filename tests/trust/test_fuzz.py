"""Calls that nobody would write: each is drawn as plain copies of its arrays are, or refused in one line."""

from importlib.util import find_spec

import pytest
from draws import REFUSALS, FromBytes, FromRandom
from fuzzing import KINDS, check_one
from hypothesis import given, settings
from hypothesis import strategies as st

N_CASES = {"verb": 120, "mesh": 30, "tiles": 30}


class FromHypothesis:
    """Decisions that hypothesis shrinks."""

    def __init__(self, data):
        self._data = data

    def integer(self, low, high):
        return self._data.draw(st.integers(low, high))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of NumPy, for numbers that overflow when they become float32
@pytest.mark.parametrize("kind", KINDS)
def test_calls_that_nobody_would_write_are_drawn_alike_or_refused(kind):
    seen = set()

    @settings(max_examples=N_CASES.get(kind, 40))
    @given(st.data())
    def check_each(data):
        seen.add(check_one(FromHypothesis(data), kind).split()[1])

    check_each()
    assert "drawn" in seen
    unmade = set() if find_spec("fast_simplification") else {"MissingPackageError"}  # levels of a mesh
    assert seen - {"drawn"} - unmade <= {error.__name__ for error in REFUSALS}


def test_a_file_of_the_guided_fuzzer_is_a_case():
    assert check_one(FromBytes(b"")).endswith(" drawn")
    assert len({check_one(FromRandom(seed)) for seed in range(20)}) > 5
