"""What mkdocs calls while it makes the site: pages that are generated, and links out of docs/.

Generated are the front page (README.md), the changelog, the reference of all messages and services
(from the .msg, .srv and .action files), one page for each package with what its docstrings say, and
an index from A to Z.
A link to a file of the repository outside of docs/ leads to a copy of that file as text.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import griffe
from markdown.extensions.toc import slugify
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))

from formulas import readable

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
ROOT_PAGES = {
    "index.md": "README.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
}
"""Page of the site -> document at the root of the repository."""
COPIES = "files"
GLOSSARY, INTERFACES = "learn/glossary.md", "interfaces.md"
LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s]+)(\))")
DEFINITIONS = {"msg": "message", "srv": "service", "action": "action"}
FENCE = re.compile(r"^ *```.*?^ *```$", re.DOTALL | re.MULTILINE)
HEADING = re.compile(r"^(#{1,3}) (.+)$", re.MULTILINE)
NUMBER = re.compile(r"^(\d+|[A-Z])\. ")
WORD = re.compile(r"^- \*\*(.+?)\*\*:", re.MULTILINE)
NAMES = re.compile(r"^\| (`[^|]+`) \|", re.MULTILINE)
UNLISTED = ("decisions/", "state_table.md", "benchmarks.md")
"""Pages whose headings are no words that somebody looks up."""


class Examples(griffe.Extension):
    """Show a section "Example:" of a docstring as code; the parser knows "Examples:" only.

    Formulas are drawn, and references become names.
    """

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rename the section, and draw."""
        if obj.docstring is not None:
            renamed = re.sub(r"^Example:$", "Examples:", obj.docstring.value, flags=re.MULTILINE)
            obj.docstring.value = readable(renamed)


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages, and the copies of what the documents link to."""
    made = {page: (ROOT / source).read_text("utf-8") for page, source in ROOT_PAGES.items()}
    made["reference/messages.md"] = messages_page()
    made["reference/decisions.md"] = decisions_page()
    made["reference/a_to_z.md"] = index_page(
        {
            file.relative_to(DOCS).as_posix(): file.read_text("utf-8")
            for file in sorted(DOCS.rglob("*.md"))
        }
    )
    made |= module_pages()
    for name, text in made.items():
        files.append(File.generated(config, name, content=text))
    for target in sorted(set(linked_files())):
        files.append(File.generated(config, copy_of(target), content=text_of(target)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Let the links of a page lead to pages of the site, or to copies."""
    name = page.file.src_uri
    source = ROOT / ROOT_PAGES[name] if name in ROOT_PAGES else DOCS / name

    def led(found: re.Match[str]) -> str:
        return f"{found[1]}{site_link(found[2], source, name)}{found[3]}"

    return LINK.sub(led, markdown)


def site_link(link: str, source: Path, page: str) -> str:
    """Return where a link of a document leads on the site.

    Args:
        link: As the document has it.
        source: The document.
        page: Its page on the site.
    """
    if re.match(r"[a-z]+:|#", link):
        return link
    name, sign, anchor = link.partition("#")
    target = (source.parent / name).resolve()
    roots = {ROOT / document: uri for uri, document in ROOT_PAGES.items()}
    if target in roots:
        uri = roots[target]
    elif target == DOCS / "decisions":
        uri = "reference/decisions.md"
    elif target.is_relative_to(DOCS) and not target.name.endswith(".py"):
        uri = target.relative_to(DOCS).as_posix()
    elif target.exists() and target.is_relative_to(ROOT):
        uri = copy_of(target)
    else:
        return link
    return os.path.relpath(uri, Path(page).parent) + sign + anchor


def documents() -> Iterator[Path]:
    """Yield every document that becomes a page."""
    yield from (ROOT / name for name in ROOT_PAGES.values())
    yield from sorted(DOCS.rglob("*.md"))


def linked_files() -> Iterator[Path]:
    """Yield the files and folders outside of docs/ that documents link to."""
    for document in documents():
        for _, link, _ in LINK.findall(document.read_text("utf-8")):
            target = (document.parent / link.partition("#")[0]).resolve()
            inside = target.is_relative_to(ROOT) and target.exists() and target != ROOT
            is_page = target.is_relative_to(DOCS) and not target.name.endswith(".py")
            if inside and not is_page and target not in {ROOT / n for n in ROOT_PAGES.values()}:
                yield target


def copy_of(target: Path) -> str:
    """Return where the copy of a file or folder is on the site; a browser shows it as text."""
    name = target.relative_to(ROOT).as_posix()
    return f"{COPIES}/{name}/list.txt" if target.is_dir() else f"{COPIES}/{name}.txt"


def text_of(target: Path) -> str:
    """Return a file's text, or the names in a folder."""
    if target.is_dir():
        return "".join(f"{entry.name}\n" for entry in sorted(target.iterdir()))
    return target.read_text("utf-8")


