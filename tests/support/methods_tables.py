"""The tables of docs/guide/methods.md, made from the registry and from what the methods draw.

`python tests/support/methods_tables.py` writes them anew; `test_tutorial_scenes.py` checks that they are up to date.
"""

from pathlib import Path

import topleft as tl
from topleft import scenes
from topleft.methods import CLASSICS, METHODS, Claims

DOCUMENT = Path(__file__).resolve().parents[2] / "docs/guide/methods.md"

YES_NO = {"exact": "exact", "watertight": "watertight", "top_left": "top-left", "sub_pixel": "sub-pixel",
          "integer_vertices": "integer vertices", "overdraws_shared_edges": "overdraws shared edges"}  # fmt: skip
ALL = {name: method for name, method in (METHODS | CLASSICS).items() if name != "auto"}


def table(head: list[str], rows: list[list[str]], align: str) -> str:
    lines = [head, ["---", *[align] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def claims_row(claims: Claims) -> list[str]:
    return ["yes" if getattr(claims, name) else "no" for name in YES_NO] + [claims.winding]


def claims_table() -> str:
    rows = [[f"`{name}`", *claims_row(method.claims)] for name, method in ALL.items()]
    return table(["method", *YES_NO.values(), "winding"], rows, "---")


def count_draws(name: str) -> list[int]:
    """How many pixels a method draws of each tutorial scene, twice drawn ones twice."""
    return [
        int(tl.overdraw(*make(), scenes.TUTORIAL_SIZE, method=name).sum()) for make in scenes.TUTORIAL_SCENES.values()
    ]


def scenes_table() -> str:
    counts = {name: count_draws(name) for name in ALL}
    rows = [[scene, *(str(counts[name][i]) for name in ALL)] for i, scene in enumerate(scenes.TUTORIAL_SCENES)]
    return table(["scene", *(f"`{name}`".replace("/", "` `/") for name in ALL)], rows, "---:")


TABLES = {"claims": claims_table, "scenes": scenes_table}


def with_tables(text: str) -> str:
    """The document with what stands between the markers made anew."""
    for name, make in TABLES.items():
        start, end = f"<!-- table: {name} -->\n", "<!-- end -->"
        head, found, rest = text.partition(start)
        assert found, f"{DOCUMENT.name} must hold the table {name}"
        text = head + start + make() + "\n" + end + rest.partition(end)[2]
    return text


if __name__ == "__main__":
    DOCUMENT.write_text(with_tables(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
