"""The report in one HTML file: it holds every page and picture, asks the network for nothing, and closes its tags."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser

import pytest

pytest.importorskip("matplotlib")
from benchmarks import cli
from benchmarks.accuracy import html_report
from benchmarks.harness.machine import RECORDS, ROOT
from benchmarks.report.markdown import MANY_COLUMNS, to_html

RECORD = RECORDS / "accuracy.json"
HEAD = '<thead><tr><th>a</th><th class="n">b</th></tr></thead>'
ROW = '<tr><td><code>1</code></td><td class="n">2</td></tr>'
PIXEL = bytes.fromhex("89504e470d0a1a0a")


def html_of(text):
    """The HTML of a text whose addresses stay."""
    return to_html(text, lambda address: address, lambda address: address)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("# A *b* `c*d*`", "<h1>A <em>b</em> <code>c*d*</code></h1>"),
        ("one\ntwo\n\n**three** 2 * 3 * 4", "<p>one two</p>\n<p><strong>three</strong> 2 * 3 * 4</p>"),
        ("- a\n  b\n- c", "<ul><li>a b</li><li>c</li></ul>"),
        ("1. a\n2. b", "<ol><li>a</li><li>b</li></ol>"),
        ("```sh\na <b>\n\nc\n```", "<pre><code>a &lt;b&gt;\n\nc</code></pre>"),
        ("[a](b.md) & ![c](d.png)", '<p><a href="b.md">a</a> &amp; <img alt="c" src="d.png"></p>'),
        ("![a](b.png)", '<figure><img alt="a" src="b.png"></figure>'),
        ("<!-- table: x -->\ntext\n<!-- end -->", "<p>text</p>"),
        ("| a | b |\n|---|--:|\n| `1` | 2 |", f'<div class="wide"><table>{HEAD}<tbody>{ROW}</tbody></table></div>'),
    ],
)
def test_markdown_block_becomes_html(text, expected):
    assert html_of(text) == expected


@pytest.mark.parametrize(("n", "kind"), [(MANY_COLUMNS, "wide"), (MANY_COLUMNS + 1, "wide many")])
def test_markdown_table_of_many_columns_is_marked(n, kind):
    assert html_of(f"{'|a' * n}|\n{'|-' * n}|").startswith(f'<div class="{kind}">')


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report that the command writes, of the record in the repository and two pages, one of another record."""
    folder = tmp_path_factory.mktemp("pages")
    for name in ("images", "measured"):
        (folder / name).mkdir()
    (folder / "images/atlas-x.png").write_bytes(PIXEL)
    page = "# Speed\n\n## Now\n\n<!-- table: tutorial -->\n<!-- end -->\n\n![chart](../images/speed-sizes.svg)\n"
    links = "[other](atlas.md) [none](../design/rules.md) [out](https://example.com)"
    (folder / "measured/speed.md").write_text(f"{page}\n{links}\n")
    own = "<!-- table: maps -->\nits own\n<!-- end -->\n"
    (folder / "measured/atlas.md").write_text(f"# Atlas\n\n{own}\n![map](../images/atlas-x.png)\n")
    out = folder / "report.html"
    assert cli.main(["report", str(RECORD), "--html", str(out), "--pages", str(folder)]) == 0
    return out.read_text(encoding="utf-8")


def test_report_holds_its_pages_with_figures_of_the_record(report):
    assert "<h1>Speed</h1>" in report
    assert "<td><code>point_in_triangle</code></td>" in report
    assert "<p>its own</p>" in report
    assert 'href="#speed-1"' in report
    assert 'id="speed-1"' in report
    assert json.loads(RECORD.read_text())["machine"]["cpu"] in report


def test_report_pictures_are_in_it(report):
    sources = re.findall(r'<img alt="\w+" src="([^"]+)"', report)
    assert [source.partition(";")[0] for source in sources] == ["data:image/svg+xml", "data:image/png"]


def test_report_links_lead_into_it_or_out(report):
    assert '<a href="#atlas">other</a> none <a href="https://example.com">out</a>' in report


def test_report_closes_its_tags(report):
    class Checker(HTMLParser):
        open_tags: list[str] = []  # noqa: RUF012

        def handle_starttag(self, tag, attrs):
            if tag not in ("meta", "img"):
                self.open_tags.append(tag)

        def handle_endtag(self, tag):
            assert self.open_tags.pop() == tag

    checker = Checker()
    checker.feed(report)
    assert checker.open_tags == []


def test_report_of_another_kind_of_record_is_refused(tmp_path, capsys):
    (tmp_path / "run.json").write_text("{}")
    assert cli.main(["report", str(tmp_path / "run.json"), "--html", str(tmp_path / "out.html")]) == 2
    assert "--html takes one accuracy record" in capsys.readouterr().err


def test_every_page_of_the_report_has_a_title():
    for name in html_report.PAGES:
        assert (ROOT / "docs" / name).read_text(encoding="utf-8").startswith("# ")
