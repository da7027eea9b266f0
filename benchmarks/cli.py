"""Commands: `python -m benchmarks run`, `accuracy`, `atlas`, `batch`, `choices`, `static`, `report`, and the rest."""

from __future__ import annotations

import argparse
import functools
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.accuracy import measure as accuracy
from benchmarks.accuracy import options as accuracy_options
from benchmarks.atlas import tables as atlas_page
from benchmarks.choices import measure as choices
from benchmarks.choices import plans as choices_plans
from benchmarks.choices import tables as choices_tables
from benchmarks.harness.contestants import known_peers
from benchmarks.harness.machine import ROOT
from benchmarks.harness.records import write_record, write_text
from benchmarks.harness.rounds import Options, run
from benchmarks.harness.yardstick import DEFAULT_PATTERN, Yardstick
from benchmarks.peers import PEERS
from benchmarks.pictures import tables as pictures_page
from benchmarks.report import pages
from benchmarks.report import tables as report
from benchmarks.scenes.cases import CASES, TRIALS
from benchmarks.small import batch, smooth_tables
from benchmarks.static import measure as static
from benchmarks.static import tables as static_tables


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status."""
    options = parser().parse_args(arguments)
    return options.action(options)


def parser() -> argparse.ArgumentParser:
    """The arguments."""
    root = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    commands = root.add_subparsers(required=True, metavar="COMMAND")

    add = commands.add_parser("run", help="measure")
    add.set_defaults(action=run_command)
    add.add_argument("--scene", nargs="+", metavar="NAME", default=[], help="cases, or beginnings of their names")
    add.add_argument("--peer", nargs="*", metavar="NAME", default=None, help="peers; all unless given, none: no names")
    add.add_argument("--isa", nargs="+", metavar="ISA", default=None, help="scalar, avx2, avx512; all unless given")
    add.add_argument("--threads", nargs="+", type=positive, metavar="N", default=[1])
    add.add_argument("--repeats", type=positive, default=9, metavar="N", help="rounds (9)")
    add.add_argument("--seconds", type=float, default=0.1, metavar="S", help="length of a turn, at least a call (0.1)")
    add.add_argument("--pin", type=cpus, default=[], metavar="CPU[,CPU...]", help="n threads: the first n of them")
    add.add_argument("--yardstick", action="append", default=[], metavar="[SCENE=]COMMAND")
    add.add_argument("--yardstick-pattern", action="append", default=[], metavar="REGEX",
                     help="finds its figure; one for each yardstick, the last one for the rest")  # fmt: skip
    add.add_argument("--yardstick-folder", type=Path, default=Path(), metavar="FOLDER", help="where yardsticks run")
    add.add_argument("--no-check", action="store_true", help="leave the pictures uncompared")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("report", help="print tables again")
    add.set_defaults(action=report_command)
    add.add_argument("files", nargs="+", type=Path, metavar="FILE.json")
    add.add_argument("--html", type=Path, metavar="FILE.html",
                     help="write a page with all charts and words instead, of one accuracy record")  # fmt: skip
    add.add_argument("--pages", type=Path, default=ROOT / "docs", metavar="FOLDER", help="where its words are (docs)")

    add = commands.add_parser("accuracy", help="measure time beside error, and stability, of every method")
    add.set_defaults(action=accuracy_command)
    defaults = accuracy_options.Options()
    add.add_argument("--part", nargs="+", metavar="NAME", default=[],
                     help=f"measure these alone, leave the rest of FILE.json: {', '.join(accuracy.PARTS)}")  # fmt: skip
    add.add_argument("--method", nargs="+", metavar="NAME", default=[], help="all that fill unless given")
    add.add_argument("--peer", nargs="*", metavar="NAME", default=None, help="peers; all unless given, none: no names")
    add.add_argument("--threads", type=positive, default=defaults.max_threads, metavar="N",
                     help="how far threads are charted (%(default)s)")  # fmt: skip
    add.add_argument("--repeats", type=positive, default=defaults.rounds, metavar="N", help="rounds (%(default)s)")
    add.add_argument("--seconds", type=float, default=defaults.seconds, metavar="S",
                     help="length of a turn, at least a call (%(default)s)")  # fmt: skip
    add.add_argument("--edge-pixels", type=positive, default=defaults.edge_px, metavar="N",
                     help="edge pixels to compare in each family, at least (%(default)s)")  # fmt: skip
    add.add_argument("--frame", type=positive, default=defaults.frame_px, metavar="PX", help="side (%(default)s)")
    add.add_argument("--scale", type=float, default=1.0, metavar="X", help="of the numbers of triangles timed (1)")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("batch", help="measure many pictures: views a second, in memory and as PNG")
    add.set_defaults(action=batch_command)
    views = batch.Options()
    add.add_argument("--peer", nargs="*", metavar="NAME", default=list(views.peers), help=f"{', '.join(views.peers)}")
    add.add_argument("--threads", nargs="+", type=positive, metavar="N", default=list(views.threads))
    add.add_argument("--triangles", type=positive, metavar="N", default=views.n_triangles, help="(%(default)s)")
    add.add_argument("--views", type=positive, metavar="N", default=views.n_views, help="a call (%(default)s)")
    add.add_argument("--frame", type=positive, default=views.size[0], metavar="PX", help="side (%(default)s)")
    add.add_argument("--repeats", type=positive, default=views.repeats, metavar="N", help="rounds (%(default)s)")
    add.add_argument("--pin", type=cpus, default=[], metavar="CPU[,CPU...]", help="n threads: the first n of them")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("atlas", help="map where each method fails")
    add.set_defaults(action=atlas_command)
    add.add_argument("--method", nargs="+", metavar="NAME", default=[], help="rows; all unless given")
    add.add_argument("--family", nargs="+", metavar="NAME", default=[], help="families of scenes; all unless given")
    add.add_argument("--scenes", type=Path, metavar="FILE.py",
                     help="shrink the first failures and write them into src/topleft/failure_scenes.py")  # fmt: skip
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("choices", help="measure what the planner chooses beside what it could have chosen")
    add.set_defaults(action=choices_command)
    ways = choices.Options()
    add.add_argument("--choice", nargs="+", metavar="NAME", default=[], help="measure these alone; all unless given")
    add.add_argument("--scene", nargs="+", metavar="NAME", default=[], help="scenes, or beginnings of their names")
    add.add_argument("--plans", action="store_true", help="measure estimates and plans alone")
    add.add_argument("--builds", type=Path, metavar="FOLDER",
                     help="build the library with other constants there unless it is, and measure it")  # fmt: skip
    add.add_argument("--repeats", type=positive, default=ways.rounds, metavar="N", help="rounds (%(default)s)")
    add.add_argument("--scale", type=float, default=ways.scale, metavar="X", help="of triangles and frames (1)")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json", help="what it holds and is not measured stays")

    add = commands.add_parser("static", help="measure meshes that do not change, in clusters beside whole")
    add.set_defaults(action=static_command)
    still = static.Options()
    add.add_argument("--scene", nargs="+", metavar="NAME", default=[], help="beginnings of names; all unless given")
    add.add_argument("--mesh", nargs="+", type=Path, metavar="FILE", default=[], help="closed meshes to draw, too")
    add.add_argument("--repeats", type=positive, default=still.rounds, metavar="N", help="rounds (%(default)s)")
    add.add_argument("--scale", type=float, default=still.scale, metavar="X", help="of triangles and frames (1)")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json", help="what it holds and is not measured stays")

    add = commands.add_parser(
        "charts", help="draw the charts of a record of accuracy, choices, static or an atlas"
    )
    add.set_defaults(action=charts_command)
    add.add_argument("file", type=Path, metavar="FILE.json")
    add.add_argument("-o", "--out", type=Path, default=Path("docs/images"), metavar="FOLDER")

    add = commands.add_parser("samplings", help="draw one small scene in every sampling, PNG")
    add.set_defaults(action=samplings_command)
    add.add_argument("-o", "--out", type=Path, default=Path("docs/images"), metavar="FOLDER")

    add = commands.add_parser("pictures", help="compare pictures with OpenGL on llvmpipe")
    add.set_defaults(action=pictures_command)
    add.add_argument("--scene", nargs="+", metavar="NAME", default=[], help="scenes; all unless given")
    add.add_argument("--sheets", type=Path, metavar="FOLDER", help="write them side by side with their difference, PNG")
    add.add_argument("-o", "--out", type=Path, metavar="FILE.json")

    add = commands.add_parser("document", help="write the tables of a record into its page")
    add.set_defaults(action=document_command)
    add.add_argument("file", type=Path, metavar="FILE.json")
    add.add_argument("page", type=Path, metavar="PAGE.md")

    add = commands.add_parser("levels", help="measure levels of detail, and write their page: time beside error")
    add.set_defaults(action=levels_command)
    add.add_argument("--mesh", nargs="*", default=[], metavar="FILE", help="meshes besides the generated ones")
    add.add_argument("--triangles", type=positive, default=10_000_000, metavar="N", help="of the blob (%(default)s)")
    add.add_argument("--rounds", type=positive, default=5, metavar="N", help="(%(default)s)")
    add.add_argument("--json", type=Path, metavar="FILE.json", help="the record")
    add.add_argument("--keep", type=Path, metavar="FOLDER", help="where levels are kept from run to run")
    add.add_argument("-o", "--out", type=Path, default=Path("docs"), metavar="FOLDER", help="(%(default)s)")

    commands.add_parser("list", help="cases and peers").set_defaults(action=list_command)
    return root


def positive(text: str) -> int:
    """A number from 1 on."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {text}")
    return value


