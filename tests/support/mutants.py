"""Which tests guard nothing: `python tests/support/mutants.py` changes one operator at a time, and lists survivors.

Copies the tree, writes a sample of all mutants into it, and builds it once: a mutant is a branch that the environment
variable `TOPLEFT_MUTANT` takes, so none costs a compilation. One run of the tests without any finds which tests reach
which mutants, and in what time; then each mutant meets the tests that reach it, the cheapest first, until one fails.

    python tests/support/mutants.py --n 100 --seed 1                     # all of csrc and src
    python tests/support/mutants.py csrc/raster src/topleft/_meshes/io --tests tests/raster tests/io

Prints each mutant with what came of it: killed and by which test, survived, or reached by no test. Ends with status 1
if any is left. Equivalent mutants survive, too: whoever reads the list tells them apart.

Based on: R. DeMillo, R. Lipton, F. Sayward, Hints on Test Data Selection, 1978; R. Untch, Mutation-based Software
Testing Using Program Schemata, 1992 (all mutants in one build).
"""

import argparse
import ast
import copy
import ctypes
import importlib
import json
import os
import random
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from bisect import bisect
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise
from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol

ROOT = Path(__file__).resolve().parents[2]
WITHOUT = {".git", ".venv", "build", "dist", "__pycache__", ".hypothesis", ".pytest_cache", ".mypy_cache", "site"}
#: They look at the text of the sources, need a browser, or measure; threads of JAX do not survive a fork.
UNTRIED = ("tests/house", "tests/studies", "tests/portable", "tests/explore/test_browser", "tests/tensors/test_jax")
MOST_C_MUTANTS = 4096
BEGUN = pytest.StashKey[float]()
RECORD, JUDGED, CHOSEN = "TOPLEFT_MUTANTS_REACHED", "TOPLEFT_MUTANTS_JUDGED", "TOPLEFT_MUTANT"


@dataclass(frozen=True)
class Mutant:
    """One change of one place."""

    file: str
    line: int
    at: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} `{self.old}` -> `{self.new}`"


# ---- C: an operator and what stands after it, such that nothing has to be known of the operands ----------------------

C_HEAD = f"""
extern int tl_mutant;
extern unsigned char tl_reached[{MOST_C_MUTANTS}];
#define TL_MUTANT(k) (tl_reached[k] = 1, tl_mutant == (k))
"""
C_DEFINITIONS = f"""
#include <stdlib.h>
__attribute__((visibility("default"))) unsigned char tl_reached[{MOST_C_MUTANTS}];
__attribute__((visibility("default"))) int tl_mutant;
__attribute__((constructor)) static void choose_mutant(void)
{{
    const char *text = getenv("{CHOSEN}");
    tl_mutant = text ? atoi(text) : 0;
}}
"""
C_CHANGES = {
    "<": ("<=", "< TL_MUTANT({k}) +"), "<=": ("<", "<= -TL_MUTANT({k}) +"), ">": (">=", "> -TL_MUTANT({k}) +"),
    ">=": (">", ">= TL_MUTANT({k}) +"), "==": ("== 1 +", "== TL_MUTANT({k}) +"),
    "!=": ("!= 1 +", "!= TL_MUTANT({k}) +"),
    "+": ("-", "+ (1 - 2 * TL_MUTANT({k})) *"), "-": ("+", "- (1 - 2 * TL_MUTANT({k})) *"),
    "+=": ("-=", "+= (1 - 2 * TL_MUTANT({k})) *"), "-=": ("+=", "-= (1 - 2 * TL_MUTANT({k})) *"),
    "<<": ("<< 1 +", "<< TL_MUTANT({k}) +"), ">>": (">> 1 +", ">> TL_MUTANT({k}) +"),
    "&&": ("&& true or", "&& TL_MUTANT({k}) |"), "||": ("|| false and", "|| -!TL_MUTANT({k}) &"),
}  # fmt: skip
"""By operator: what a mutant does, and how it is written. + and * bind as the operator does, or closer."""

