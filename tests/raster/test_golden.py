"""Golden hashes: every build, instruction set and number of threads makes the pictures that it made before."""

import json

from engine_cases import ON_EACH_ISA, on
from golden import FILE, hashes


@ON_EACH_ISA
def test_every_verb_sampling_and_layer_has_its_golden_hash(isa):
    expected = json.loads(FILE.read_text())
    with on(isa):
        got = hashes(1 if isa == "scalar" else 3)
    assert got == expected
