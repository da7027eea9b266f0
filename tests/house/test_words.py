"""docs/guide/words.md: the calls of its tables exist, and the page that a row leads to says more about them."""

import functools
import re
from pathlib import Path

import pytest

import topleft as tl

PAGE = Path(__file__).parents[2] / "docs" / "guide" / "words.md"
TEXT = PAGE.read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (.+?) \| (.+?) \| \[[^\]]*\]\((.+?)\) \|$", TEXT, re.MULTILINE)
CALLS = re.compile(r"`(tl|frags|topleft)[.]([\w.]+)")
OPTIONS = re.compile(r"`(\w+)=")


def test_page_has_its_rows():
    assert len(ROWS) == len([line for line in TEXT.splitlines() if line.startswith("| ")]) - TEXT.count("| your word |")
    assert len(ROWS) > 40


def test_each_word_stands_in_one_row():
    words = [word.strip("` ").lower() for row in ROWS for word in row[0].split(", ")]
    assert sorted(words) == sorted(set(words))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0].split(",")[0].strip("`"))
def test_call_exists_and_its_page_names_it(row):
    _, here, page = row
    text = (PAGE.parent / page).read_text(encoding="utf-8")
    names = []
    for owner, path in CALLS.findall(here):
        names.append(path.rpartition(".")[2])
        if owner != "topleft":
            functools.reduce(getattr, path.split("."), tl if owner == "tl" else tl.Fragments)
    names += [f"{option}=" for option in OPTIONS.findall(here)]
    assert not names or any(name in text for name in names), f"{page} names none of {', '.join(names)}"