C_TOKEN = re.compile(
    r"""(?P<skip>/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])+'|^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*)
    |(?P<number>(?<![\w.])\d+(?![\w.]))|(?P<word>[\w.]+)
    |(?P<operator>->|\+\+|--|<<=|>>=|\+=|-=|<<|>>|<=|>=|==|!=|&&|\|\||[-+<>])|(?P<other>\S)""",
    re.DOTALL | re.MULTILINE | re.VERBOSE,
)


def mutants_of_c(file: str, text: str) -> Iterator[Mutant]:
    before = ""
    for token in C_TOKEN.finditer(text):
        old = token.group()
        line = text.count("\n", 0, token.start()) + 1
        if token.lastgroup == "skip":
            continue
        is_binary = before[-1:].isalnum() or before[-1:] in ("_", ")", "]")
        if token.lastgroup == "number":
            yield Mutant(file, line, token.start(), old, f"{old} + 1")
        elif old in C_CHANGES and is_binary and before not in ("return", "case"):
            yield Mutant(file, line, token.start(), old, C_CHANGES[old][0])
        before = old


def written_c(text: str, mutants: dict[int, Mutant]) -> str:
    for k, mutant in sorted(mutants.items(), key=lambda row: -row[1].at):
        new = C_CHANGES[mutant.old][1].format(k=k) if mutant.old in C_CHANGES else f"({mutant.old} + TL_MUTANT({k}))"
        text = f"{text[: mutant.at]}{new}{text[mutant.at + len(mutant.old) :]}"
    return text


# ---- Python: an expression or the changed one ------------------------------------------------------------------------

PY_HELPER = f'''"""Which mutant is meant."""

import os

CHOSEN = int(os.environ.get("{CHOSEN}", 0))
reached = set()


def is_mutant(k):
    reached.add(k)
    return k == CHOSEN
'''
PY_CHANGES = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Add, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.LShift: ast.RShift,
    ast.RShift: ast.LShift, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
PY_NAMES = {"any": "all", "all": "any", "min": "max", "max": "min"}


def changed(node: ast.AST) -> ast.AST | None:
    """The expression with one thing changed."""
    new = copy.deepcopy(node)
    if isinstance(new, ast.Compare) and len(new.ops) == 1:
        new.ops = [PY_CHANGES[type(new.ops[0])]()]
    elif isinstance(new, ast.BinOp | ast.BoolOp) and type(new.op) in PY_CHANGES:
        new.op = PY_CHANGES[type(new.op)]()
    elif isinstance(new, ast.UnaryOp) and isinstance(new.op, ast.Not):
        new = new.operand
    elif isinstance(new, ast.Constant) and type(new.value) is int:
        new.value += 1
    elif isinstance(new, ast.Call) and isinstance(new.func, ast.Name) and new.func.id in PY_NAMES:
        new.func.id = PY_NAMES[new.func.id]
    else:
        return None
    return new


class Places(ast.NodeTransformer):
    """Numbers the expressions of a file that can be changed, in their order, and changes those that are asked for."""

    def __init__(self, wanted: dict[int, int] | None = None) -> None:
        self.wanted, self.found = wanted or {}, []

    def visit(self, node: ast.AST) -> ast.AST:
        if isinstance(node, ast.pattern | ast.JoinedStr | ast.Import | ast.ImportFrom):
            return node
        new = changed(node) if isinstance(node, ast.expr) else None
        at = len(self.found)
        if new is not None:
            self.found.append((node.lineno, ast.unparse(node), ast.unparse(new)))
        old = self.generic_visit(node)
        if at not in self.wanted or new is None:
            return old
        call = ast.Call(ast.Name("is_mutant__", ast.Load()), [ast.Constant(self.wanted[at])], [])
        return ast.copy_location(ast.IfExp(call, new, old), node)

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """The same below it, but for types, which nothing runs."""
        types = {name: vars(node)[name] for name in ("annotation", "returns") if name in vars(node)}
        vars(node).update(dict.fromkeys(types))
        super().generic_visit(node)
        vars(node).update(types)
        return node


