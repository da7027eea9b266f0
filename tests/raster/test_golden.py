"""Golden hashes: every build, instruction set and number of threads makes the pictures that it made before."""

import json

import pytest
from engine_cases import ON_EACH_ISA, on
from golden import FILE, hashes


@pytest.mark.parametrize("threads", [1, 3])
@ON_EACH_ISA
def test_every_verb_sampling_and_layer_has_its_golden_hash(isa, threads):
    expected = json.loads(FILE.read_text())
    with on(isa):
        got = hashes(threads)
    assert got == expected