def messages_page() -> str:
    """Return the reference of all messages, services and actions, as their files define them."""
    parts = [
        "# Messages and services\n\nAs their files define them: fields, units and meaning stand "
        "beside each field. What speaks on which topic: [interfaces](../interfaces.md).\n"
    ]
    for package in sorted(entry for entry in (ROOT / "src").iterdir() if entry.is_dir()):
        found = [
            (kind, file) for kind in DEFINITIONS for file in sorted(package.rglob(f"*.{kind}"))
        ]
        if found:
            parts.append(f"\n## {package.name}\n")
        for kind, file in found:
            text = file.read_text("utf-8").rstrip()
            parts.append(
                f"\n### {package.name}/{file.stem}\n\n{DEFINITIONS[kind].capitalize()}.\n\n"
                f"```text\n{text}\n```\n"
            )
    return "".join(parts)


def decisions_page() -> str:
    """Return the list of all decisions."""
    lines = ["# Decisions\n", "\nWhat was decided, and why. The newest is the last.\n\n"]
    for file in sorted((DOCS / "decisions").glob("*.md")):
        title = file.read_text("utf-8").partition("\n")[0].lstrip("# ")
        lines.append(f"- [{title}](../decisions/{file.name})\n")
    return "".join(lines)


def index_page(pages: dict[str, str]) -> str:
    """Return the index from A to Z: headings, words of the glossary, topics and services.

    Args:
        pages: Markdown by the name of its page.
    """
    entries: list[tuple[str, str, str]] = []
    for page, text in pages.items():
        if page.startswith(UNLISTED):
            continue
        title, *headings = list(headings_of(text))
        entries += [
            (NUMBER.sub("", words), f"{page}#{anchor}", title[0]) for words, anchor in headings
        ]
        entries.append((title[0], page, ""))
        if page == GLOSSARY:
            entries += [(word, page, title[0]) for word in WORD.findall(text)]
        if page == INTERFACES:
            entries += interface_entries(text, headings)
    lines = ["# Index from A to Z\n\nWhat the pages say, and where.\n"]
    letter = ""
    entries = sorted(set(entries), key=lambda entry: (sort_key(entry[0]), entry))
    for words, target, title in entries:
        first = sort_key(words)[:1].upper()
        if first.isalpha() and first != letter:
            letter = first
            lines.append(f"\n## {letter}\n\n")
        where = f" ({title})" if title else ""
        lines.append(f"- [{words}](../{target}){where}\n")
    return "".join(lines)


def interface_entries(text: str, headings: list[tuple[str, str]]) -> list[tuple[str, str, str]]:
    """Return what the tables of the interfaces name, with the section and the node of each.

    Args:
        text: The page.
        headings: Words and anchor of each of its headings but the title.
    """
    entries = []
    sections = re.split(r"^#{2,3} .+$", FENCE.sub("", text), flags=re.MULTILINE)[1:]
    for (node, anchor), section in zip(headings, sections, strict=True):
        for cell in NAMES.findall(section):
            names = re.findall(r"`([a-z/~][\w/<>~ ]*)`", cell)
            entries += [(f"`{name}`", f"{INTERFACES}#{anchor}", node) for name in names]
    return entries


def headings_of(text: str) -> Iterator[tuple[str, str]]:
    """Yield the headings of a page as plain words, and the anchor that mkdocs gives each."""
    taken: dict[str, int] = {}
    for _, heading in HEADING.findall(FENCE.sub("", text)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", heading).strip()
        anchor = slugify(words, "-")
        taken[anchor] = taken.get(anchor, -1) + 1
        yield words, f"{anchor}_{taken[anchor]}" if taken[anchor] else anchor


def sort_key(words: str) -> str:
    """Return what an entry is sorted by: its letters, without an article in front."""
    return re.sub(r"^(an?|the) |^[^a-z0-9]+", "", words.lower())


def module_pages() -> dict[str, str]:
    """Return a page for each package with what its docstrings say, and the list of packages."""
    pages, rows = {}, []
    for folder in [ROOT / "config", *sorted((ROOT / "src").iterdir())]:
        for package in sorted((folder / "src").glob("*/__init__.py")):
            name, about = package.parent.name, first_line(package)
            modules = sorted(module_names(package.parent))
            body = "".join(f"\n::: {module}\n" for module in modules)
            pages[f"reference/modules/{name}.md"] = f"# {name}\n\n{about}\n{body}"
            rows.append(f"| [{name}](modules/{name}.md) | {about} | {len(modules)} |\n")
    head = (
        "# Python modules\n\nWhat their docstrings say: arguments with shape, unit and frame.\n\n"
    )
    table = "| package | what it is for | modules |\n|---|---|---|\n"
    return {"reference/modules.md": head + table + "".join(rows), **pages}


def module_names(package: Path) -> Iterator[str]:
    """Yield the names of a package's modules; those named _io or _node are no one's to import."""
    for file in package.rglob("*.py"):
        parts = file.relative_to(package.parent).with_suffix("").parts
        if not parts[-1].endswith(("_io", "_node", "__init__")):
            yield ".".join(parts)


def first_line(file: Path) -> str:
    """Return the first line of a module's docstring."""
    found = re.match(r'\s*r?"""(.*?)(?:"""|\n)', file.read_text("utf-8"))
    return found[1] if found else ""
