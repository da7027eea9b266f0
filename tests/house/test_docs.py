"""The pages: links lead somewhere, every page and picture is shown by another, and api.md has the public names."""

import ast
import re
from pathlib import Path

from engine_cases import one_by_one

import topleft as tl
from topleft._meshes.io.limits.budget import LIMITS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
READERS = ROOT / "src/topleft/_meshes/io"
PAGES = sorted(DOCS.rglob("*.md"))
FRONT = sorted(ROOT.glob("*.md"))
CHECKED = [*FRONT, *PAGES, *sorted(ROOT.glob("benchmarks/**/*.md")), *sorted(ROOT.glob("csrc/**/*.md"))]

ROOMS = ("src", "csrc", "tests", "benchmarks", "examples", "docs")
BUILD = [ROOT / "setup.py", *(ROOT / "packaging").glob("*.py")]
SOURCES = [path.as_posix() for path in [*BUILD, *(p for name in ROOMS for p in (ROOT / name).rglob("*.*"))]]
NAMED = re.compile(r"(?<![\w./])[\w./]*[a-z0-9_]\.(?:c|h|py|pyi|pyx|pxi)\b(?!\()")
LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)


def links(page):
    """Files of the repository that a page leads to, each with the heading behind `#`."""
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    found = [address.partition("#") for address in LINK.findall(text) if not re.match(r"[a-z]+:", address)]
    return [(page.parent.joinpath(path).resolve() if path else page, part) for path, _, part in found]


def anchors(page):
    """The ids that headings have on GitHub: small letters, blanks as hyphens, no other signs."""
    titles = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@one_by_one("page", CHECKED)
def test_links_lead_to_files_and_headings_that_exist(page):
    found = links(page)
    assert [path.relative_to(ROOT).as_posix() for path, _ in found if not path.exists()] == []
    assert [f"{path.name}#{part}" for path, part in found if part and part not in anchors(path)] == []


@one_by_one("page", [*FRONT, *PAGES])
def test_page_has_a_title_and_a_first_sentence(page):
    title, blank, first = page.read_text(encoding="utf-8").split("\n", 3)[:3]
    assert title.startswith("# ")
    assert blank == ""
    assert re.match(r"[\[`*\w]", first)


@one_by_one("page", CHECKED)
def test_powers_outside_code_are_not_read_as_bold(page):
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    assert re.findall(r"(?m)^(?!    ).*\d\*\*-?\d.*$", text) == []  # 2**62 to 2**30 shows as a bold "62 to 2"


def test_packages_are_named_by_what_can_be_installed_before_a_release_too():
    told = [*PAGES, *FRONT, *(ROOT / "src").rglob("*.py")]
    assert len(told) > 100
    named = [path.name for path in told if re.search(r"install .?topleft\[", path.read_text(encoding="utf-8"))]
    assert named == []


def test_index_lists_every_page_once():
    listed = [path for path, _ in links(DOCS / "README.md") if DOCS in path.parents]
    assert sorted(listed) == [page for page in PAGES if page != DOCS / "README.md"]


def test_every_picture_is_shown_by_a_page():
    shown = {path for page in CHECKED for path, _ in links(page)}
    assert [path.name for path in sorted(DOCS.joinpath("images").iterdir()) if path not in shown] == []


@one_by_one("page", [*FRONT, *PAGES])
def test_source_files_that_a_page_names_exist(page):
    named = {name for code in CODE.findall(page.read_text(encoding="utf-8")) for name in NAMED.findall(code)}
    named -= {name for name in named if re.search(r"NAME|Python\.h|\.ci/", name)}  # to be filled in; not in an sdist
    assert sorted(name for name in named if not any(path.endswith(f"/{name}") for path in SOURCES)) == []


def test_api_page_has_every_public_name_and_members_that_exist(promised):
    assert sorted(promised) == sorted(tl.__all__)
    assert [f"{name}.{one}" for name, members in promised.items() for one in members if not is_member(name, one)] == []


def is_member(name, member):
    """Tell whether a class has it, or its docstring names it as an attribute."""
    owner = getattr(tl, name)
    return hasattr(owner, member) or re.search(rf"^ *[\w, ]*\b{member}\b[\w, ]* :", owner.__doc__, re.M)


def test_limits_of_files_are_those_of_the_page():
    rows = re.findall(
        r"(?m)^\| `(max_\w+)` \| .* \| ([\d,]+|8 GiB) \| ([\d.]*) ?\|$", (DOCS / "guide/files.md").read_text()
    )
    said = {
        name: (8 << 30 if "G" in least else int(least.replace(",", "")), float(more or 0)) for name, least, more in rows
    }
    assert said == {name: (limit.least, limit.per_byte) for name, limit in LIMITS.items()}


def test_warnings_of_readers_are_those_of_the_page():
    page = (DOCS / "guide/files.md").read_text(encoding="utf-8").partition("\nFaces with more")[0]
    rows = re.findall(r"(?m)^\| .+ \| .* \| (.*) \| .*\|$", page)
    told = {kind for row in rows[1:] for kind in row.split("; ") if kind.strip("- ")}
    trees = [
        ast.parse(path.read_text(encoding="utf-8")) for path in READERS.rglob("*.py") if "polygon" not in path.name
    ]
    calls = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call)]
    added = [call.args[0] for call in calls if re.search(r"notes\.add$", ast.unparse(call.func))]
    kinds = {node.value for node in added if isinstance(node, ast.Constant)}
    assert kinds - told == set()
    texts = {node.value for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    words = " ".join(text for text in texts if isinstance(text, str))
    assert [kind for kind in told for part in kind.split("…") if part not in words] == []


def test_each_room_has_a_promise_in_trust():
    page = (DOCS / "guide/trust.md").read_text(encoding="utf-8")
    rows = [row.split("|")[2:5] for row in re.findall(r"^\|.*\|$", page, re.M) if row.count("|") == 5][2:]
    python, c, tests = ({name for row in rows for name in re.findall(r"`([^`]+)`", row[k])} for k in range(3))
    package = ROOT / "src/topleft"
    rooms = {path.relative_to(package).as_posix() for path in package.glob("[_m]*/*/") if any(path.glob("*.py"))}
    assert python == rooms | {"_torch", "compat"}
    assert c == {path.name for path in (ROOT / "csrc").iterdir() if path.is_dir()}
    assert all((ROOT / name).exists() for name in tests)
