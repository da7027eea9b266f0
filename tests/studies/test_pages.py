"""Pages of the documentation hold the figures of the records that are kept, and what does not fit is refused."""

import json

import pytest
from benchmarks import cli
from benchmarks.harness.machine import RECORDS, ROOT
from benchmarks.report.everything import EVERY
from benchmarks.report.pages import MARKED, with_parts

FILLED = {name: [ROOT / "docs" / page for page in pages.split()] for name, (_, pages) in EVERY.items()}
"""Pages by the record that they show."""


def record_of(name):
    """A record that is kept."""
    return json.loads((RECORDS / f"{name}.json").read_text())


@pytest.mark.parametrize(("name", "page"), [(name, page) for name, pages in FILLED.items() for page in pages])
def test_page_tables_are_those_of_the_record(name, page):
    text, record = page.read_text(encoding="utf-8"), record_of(name)
    files = " ".join(str(path.relative_to(ROOT)) for path in (RECORDS / f"{name}.json", page))
    assert with_parts(text, record, cli.parts_of(record)) == text, f"run: python -m benchmarks document {files}"


@pytest.mark.parametrize("name", FILLED)
def test_pages_show_every_part(name):
    texts = [page.read_text(encoding="utf-8") for page in FILLED[name]]
    marked = [found[1] for text in texts for found in MARKED.findall(text)]
    parts = cli.study_of(record_of(name)).parts
    assert {part for part in marked if part in parts} == set(parts)
    assert set(marked) <= {part for study in cli.STUDIES.values() for part in study.parts}


@pytest.mark.parametrize("name", FILLED)
def test_document_and_report_commands_show_a_record(name, tmp_path, capsys):
    record = record_of(name)
    page, parts = tmp_path / "page.md", [name for name, part in cli.study_of(record).parts.items() if part(record)]
    page.write_text("".join(f"<!-- table: {part} -->\n<!-- end -->\n" for part in parts))
    assert cli.main(["document", str(RECORDS / f"{name}.json"), str(page)]) == 0
    assert len(page.read_text().splitlines()) >= 3 * len(parts)
    assert cli.main(["report", str(RECORDS / f"{name}.json")]) == 0
    assert len(capsys.readouterr().out.splitlines()) >= 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing", "the page must hold <!-- table: NAME -->"),
        ("<!-- table: nobody -->\n<!-- end -->", "a marker must be one of facts, .*, got 'nobody'"),
        ("<!-- table: scaling -->\n<!-- end -->", "the record must hold 'scaling' for 'scaling'"),
    ],
)
def test_page_or_record_that_lacks_a_part_is_refused(text, message):
    record = record_of("accuracy")
    del record["scaling"]
    with pytest.raises(ValueError, match=message):
        with_parts(text, record, cli.study_of(record).parts)


def test_all_measures_every_record_by_commands_that_there_are():
    own = {"real_files"}  # of files of others
    assert {path.stem for path in RECORDS.glob("*.json")} == EVERY.keys() | own
    for command, _ in EVERY.values():
        assert cli.parser().parse_args(command.split()).action.func is cli.measure


def test_commands_refuse_what_does_not_fit(tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("nothing")
    assert cli.main(["document", str(RECORDS / "accuracy.json"), str(page)]) == 2
    assert "the page must hold" in capsys.readouterr().err
    assert cli.main(["charts", str(RECORDS / "smooth.json"), "-o", str(tmp_path)]) == 2
    assert "there are no charts of a record of run" in capsys.readouterr().err
