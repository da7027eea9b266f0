"""One fixed hypothesis profile, the command line as a fixture, what is counted: pixels compared, tests skipped."""

import os
import signal
from collections import Counter
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

import comparing
import pytest
from hypothesis import HealthCheck, settings

import topleft as tl
from topleft._core.raster import choices

collect_ignore = [] if Path(__file__).parents[1].joinpath("benchmarks").is_dir() else ["studies"]

#: Threads of BLAS and of PyTorch spin while they wait, which took half of their time beside other tests.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

settings.register_profile(
    "fixed", derandomize=True, deadline=None, database=None, max_examples=80, suppress_health_check=list(HealthCheck)
)
settings.load_profile("fixed")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun by a shell with `&`: tests of Ctrl-C need the usual
    signal.signal(signal.SIGINT, signal.default_int_handler)


SLOW = frozenset(Path(__file__).with_name("slow.txt").read_text(encoding="utf-8").split("\n")[1:])


def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.relative_to(Path(__file__).parents[1]).as_posix() not in SLOW:
            item.add_marker(pytest.mark.quick)
    items.sort(key=lambda item: item.path.parent.name != "trust")  # half a minute each: no core waits for the last


@pytest.fixture
def force():
    """Forces choices of the library until the test has ended, as `choices.forced` does."""
    with ExitStack() as stack:
        yield lambda **values: stack.enter_context(choices.forced(**values))


@pytest.fixture
def shared_rows(monkeypatch):
    """Pictures however small are shaded by as many threads as are asked for."""
    monkeypatch.setattr("topleft._meshes.picture.shade.MIN_PX_PER_THREAD", 1)


#: Packages of the extra `test` that scenes and comparisons of tests need; the library itself never does.
TEST_PACKAGES = frozenset({"matplotlib", "meshio", "scipy"})


def skipped_without_packages():
    try:
        return (yield)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in TEST_PACKAGES:
            pytest.skip(f"needs {error.name}, of the extra `test`")
        raise
    except tl.MissingPackageError as error:
        if find_spec("fast_simplification") is None and "fast-simplification" in str(error):
            pytest.skip(str(error))
        raise


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item):
    return (yield from skipped_without_packages())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    return (yield from skipped_without_packages())


#: Pixels that the processes of pytest-xdist have compared.
compared_elsewhere: list[int] = []


#: Why tests were skipped, and how often; modules that were skipped whole, by name, with their reasons.
skipped: Counter[str] = Counter()
modules_skipped: dict[str, str] = {}


def reason_of(report):
    return str(report.longrepr[2]).removeprefix("Skipped: ") if isinstance(report.longrepr, tuple) else ""


def pytest_collectreport(report):
    if report.skipped:
        modules_skipped[report.nodeid] = reason_of(report)


def pytest_runtest_logreport(report):
    if report.skipped and not hasattr(report, "wasxfail"):
        skipped[reason_of(report)] += 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Each process takes a range of tests: what neighbours share, exact pictures and records, is made in one alone."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log) if config.getvalue("dist") == "load" else None


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    output = getattr(node, "workeroutput", {})
    compared_elsewhere.append(output.get("n_pixels_compared", 0))
    modules_skipped.update(output.get("modules_skipped", {}))


def beyond_list():
    """What was skipped more often than the file says that TOPLEFT_MAY_SKIP names: the gate has no test that is dead."""
    rows = [line.split(None, 1) for line in Path(os.environ["TOPLEFT_MAY_SKIP"]).read_text().splitlines()]
    allowed = {reason: n for n, reason in (row for row in rows if len(row) == 2 and row[0] != "#")}
    found = skipped + Counter(modules_skipped.values())
    return [f"{n} {why}" for why, n in found.items() if allowed.get(why) != "*" and n > int(allowed.get(why, 0))]


def pytest_sessionfinish(session):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["n_pixels_compared"] = comparing.n_pixels_compared
        session.config.workeroutput["modules_skipped"] = modules_skipped
    elif "TOPLEFT_MAY_SKIP" in os.environ and beyond_list() and not session.exitstatus:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter):
    n_pixels = comparing.n_pixels_compared + sum(compared_elsewhere)
    terminalreporter.write_line(f"{n_pixels:,} pixels compared with the exact reference")
    if "TOPLEFT_MAY_SKIP" in os.environ:
        for line in beyond_list():
            terminalreporter.write_line(f"skipped more often than {os.environ['TOPLEFT_MAY_SKIP']} allows: {line}")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder, capsys):
    """Run the command line: its exit status and the lines of stderr."""
    import topleft.cli

    def run_cli(*arguments):
        try:
            status = topleft._apps.cli.main([str(argument) for argument in arguments])
        except SystemExit as leaving:
            status = leaving.code
        return status, capsys.readouterr().err.splitlines()

    return run_cli
