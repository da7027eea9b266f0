"""Public names, parameters, defaults and options are those of the list, and help and api.md name each of them once."""

import re
from pathlib import Path

import pytest
from public_names import SECTIONS, kept_lines, lines

import topleft as tl

API = Path(__file__).parents[2] / "docs" / "api.md"


@pytest.mark.parametrize("section", SECTIONS)
def test_public_names_are_those_of_the_list(section):
    if section in ("topleft.torch", "topleft.jax"):
        pytest.importorskip(section.rpartition(".")[2])
    now, kept = lines(section), kept_lines(section)
    changed = [f"- {one}" for one in kept if one not in now] + [f"+ {one}" for one in now if one not in kept]
    assert not changed, "promised in docs/guide/promises.md; if it is meant: python tests/support/public_names.py"


def test_help_has_every_public_name_by_task():
    by_task = tl.__doc__.partition("All names, by task:")[2]
    assert sorted(re.findall(r"\w+", re.sub(r"(?m)^    .{14}|\(.*?\)", "", by_task))) == sorted(tl.__all__)


def test_api_page_leads_to_every_public_name():
    by_task = API.read_text(encoding="utf-8").partition("## All names, by task")[2].partition("## ")[0]
    assert sorted(re.findall(r"`(\w+)`", by_task)) == sorted(tl.__all__)
