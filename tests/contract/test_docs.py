"""The documents: links lead somewhere, sources are named, nothing points outside the repository."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from harness.workspace import ROOT
from scara_config import files_in_force

DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+\s+(.*)$", re.MULTILINE)


def anchors(text: str) -> set[str]:
    """Return the anchors that a page shows for its headings."""
    kept = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in HEADING.findall(text))
    return {heading.strip().replace(" ", "-") for heading in kept}


@pytest.mark.parametrize("name", ["README.md", "CHANGELOG.md", "LICENSE", "docs/interfaces.md", "docs/sources.md"])
def test_document_exists_and_says_something(name: str) -> None:
    """A reader finds these in every version."""
    assert len((ROOT / name).read_text(encoding="utf-8")) > 200


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files_and_headings_that_exist(document: Path) -> None:
    """Links to other sites are not followed; all others are."""
    text = document.read_text(encoding="utf-8")
    broken = []
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = document if not name else (document.parent / name).resolve()
        is_page = file.suffix == ".md" and file.is_file()
        if not file.exists() or (anchor and is_page and anchor not in anchors(file.read_text(encoding="utf-8"))):
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_documents_name_no_place_outside_the_repository(document: Path) -> None:
    """What a clone does not contain, nobody can read."""
    text = document.read_text(encoding="utf-8")
    assert not re.search(r"\.\./shared|(?<![\w/.])/(work|home|root)/", text)


@pytest.mark.parametrize("file", sorted(name for name in files_in_force(ROOT / "config") if "/" not in name))
def test_every_configuration_file_has_its_sources_listed(file: str) -> None:
    """docs/sources.md leads from each constant to its source or to "our choice"."""
    assert file in (ROOT / "docs" / "sources.md").read_text(encoding="utf-8")


def test_decisions_are_numbered_without_gaps_and_titled() -> None:
    """docs/decisions/NNNN-title.md, so that they can be referred to."""
    files = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    assert [int(file.name[:4]) for file in files] == list(range(1, len(files) + 1))
    for file in files:
        assert re.fullmatch(r"\d{4}-[a-z0-9-]+\.md", file.name)
        assert file.read_text(encoding="utf-8").startswith("# ")