def cpus(text: str) -> list[int]:
    """`1` or `1,0`."""
    return [int(part) for part in text.split(",")]


def run_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    try:
        options = options_of(arguments)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    save = functools.partial(write_record, arguments.out) if arguments.out else None
    record = run(options, sys.stderr, save)
    print(*report.lines(record), sep="\n")
    return 0


def options_of(arguments: argparse.Namespace) -> Options:
    """What the arguments ask for, checked."""
    import topleft as tl

    available = tl.build_info()["isa_available"]
    isas = arguments.isa if arguments.isa is not None else available[::-1]
    if unknown := [isa for isa in isas if isa not in available]:
        raise ValueError(f"--isa must be some of {', '.join(available)} here, got {', '.join(unknown)}")
    peers = list(PEERS) if arguments.peer is None else arguments.peer
    if unknown := [peer for peer in peers if peer not in known_peers()]:
        raise ValueError(f"--peer must be some of {', '.join(PEERS)}, got {', '.join(unknown)}")
    patterns = arguments.yardstick_pattern or [DEFAULT_PATTERN]
    patterns += [patterns[-1]] * (len(arguments.yardstick) - len(patterns))
    yardsticks = list(zip(arguments.yardstick, patterns, strict=False))
    for command, pattern in yardsticks:
        Yardstick.parse(command, pattern, arguments.yardstick_folder, [])
    return Options(
        scenes=find_scenes(arguments.scene),
        peers=peers,
        isas=isas,
        threads=arguments.threads,
        repeats=arguments.repeats,
        seconds=arguments.seconds,
        pin=arguments.pin,
        yardsticks=yardsticks,
        yardstick_folder=arguments.yardstick_folder,
        check=not arguments.no_check,
    )


