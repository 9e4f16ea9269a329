"""The documents: links lead somewhere, sources are named, what they tell to type exists."""

from __future__ import annotations

import ast
import doctest
import functools
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.sources import Module, modules, nodes_of, parsed
from harness.workspace import ROOT
from scara_bringup.config import load_doors
from scara_bringup.plan import ROSOUT, cell_plan
from scara_config import files_in_force

DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
EXAMPLES = [module for module in modules() if ">>>" in module.path.read_text(encoding="utf-8")]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
QUOTE = re.compile(r'"([^"]+)"')
UNKNOWN = re.compile(r"\.\.\.|\d+|\b(?:coal|operator_panel)\b")
"""What a message has in such places depends on the moment."""
HEADING = re.compile(r"^#+\s+(.*)$", re.MULTILINE)
MOST_README_LINES = 60
TYPED = re.compile(r"rosrun (?P<package>\w+) (?P<node>\w+)(?P<words>[^`\n]*)")


def anchors(text: str) -> set[str]:
    """Return the anchors that a page shows for its headings."""
    kept = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in HEADING.findall(text))
    return {heading.strip().replace(" ", "-") for heading in kept}


def broken(document: Path) -> Iterator[str]:
    """Yield the links that lead nowhere. Links to other sites are not followed; all others are."""
    text = document.read_text(encoding="utf-8")
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = document if not name else (document.parent / name).resolve()
        is_page = file.suffix == ".md" and file.is_file()
        if not file.exists() or (
            anchor and is_page and anchor not in anchors(file.read_text(encoding="utf-8"))
        ):
            yield f"{document.relative_to(ROOT)}: {target}"


@pytest.mark.parametrize("module", EXAMPLES, ids=lambda module: module.relative)
def test_an_example_of_a_docstring_gives_what_it_says(module: Module) -> None:
    """It is run as a person would type it."""
    source = next(folder for folder in module.path.parents if folder.name == "src")
    name = ".".join(module.path.relative_to(source).with_suffix("").parts)
    done = doctest.testmod(importlib.import_module(name))
    assert done.attempted and not done.failed


def test_documents_exist_and_say_something() -> None:
    """A reader finds these in every version."""
    names = ["README.md", "CHANGELOG.md", "LICENSE", "docs/interfaces.md", "docs/sources.md"]
    files = {name: ROOT / name for name in names}
    assert [n for n, f in files.items() if not f.is_file() or f.stat().st_size <= 200] == []


def test_links_lead_to_files_and_headings_that_exist() -> None:
    """In all documents."""
    assert [text for document in DOCUMENTS for text in broken(document)] == []


def test_documents_name_no_place_outside_the_repository() -> None:
    """What a clone does not contain, nobody can read."""
    outside = re.compile(r"\.\./shared|(?<![\w/.])/(work|home|root)/")
    texts = {str(document.relative_to(ROOT)): document.read_text() for document in DOCUMENTS}
    assert [name for name, text in texts.items() if outside.search(text)] == []


def test_every_configuration_file_has_its_sources_listed() -> None:
    """docs/sources.md leads from each constant to its source or to "our choice"."""
    sources = (ROOT / "docs" / "sources.md").read_text(encoding="utf-8")
    files = sorted(name for name in files_in_force(ROOT / "config") if "/" not in name)
    assert [file for file in files if file not in sources] == []


def test_decisions_are_numbered_without_gaps_and_titled() -> None:
    """docs/decisions/NNNN-title.md, so that they can be referred to."""
    files = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    assert [int(file.name[:4]) for file in files] == list(range(1, len(files) + 1))
    for file in files:
        assert re.fullmatch(r"\d{4}-[a-z0-9-]+\.md", file.name)
        assert file.read_text(encoding="utf-8").startswith("# ")


def test_the_readme_is_read_in_a_minute() -> None:
    """It shows, in this order: the film, what it is, how to start, how good, how mature."""
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MOST_README_LINES
    assert "(docs/images/cell.gif)" in lines[1]
    headings = [line.removeprefix("## ") for line in lines if line.startswith("## ")]
    assert headings[0] == "Start it" and "How mature it is" in headings


