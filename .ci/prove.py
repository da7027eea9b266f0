"""Checks what comments claim of rounding, ranges and owners: `prove.py [--all] [--root FOLDER] [NAME ...]`.

Constants are read from the code, and programs include it, so a change there changes the proof. Each claim names a
sentence of a comment, which must stand there. `--all` adds the claims that take minutes. Needs gcc, NumPy, z3-solver.
docs/design/proofs.md lists the claims and the methods; each method has a file in .ci/proofs.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from proofs import logic, ranges, rounding, values
from proofs.source import Claim, LeftOutError, NotProvedError, Source

ROOT = Path(__file__).resolve().parents[1]
MODULES = (rounding, ranges, logic, values)
CLAIMS = [it for module in MODULES for it in vars(module).values() if isinstance(it, Claim)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="claims to prove; all that are short")
    parser.add_argument("--all", action="store_true", help="with those that take minutes")
    parser.add_argument("--list", action="store_true", help="name the claims, and prove none")
    parser.add_argument("--root", type=Path, default=ROOT, help="the folder of csrc and src")
    options = parser.parse_args()
    known = [claim.name for claim in CLAIMS]
    if unknown := sorted(set(options.names) - set(known)):
        parser.error(f"NAME must be one of {', '.join(known)}, got {', '.join(unknown)}")
    if options.list:
        sys.stdout.writelines(f"{claim.name} {claim.place} {claim.method}\n" for claim in CLAIMS)
        return 0
    source, failed = Source(options.root.resolve()), 0
    for claim in CLAIMS:
        if claim.name not in options.names if options.names else claim.is_long and not options.all:
            continue
        start = time.monotonic()
        try:
            source.says(claim.place, claim.says)
            claim.proof(source)
            told = "proved"
        except LeftOutError as error:
            told = f"left out: {error}"
        except NotProvedError as error:
            told, failed = f"NOT PROVED: {error}", 1
        sys.stdout.write(f"{claim.name:20} {claim.method:9} {time.monotonic() - start:6.1f} s  {told}\n")
        sys.stdout.flush()
    return failed


if __name__ == "__main__":
    sys.exit(main())