def find_scenes(names: Sequence[str]) -> list[str]:
    """Cases by name, or by the beginning of it; all of them for none."""
    if not names:
        return [name for name in CASES if name not in TRIALS]
    found = []
    for name in names:
        matches = [name] if name in CASES else [case for case in CASES if case.startswith(name)]
        if not matches:
            raise ValueError(f"no scene {name!r}; there are {', '.join(CASES)}")
        found += [match for match in matches if match not in found]
    return found


def report_command(arguments: argparse.Namespace) -> int:
    """Print tables of records, or write the report of one."""
    records = [json.loads(path.read_text()) for path in arguments.files]
    if arguments.html:
        return html_command(records, arguments)
    for record in records:
        tables = {
            "accuracy": pages,
            "atlas": atlas_page,
            "batch": batch,
            "pictures": pictures_page,
            "choices": choices_tables,
            "static": static_tables,
        }
        print(*tables.get(record.get("kind"), report).lines(record), sep="\n")
    return 0


def html_command(records: list[dict[str, Any]], arguments: argparse.Namespace) -> int:
    """Write the report."""
    from benchmarks.accuracy.html_report import make_report  # matplotlib

    try:
        if len(records) != 1 or records[0].get("kind") != "accuracy":
            raise ValueError("--html takes one accuracy record")
        write_text(arguments.html, make_report(records[0], arguments.pages))
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    print(arguments.html)
    return 0


def accuracy_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    options = accuracy_options.Options(
        methods=arguments.method,
        peers=list(PEERS) if arguments.peer is None else arguments.peer,
        rounds=arguments.repeats,
        seconds=arguments.seconds,
        edge_px=arguments.edge_pixels,
        frame_px=arguments.frame,
        scale=arguments.scale,
        max_threads=arguments.threads,
    )
    out = arguments.out
    save = functools.partial(write_record, out) if out else None
    try:
        record = json.loads(out.read_text()) if arguments.part and out and out.exists() else None
        record = accuracy.run_accuracy(options, arguments.part, record, sys.stderr, save)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    print(*pages.lines(record), sep="\n")
    return 0