def test_verbs_that_the_readme_shows_are_those_of_the_cell() -> None:
    """Each line works as it stands there."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    usage = (
        (ROOT / "cell").read_text(encoding="utf-8").partition("<<'END'")[2].partition("\nEND")[0]
    )
    known = set(re.findall(r"^  ([a-z]+)\b", usage, re.MULTILINE))
    told = re.findall(r"\./cell ([a-z]+)", text)
    assert told and [verb for verb in told if verb not in known] == []


def test_the_lines_by_hand_are_all_of_a_cell() -> None:
    """Who types them has what `./cell up` has, with the same arguments."""
    page = ROOT / "docs" / "operating" / "by_hand.md"
    section = page.read_text(encoding="utf-8").partition("Then, for example")[0]
    # devel/setup.bash sets no ROS_IP: the nodes would listen to the network.
    assert "source env.sh" in section and "setup.bash" not in section
    typed = {line.partition("#")[0].strip() for line in section.splitlines()}
    nodes = [ROSOUT, *cell_plan(load_doors(ROOT / "config"), with_panel=True, with_health=True)]
    wanted = [" ".join(("rosrun", n.package, n.executable, *n.arguments)) for n in nodes]
    assert [line for line in wanted if line not in typed] == []
    assert {line for line in typed if line.startswith("rosrun")} == set(wanted)


def test_messages_that_are_looked_up_are_those_that_are_shown() -> None:
    """Whoever searches the page for what stands on the screen finds it."""
    rows = (ROOT / "docs" / "learn" / "symptoms.md").read_text(encoding="utf-8").splitlines()
    seen = [row.split("|")[1] for row in rows if row.startswith("| ")]
    quoted = [text for cell in seen for text in QUOTE.findall(cell)]
    assert len(quoted) > 10
    files = [*(ROOT / "src").rglob("*.py"), *(ROOT / "setup").glob("*.sh")]
    code = "\n".join(file.read_text(encoding="utf-8") for file in files)
    shown = re.sub(r'"\s*\n\s*f?"', "", code)  # a text that goes on in the next line
    pieces = {piece.strip(" :;,") for text in quoted for piece in UNKNOWN.split(text)}
    assert sorted(piece for piece in pieces if piece not in shown) == []


def test_what_the_tutorial_tells_to_press_is_on_the_page() -> None:
    """Its bold words are buttons, tabs and texts of the operator's page."""
    text = (ROOT / "docs" / "learn" / "tutorial.md").read_text(encoding="utf-8")
    told = set(re.findall(r"\*\*(.+?)\*\*", text, re.DOTALL)) - {"pendant"}
    page = ROOT / "src" / "operator_panel"
    words = ROOT / "src" / "scara_ros" / "src" / "scara_ros" / "page" / "page_words.py"
    files = [*page.rglob("*.py"), words]
    shown = "\n".join(file.read_text(encoding="utf-8") for file in files)
    made = {"10", "World"}  # from the configuration, and from the names of the frames
    assert len(told) > 10
    assert sorted(word for word in told - made if f'"{" ".join(word.split())}"' not in shown) == []


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield file and text of each docstring of the packages."""
    for path in sorted([*(ROOT / "src").rglob("*.py"), *(ROOT / "config").rglob("*.py")]):
        for node in nodes_of(parsed(path)):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                yield path.relative_to(ROOT).as_posix(), ast.get_docstring(node) or ""


@functools.cache
def options_of(package: str) -> frozenset[str]:
    """Return the options that a package's commands may know: named, or made of a parameter."""
    known = {"--help"}
    for path in (ROOT / "src" / package / "src").rglob("*_node.py"):
        for node in nodes_of(parsed(path)):
            if isinstance(node, ast.Constant) and str(node.value).startswith("--"):
                known |= set(str(node.value).split("/"))
            elif isinstance(node, ast.arg):
                known.add(f"--{node.arg.replace('_', '-')}")
    return frozenset(known)


def unknown_words(text: str) -> Iterator[str]:
    """Yield the lines of a text whose command or option does not exist."""
    packages = {path.name for path in (ROOT / "src").iterdir()}
    for typed in TYPED.finditer(text):
        package, node, words = typed["package"], typed["node"], typed["words"]
        if package not in packages or node == "NODE":
            continue
        options = set(re.findall(r"(?<!\S)\[?(--[a-z][a-z-]*)", re.split(r" [#|] ", words)[0]))
        before = text[: typed.start()].rpartition("\n")[2].rpartition("`")[2]
        there = (ROOT / "src" / package / "nodes" / node).is_file()
        if not there or "rosrun" in words or " --" in before:
            yield typed[0]
        elif not options <= options_of(package):
            yield f"{typed[0]}: {sorted(options - options_of(package))}"


def test_what_docstrings_and_documents_tell_to_type_exists() -> None:
    """Each usage line: the command is there, and knows the options that the line gives it."""
    texts = [*docstrings(), *((str(page), page.read_text(encoding="utf-8")) for page in DOCUMENTS)]
    told = sum(len(TYPED.findall(text)) for _, text in texts)
    assert told > 100
    assert [f"{file}: {line}" for file, text in texts for line in unknown_words(text)] == []


@pytest.mark.parametrize(
    ("line", "fits"),
    [
        ("rosrun twin_experiments report BAG --output DIR", True),
        ("rosrun rviz rviz --whatever", True),
        ("rosrun twin_experiments reports BAG", False),
        ("rosrun twin_experiments report BAG --outputs DIR", False),
        ("rosrun twin_experiments report --output A rosrun twin_experiments report B", False),
        ("   --output A rosrun twin_experiments report B", False),
    ],
)
def test_a_line_that_nobody_can_type_is_found(line: str, fits: bool) -> None:
    """The test of the test: a command, an option, two lines that became one."""
    assert (list(unknown_words(line)) == []) is fits
