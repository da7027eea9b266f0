"""Fuzz the public surface for some time: `python tests/support/hostile/fuzz.py --seconds 60`.

It is best run as `.ci/sanitize` does.

Prints how many cases of each verb were drawn and refused, and ends with the first case that must not be, its seed, and
status 1; `--seed N --cases 1` draws that one again. With `--guided` coverage of the kernels guides it: `.ci/sanitize
fuzz` builds for that, with clang, and starts it with the corpus of this folder.
"""

import argparse
import sys
import time
import traceback
import warnings
from collections import Counter

from draws import FromBytes, FromRandom
from fuzzing import KINDS, check_one


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--cases", type=int, default=10**12, help="end after so many")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    parser.add_argument("--kind", choices=KINDS, default=None)
    parser.add_argument("--guided", nargs=argparse.REMAINDER, help="arguments of libFuzzer, by atheris")
    options = parser.parse_args()
    if options.guided is not None:
        return run_guided(options.guided)
    warnings.simplefilter("ignore")  # of NumPy, for contents that overflow while a case is made
    found: Counter[str] = Counter()
    end, slowest = time.monotonic() + options.seconds, (0.0, 0)
    for seed in range(options.seed, options.seed + options.cases):
        start = time.monotonic()
        if start > end:
            break
        try:
            found[check_one(FromRandom(seed), options.kind)] += 1
        except KeyboardInterrupt:
            break
        except Exception:
            traceback.print_exc()
            print(f"seed {seed}")
            return 1
        slowest = max(slowest, (time.monotonic() - start, seed))
    for name in sorted({each.partition(" ")[0] for each in found}):
        print(
            f"{name:16}",
            *(f"{each.partition(' ')[2]} {n:,}" for each, n in found.items() if each.startswith(f"{name} ")),
        )
    print(f"{found.total():8,} cases, none that must not be; the slowest took {slowest[0]:.2f} s (seed {slowest[1]})")
    return 0


def run_guided(arguments: list[str]) -> int:
    import atheris

    def test_one(content: bytes) -> None:
        check_one(FromBytes(content))

    atheris.Setup([sys.argv[0], *arguments], test_one)
    atheris.Fuzz()
    return 0


if __name__ == "__main__":
    sys.exit(main())