def mutants_of_python(file: str, text: str) -> Iterator[Mutant]:
    places = Places()
    places.visit(ast.parse(text))
    for at, (line, old, new) in enumerate(places.found):
        yield Mutant(file, line, at, old, new)


def written_python(text: str, mutants: dict[int, Mutant]) -> str:
    tree = Places({mutant.at: k for k, mutant in mutants.items()}).visit(ast.parse(text))
    first = next(
        (i for i, row in enumerate(tree.body) if not (isinstance(row, ast.Expr) or is_future(row))), len(tree.body)
    )
    tree.body[first:first] = ast.parse("from topleft._mutants import is_mutant as is_mutant__").body
    return ast.unparse(ast.fix_missing_locations(tree))


def is_future(row: ast.stmt) -> bool:
    return isinstance(row, ast.ImportFrom) and row.module == "__future__"


# ---- the tree with all of them ---------------------------------------------------------------------------------------


def compiled_files(tree: Path) -> set[str]:
    """The files of csrc that a build on this machine compiles."""
    made = subprocess.run(
        ["cc", "-MM", "-std=c11", "-Icsrc", "csrc/isa_scalar.c"], cwd=tree, capture_output=True, text=True, check=True
    )
    return set(made.stdout.replace("\\\n", " ").split()[1:])


def mutants_in(tree: Path, places: list[str]) -> list[Mutant]:
    compiled, found = compiled_files(tree), []
    for place in places:
        if not tree.joinpath(place).exists():
            raise SystemExit(f"there is no {place}")
        paths = sorted(tree.joinpath(place).rglob("*")) if tree.joinpath(place).is_dir() else [tree / place]
        for path in paths:
            name = path.relative_to(tree).as_posix()
            if name in compiled:
                found += mutants_of_c(name, path.read_text(encoding="utf-8"))
            elif path.suffix == ".py":
                found += mutants_of_python(name, path.read_text(encoding="utf-8"))
    return found


def refused(tree: Path) -> set[tuple[str, int]]:
    """The lines that the compiler does not take: constants that must be constant."""
    command = ["cc", "-std=c11", "-fsyntax-only", "-fmax-errors=0", "-Werror=vla", "-include", "csrc/mutants.h"]
    command += ["-Icsrc", "csrc/isa_scalar.c"]
    told = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    return {(file, int(line)) for file, line in re.findall(r"(csrc/[\w./]+):(\d+):\d+: error", told.stderr)}


def write(tree: Path, chosen: list[Mutant]) -> dict[int, Mutant]:
    """Write mutants into the tree; returns them by number, without those that do not compile."""
    originals = {mutant.file: tree.joinpath(mutant.file).read_text(encoding="utf-8") for mutant in chosen}
    left = dict(enumerate(chosen, 1))
    while True:
        for file, text in originals.items():
            own = {k: mutant for k, mutant in left.items() if mutant.file == file}
            new = (written_python if file.endswith(".py") else written_c)(text, own) if own else text
            tree.joinpath(file).write_text(new, encoding="utf-8")
        bad = refused(tree)
        if not bad:
            return left
        n_before = len(left)
        left = {k: mutant for k, mutant in left.items() if (mutant.file, mutant.line) not in bad}
        if len(left) == n_before:
            raise SystemExit(f"the compiler refuses {sorted(bad)}")


def prepare(tree: Path, places: list[str], n: int, seed: int) -> dict[int, Mutant]:
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT, tree, ignore=lambda _, names: [x for x in names if x in WITHOUT or x.endswith((".so", ".o"))])
    found = mutants_in(tree, places)
    chosen = random.Random(seed).sample(found, min(n, len(found)))
    print(f"{len(chosen)} of {len(found)} mutants", flush=True)
    tree.joinpath("csrc/mutants.h").write_text(C_HEAD)
    numbered = write(tree, chosen)
    with tree.joinpath("csrc/dispatch.c").open("a") as stream:
        stream.write(C_DEFINITIONS)
    tree.joinpath("src/topleft/_mutants.py").write_text(PY_HELPER)
    environment = {"TOPLEFT_BUILD_ISA": "scalar"} | os.environ | {"CFLAGS": f"-include {tree}/csrc/mutants.h"}
    subprocess.run([sys.executable, "setup.py", "-q", "build_ext", "--inplace"], cwd=tree, check=True, env=environment)
    return numbered


