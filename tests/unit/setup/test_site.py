"""The documents become a site without a warning, and every link in it leads somewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from harness.workspace import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.thorough]
"""contract/test_docs.py holds names and links of the sources each time; a build takes 20 s."""
NO_FILE = re.compile(r"[a-z]+:|//")


class Links(HTMLParser):
    """Collects what a page links to, and the anchors that it has."""

    def __init__(self) -> None:
        """Begin with an empty page."""
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep the links and names of an element."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            if name in ("id", "name") and value:
                self.anchors.add(value)


def read(page: Path) -> Links:
    """Read a page of the site."""
    links = Links()
    links.feed(page.read_text(encoding="utf-8"))
    return links


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site; a warning of mkdocs is an error."""
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    done = subprocess.run(
        [*words, "--config-file", str(ROOT / "mkdocs.yml"), "--site-dir", str(folder)],
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def broken(site: Path) -> Iterator[str]:
    """Yield the links that lead to no file or no anchor of the site."""
    pages = {page: read(page) for page in site.rglob("*.html")}
    assert len(pages) > 50
    for page, content in pages.items():
        if page.name == "404.html":  # its links start at the root of a server
            continue
        for link in content.links:
            name, _, anchor = unquote(link).partition("#")
            if NO_FILE.match(link):
                continue
            target = (page.parent / name).resolve() if name else page
            known = pages[target].anchors if target in pages else {anchor}
            if not target.exists() or (anchor and anchor not in known):
                yield f"{page.relative_to(site)}: {link}"


def test_every_link_of_the_site_leads_somewhere(site: Path) -> None:
    """To a file and an anchor of the site."""
    assert sorted(set(broken(site))) == []


def test_the_site_has_messages_modules_and_the_tutorial(site: Path) -> None:
    """What is generated is there, with content."""
    messages = (site / "reference" / "messages.html").read_text()
    assert "scara_msgs/MoveTo" in messages and "speed_percent" in messages
    kinematics = (site / "reference" / "modules" / "scara_control.html").read_text()
    assert "forward_kinematics" in kinematics and "Homogeneous transform" in kinematics
    assert "The first move" in (site / "learn" / "tutorial.html").read_text()
    assert "Start it" in (site / "index.html").read_text()


def test_the_index_has_headings_and_the_words_of_the_glossary(site: Path) -> None:
    """A heading leads to its place, a word to the glossary; what stands in a code block is none."""
    index = (site / "reference" / "a_to_z.html").read_text()
    assert '<a href="../operator.html#who-may-command">Who may command</a>' in index
    assert '<a href="../learn/glossary.html">override</a>' in index
    assert "<code>move_to</code></a> (motion_server" in index
    assert "first shell: the desk" not in index and ">1. The first move" not in index


def test_formulas_are_drawn_and_references_are_names(site: Path) -> None:
    """Nobody reads ``.. math::``; a page that is opened without a network draws nothing itself."""
    pages = {page.name: page.read_text() for page in (site / "reference" / "modules").iterdir()}
    raw = re.compile(r"math::|:(?:math|func|class|meth|mod|data|attr):")
    assert [name for name, text in pages.items() if raw.search(text)] == []
    kinematics = pages["scara_control.html"]
    assert kinematics.count('<svg style="vertical-align') > 20
    assert not [
        text for text in pages.values() if re.search(r"<code>[^<]*\\[a-z]+[^<]*</code>", text)
    ]


def test_the_site_fetches_nothing_from_elsewhere(site: Path) -> None:
    """A page that needs another place for a picture or a script says nothing without it."""
    pages = [page.read_text() for page in site.rglob("*.html")]
    fetched = re.compile(r'<(?:script|img|link)[^>]*(?:src|href)="(?:https?:)?//')
    assert [found for text in pages for found in fetched.findall(text)] == []
    assert not [text for text in pages if 'class="mermaid"' in text]