def batch_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    if unknown := [peer for peer in arguments.peer if peer not in batch.PEERS]:
        print(f"benchmarks: --peer must be some of {', '.join(batch.PEERS)}, got {', '.join(unknown)}", file=sys.stderr)
        return 2
    options = batch.Options(
        peers=arguments.peer,
        threads=arguments.threads,
        n_triangles=arguments.triangles,
        n_views=arguments.views,
        size=(arguments.frame, arguments.frame),
        repeats=arguments.repeats,
        pin=arguments.pin,
    )
    record = batch.run_batch(options, sys.stderr)
    if arguments.out:
        write_record(arguments.out, record)
    print(*batch.lines(record), sep="\n")
    return 0


def atlas_command(arguments: argparse.Namespace) -> int:
    """Draw, compare, write, print."""
    from benchmarks.atlas import measure as atlas
    from benchmarks.atlas import shrink as atlas_shrink

    try:
        record = atlas.run_atlas(sys.stderr, arguments.family, arguments.method)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    if arguments.out:
        write_record(arguments.out, record)
    if arguments.scenes:
        text = atlas_shrink.with_scenes(arguments.scenes.read_text(), atlas_shrink.shrink_all(record))
        arguments.scenes.write_text(text)
    print(*atlas_page.lines(record), sep="\n")
    return 0


def choices_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    options = choices.Options(
        choices=arguments.choice,
        scenes=arguments.scene,
        rounds=arguments.repeats,
        scale=arguments.scale,
        builds=arguments.builds,
    )
    out = arguments.out
    save = functools.partial(write_record, out) if out else None
    record = json.loads(out.read_text()) if out and out.exists() else None
    try:
        if arguments.plans:
            record = choices_plans.run_plans(options, record)
        else:
            record = choices.run_choices(options, sys.stderr, record, save)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    if out:
        write_record(out, record)
    print(*choices_tables.lines(record), sep="\n")
    return 0


def static_command(arguments: argparse.Namespace) -> int:
    """Measure, write, print."""
    options = static.Options(
        scenes=arguments.scene, files=arguments.mesh, rounds=arguments.repeats, scale=arguments.scale
    )
    out = arguments.out
    save = functools.partial(write_record, out) if out else None
    record = static.run_static(options, sys.stderr, json.loads(out.read_text()) if out and out.exists() else None, save)
    print(*static_tables.lines(record), sep="\n")
    return 0


def charts_command(arguments: argparse.Namespace) -> int:
    """Draw."""
    from benchmarks.atlas import charts as atlas_charts
    from benchmarks.choices import charts as choices_charts
    from benchmarks.report import charts as chart_files
    from benchmarks.static import charts as static_charts

    record = json.loads(arguments.file.read_text())
    of_kind = {"atlas": atlas_charts, "choices": choices_charts, "static": static_charts}
    for path in of_kind.get(record["kind"], chart_files).draw_charts(record, arguments.out):
        print(path)
    return 0


def samplings_command(arguments: argparse.Namespace) -> int:
    """Draw."""
    from benchmarks.small.samplings import draw_samplings  # matplotlib

    print(draw_samplings(arguments.out))
    return 0


def pictures_command(arguments: argparse.Namespace) -> int:
    """Draw, compare, write, print."""
    from benchmarks.pictures.measure import run_pictures

    try:
        record = run_pictures(sys.stderr, arguments.scene, arguments.sheets)
    except (ValueError, ImportError, RuntimeError) as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    if arguments.out:
        write_record(arguments.out, record)
    print(*pictures_page.lines(record), sep="\n")
    return 0


def document_command(arguments: argparse.Namespace) -> int:
    """Replace what stands between the markers of a page."""
    text = arguments.page.read_text(encoding="utf-8")
    record = json.loads(arguments.file.read_text())
    of_kind = {"accuracy": pages.PARTS, "atlas": atlas_page.PARTS, "pictures": pictures_page.PARTS,
               "choices": choices_tables.PARTS, "static": static_tables.PARTS}  # fmt: skip
    parts = of_kind.get(record.get("kind"), smooth_tables.PARTS)
    try:
        write_text(arguments.page, pages.with_parts(text, record, parts))
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    return 0


def levels_command(arguments: argparse.Namespace) -> int:
    """Measure, write the page, print."""
    from benchmarks.levels import measure as levels

    options = levels.Options(tuple(arguments.mesh), arguments.triangles, arguments.rounds, arguments.keep)
    record = levels.run_levels(options)
    if arguments.json:
        write_record(arguments.json, record)
    paths = levels.write_page(record, arguments.out)
    print(*levels.lines(record), *paths, sep="\n")
    return 0


def list_command(_: argparse.Namespace) -> int:
    """Print what there is."""
    for name, case in CASES.items():
        print(f"{name:22} {case.task}")
    for name, what in PEERS.items():
        print(f"{name:22} {what}")
    return 0