# ---- a plugin of pytest: which mutants a test reaches ----------------------------------------------------------------


def kernels() -> ctypes.CDLL:
    return ctypes.CDLL(importlib.import_module("topleft._core.engine.kernels").__file__)


def reached_so_far() -> list[int]:
    """Numbers of the mutants that this process has reached since the last call."""
    reached = importlib.import_module("topleft._mutants").reached  # which the changed tree alone has
    flags = (ctypes.c_ubyte * MOST_C_MUTANTS).in_dll(kernels(), "tl_reached")
    found = sorted(reached | {k for k, flag in enumerate(bytes(flags)) if flag})
    reached.clear()
    ctypes.memset(flags, 0, MOST_C_MUTANTS)
    return found


def note(node: str, mutants: list[int], seconds: float) -> None:
    with Path(os.environ[RECORD], f"{os.getpid()}.jsonl").open("a") as stream:
        stream.write(json.dumps([node, mutants, seconds]) + "\n")


if RECORD in os.environ:

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(item):
        note("", reached_so_far(), 0)  # what importing has reached
        item.config.stash[BEGUN] = time.perf_counter()
        return (yield)

    def pytest_runtest_logreport(report):
        if report.when == "call" and report.failed:
            note(report.nodeid, [-1], 0)

    def pytest_runtest_teardown(item):
        note(item.nodeid, reached_so_far(), time.perf_counter() - item.config.stash[BEGUN])


# ---- a plugin of pytest: what comes of each mutant -------------------------------------------------------------------


def fate(k: int, items: list[pytest.Item], seconds: float) -> str:
    """What comes of a mutant: the test that kills it, or that none does, in a fork of the process that imported all.

    It takes at most so many seconds of the CPU, and 20 times as long by the clock.
    """
    told, tell = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.setsid()
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds)))
            for stream in (1, 2):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
            os.environ[CHOSEN] = str(k)
            importlib.import_module("topleft._mutants").CHOSEN = k
            ctypes.c_int.in_dll(kernels(), "tl_mutant").value = k
            for item, after in pairwise([*items, None]):
                if any(report.failed for report in runtestprotocol(item, log=False, nextitem=after)):
                    os.write(tell, item.nodeid.encode())
                    break
            os._exit(0)
        finally:
            os._exit(1)
    os.close(tell)
    is_told = select.select([told], [], [], 20 * seconds)[0]
    name = os.read(told, 1 << 16).decode() if is_told else ""
    os.close(told)
    os.killpg(child, signal.SIGKILL)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if name or status:
        return f"killed {f'by {name}' if name else '(too long)' if status == -signal.SIGKILL else f'({status})'}"
    return f"SURVIVED {len(items)} tests"


if JUDGED in os.environ:

    def pytest_runtestloop(session):
        chosen, left = Path(os.environ[JUDGED]), []
        items = {item.nodeid: item for item in session.items}
        for k, mutant, nodes, seconds in json.loads(chosen.read_text()):
            end = fate(k, [items[node] for node in nodes], seconds)
            left += [k] * (not end.startswith("killed"))
            print(f"{k:4} {mutant}: {end}", flush=True)
        chosen.write_text(json.dumps(left))
        return True


# ---- the tests of each mutant ----------------------------------------------------------------------------------------


def run_tests(tree: Path, arguments: list[str], **environment: str) -> int:
    paths = [tree / "src", tree / "tests/support", tree]
    own = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths)), **environment}
    command = [sys.executable, "-m", "pytest", "-q", "--no-summary", "-p", "no:cacheprovider"]
    command += ["-p", "no:faulthandler", "-p", "mutants", *arguments]
    return subprocess.run(command, cwd=tree, env=own).returncode


