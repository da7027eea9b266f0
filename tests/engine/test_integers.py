"""The 128-bit integers of the kernels, the compiler's and the struct of two words, against Python's integers."""

import random
import struct
import subprocess
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import pytest
from toolchain import compiler

ROOT = Path(__file__).resolve().parents[2]
WORD, WHOLE = 2**64, 2**128
LOW, HIGH = -(2**127), 2**127

#: What base/integers.h makes of two integers and a number of places, in Python.
OPERATIONS: dict[str, Callable[[int, int, int], int]] = {
    "from": lambda a, b, n: signed(a, WORD),
    "add": lambda a, b, n: a + b,
    "sub": lambda a, b, n: a - b,
    "neg": lambda a, b, n: -a,
    "wrapping_sub": lambda a, b, n: signed(a - b, WHOLE),
    "product": lambda a, b, n: signed(a, WORD) * signed(b, WORD),
    "times": lambda a, b, n: a * signed(b, WORD),
    "wrapping_times": lambda a, b, n: signed(a * signed(b, WORD), WHOLE),
    "shift_left": lambda a, b, n: a << n,
    "shift_right": lambda a, b, n: a >> n,
    "or": lambda a, b, n: a | b,
    "min": lambda a, b, n: min(a, b),
    "max": lambda a, b, n: max(a, b),
    "less": lambda a, b, n: int(a < b),
    "sign": lambda a, b, n: (a > 0) - (a < 0),
    "is_zero": lambda a, b, n: int(a == 0),
    "to_f64": lambda a, b, n: int.from_bytes(struct.pack(">d", float(a)), "big"),
    "quotient": lambda a, b, n: a // b,
    "remainder": lambda a, b, n: a % b,
}


def signed(a: int, modulus: int) -> int:
    """Return the integer of two's complement that a number is, modulo a power of two."""
    return (a + modulus // 2) % modulus - modulus // 2


def numbers() -> Iterator[int]:
    """Yield the edges of words and of float64, and numbers of every length."""
    rng = random.Random(22)
    yield from (0, 1, -1, 2, LOW, LOW + 1, HIGH - 1, 10**20, -(10**20))
    for bits in (31, 32, 53, 54, 62, 63, 64, 65, 95, 96, 117, 126):
        yield from (sign * 2**bits + one for sign, one in product((1, -1), (-1, 0, 1)))
    for bits in range(54, 127, 8):  # halfway between two neighbours in float64, and on either side
        middle = 2 ** (bits - 1) + rng.getrandbits(52) * 2 ** (bits - 53) + 2 ** (bits - 54)
        yield from (middle - 1, middle, middle + 1, -middle)
    yield from (rng.choice((1, -1)) * rng.getrandbits(bits) for bits in range(1, 127, 3))


def cases() -> list[tuple[str, int, int, int]]:
    """Return calls whose results fit: those of every pair would take minutes, so a pair has one operation in three."""
    rng = random.Random(128)
    shifts, found = (0, 1, 17, 31, 32, 63, 64, 65, 100, 126), []
    for a, b in product(list(numbers()), repeat=2):
        for name in rng.sample(sorted(OPERATIONS), 6):
            n = rng.choice(shifts)
            if name in ("quotient", "remainder") and (b <= 0 or a == LOW):
                continue
            if name == "to_f64" or LOW <= OPERATIONS[name](a, b, n) < HIGH:
                found.append((name, a, b, n))
    return found


@pytest.mark.parametrize("define", ["-DTL_INT128", "-DTL_NO_INT128"], ids=["compiler's", "two words"])
def test_128_bit_integers_equal_those_of_python(define, tmp_path):
    if not compiler():
        pytest.skip("no C compiler: $CC, cc, gcc or clang")
    program = tmp_path / "integers"
    source = ROOT / "tests/portable/integers.c"
    flags = ["-std=c11", "-O1", "-ffp-contract=off", f"-I{ROOT / 'csrc'}", define]
    subprocess.run([*compiler(), *flags, str(source), "-o", str(program), "-lm"], check=True)
    asked, lines = cases(), []
    for name, a, b, n in asked:
        words = (value % WHOLE >> shift & (WORD - 1) for value in (a, b) for shift in (64, 0))
        lines.append(" ".join([name, *(f"{word:x}" for word in words), str(n)]))
    made = subprocess.run([program], input="\n".join(lines), capture_output=True, text=True, check=True).stdout.split()
    assert len(made) == 2 * len(asked)
    wrong = [
        (call, value)
        for call, value in zip(asked, made[1::2], strict=True)
        if int(value, 16) != OPERATIONS[call[0]](*call[1:]) % WHOLE
    ]
    assert {name for name, *_ in asked} == set(OPERATIONS)
    assert wrong[:5] == []