def record(
    tree: Path, mutants_of: dict[int, Mutant], tests: list[str], n_processes: int
) -> tuple[dict[int, list[str]], dict[str, float], set[int]]:
    """The tests that reach each mutant, the cheapest first; the seconds that each test takes; what imports reach."""
    folder = tree / "build/reached"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    ignored = [f"--ignore-glob={name}*" for name in UNTRIED]
    run_tests(tree, [*tests, *ignored, "-n", str(n_processes)], **{RECORD: str(folder)})
    reached, seconds, failed = defaultdict(set), {}, set()
    for path in folder.iterdir():
        for line in path.read_text().splitlines():
            node, mutants, took = json.loads(line)
            if mutants == [-1]:
                failed.add(node)
            else:
                seconds[node] = took
                for k in mutants:
                    reached[k].add(node)
    imported = {k for k, found in reached.items() if "" in found}
    for k, mutant in mutants_of.items():
        if reached[k] == {""}:  # by importing it alone, before any test: those of its room, and of others in its file
            room = Path(mutant.file).parent.name.strip("_")
            reached[k] |= {node for node in seconds if node.startswith(f"tests/{room}/")}
            reached[k] |= {node for i, other in mutants_of.items() if other.file == mutant.file for node in reached[i]}
    nodes = {k: sorted(found - failed - {""}, key=lambda node: seconds[node]) for k, found in reached.items()}
    return nodes, seconds, imported


def judge(
    tree: Path, mutants_of: dict[int, Mutant], nodes: dict[int, list[str]], seconds: dict[str, float], most: float
) -> set[int]:
    """The mutants that survive; prints what comes of each, in a fork of one process."""
    rows = []
    for k, mutant in sorted(mutants_of.items(), key=lambda row: (row[1].file, row[1].line)):
        spent = list(accumulate(seconds[node] for node in nodes[k]))
        n = max(1, bisect(spent, most))
        rows.append((k, str(mutant), nodes[k][:n], 10 + 4 * spent[n - 1]))
    chosen = tree / "build/judged.json"
    chosen.write_text(json.dumps(rows))
    files = sorted({node.partition("::")[0] for _, _, some, _ in rows for node in some})
    own = {CHOSEN: str(rows[0][0])} if len(rows) == 1 else {}
    if run_tests(tree, ["-s", *files], **{JUDGED: str(chosen)}, **own):
        print(f"{rows[0][0]:4} {rows[0][1]}: killed by importing", flush=True)
        return set()
    return set(json.loads(chosen.read_text()))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("places", nargs="*", default=["csrc", "src"], help="files and folders that are changed")
    parser.add_argument("--tests", nargs="*", default=["tests"], help="files and folders of tests")
    parser.add_argument("--n", type=int, default=100, help="of mutants (100)")
    parser.add_argument("--seed", type=int, default=1, help="of their choice (1)")
    parser.add_argument("--seconds", type=float, default=60, help="of tests that a mutant meets at most (60)")
    parser.add_argument("--processes", type=int, default=1, help="that run the tests the first time (1)")
    parser.add_argument("--tree", type=Path, default=ROOT / "build/mutants", help="where the changed tree goes")
    options = parser.parse_args()
    tree = options.tree.resolve()
    mutants = prepare(tree, options.places, options.n, options.seed)
    nodes, seconds, imported = record(tree, mutants, options.tests, options.processes)
    apart = {k for k in mutants if not nodes.get(k)}
    for k in sorted(apart):
        print(f"{k:4} {mutants[k]}: NOT REACHED by a test", flush=True)
    left = judge(tree, {k: mutants[k] for k in mutants.keys() - apart}, nodes, seconds, options.seconds)
    for k in sorted(left & imported):  # the process that is forked has imported the original
        left -= {k} - judge(tree, {k: mutants[k]}, nodes, seconds, options.seconds)
    print(f"{len(mutants)} mutants, {len(apart | left)} left")
    return bool(apart | left)


if __name__ == "__main__":
    sys.exit(main())
