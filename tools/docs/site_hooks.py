"""What the site of the documentation adds to its pages: MkDocs calls these hooks, as mkdocs.yml says.

The pages are written to be read in the repository, on a forge or in an editor. Their links lead to files
anywhere in it, their headings are reached by the names that a forge gives them, and docs/README.md is their
index. The site follows them in all three.
"""

from __future__ import annotations

import logging
import os
import re
from collections import Counter
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from markdown_it import MarkdownIt

if TYPE_CHECKING:
    from collections.abc import Collection

    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
INDEX = PurePosixPath("docs/README.md")
ICON = ROOT / "service" / "web" / "icon.svg"

SECTION = re.compile(r"^## (?:[^:\n]+: )?(.+)$", re.MULTILINE)
ENTRY = re.compile(r"^- \[([^]]+)\]\(([^)\s]+)\)", re.MULTILINE)
FENCE_OR_LINK = re.compile(
    r"^```.*?^```|(?P<text>!?\[[^]]*\])\((?P<link>[^)\s]+)\)", re.MULTILINE | re.DOTALL
)
MARKER = re.compile(r" *((?:[-*+]|\d+[.)]) +)")
CELL = re.compile(r"<t[dh]\b.*?</t[dh]>", re.DOTALL)
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|object|embed|link(?![^>]*\brel="canonical"))\b"""
    r"""[^>]*?\s(?:src|href|data)=["']?((?:https?:)?//[^"'\s>]+)"""
    r"""|(?:url\(|@import\s)\s*["']?((?:https?:)?//[^"')\s]+)"""
)
"""What a page or a style sheet fetches from another host. A link that the reader may follow is none of it."""

LEVELS = ("h1", "h2", "h3", "h4", "h5", "h6")
COMPARED = (*LEVELS, "li", "th", "td", "pre", "code", "img", "blockquote", "strong", "em")
"""Elements that a page has as often on a forge as in the site."""

FORGE = MarkdownIt("commonmark").enable("table")
"""Markdown as a forge reads it."""

# MkDocs counts the warnings of loggers below its own: with `strict` each of them ends the build.
log = logging.getLogger("mkdocs.hooks.site")


class Slugs:
    """Fragments of a page's headings as forges write them: equal ones after the first have a number."""

    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()

    def __call__(self, heading: str, separator: str) -> str:
        """Return the fragment of the next heading of the page."""
        name = re.sub(r"[^\w-]", "", heading.lower().replace(" ", separator))
        self.seen[name] += 1
        return f"{name}-{self.seen[name] - 1}" if self.seen[name] > 1 else name

    def start(self) -> None:
        """Forget the headings of the page before."""
        self.seen.clear()


slugs = Slugs()


def on_config(config: MkDocsConfig) -> None:
    """Take the navigation from the index, and name headings as a forge does."""
    index = (ROOT / INDEX).read_text()
    config.nav = navigation(index)
    config.mdx_configs.setdefault("toc", {})["slugify"] = slugs
    config.watch.extend(str(ROOT / path) for path in outside_pages(index))


def on_files(files: Files, config: MkDocsConfig) -> None:
    """Add the pages outside docs that the index lists, and the icon of the service."""
    from mkdocs.structure.files import File  # noqa: PLC0415 - tests of the other functions do without MkDocs

    for path in outside_pages((ROOT / INDEX).read_text()):
        files.append(File.generated(config, site_path(path), abs_src_path=str(ROOT / path)))
    files.append(File.generated(config, ICON.name, abs_src_path=str(ICON)))


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, **_: object) -> str:
    """Lead the links of a page to pages of the site, and write its lists as MkDocs reads them."""
    slugs.start()
    here = PurePosixPath(Path(str(page.file.abs_src_path)).relative_to(ROOT))
    pages = outside_pages((ROOT / INDEX).read_text())
    return with_wide_lists(relinked(markdown, here, pages, source=config.repo_url))


def on_page_content(html: str, *, page: Page, **_: object) -> str:
    """Report a page that looks different on a forge, for Markdown has dialects, and show | as it does."""
    forge = elements(FORGE.render(str(page.markdown)))
    site = elements(html)
    for name in COMPARED:
        if forge[name] != site[name]:
            counts = (forge[name], name, site[name])
            log.warning("%s: a forge shows %d <%s>, the site %d", page.file.src_uri, *counts)
    return with_bars(html)


def on_post_build(config: MkDocsConfig) -> None:
    """Report what a reader's browser would fetch from another host."""
    for path in sorted(Path(config.site_dir).rglob("*")):
        if path.suffix in {".html", ".css"}:
            for address in fetched_elsewhere(path.read_text()):
                log.warning("%s: fetches %s", path.relative_to(config.site_dir), address)


def navigation(index: str) -> list[dict[str, Any]]:
    """The index as MkDocs takes it: a section for each heading, then pages that have no line of their own."""
    _, *parts = SECTION.split(index)
    sections = [
        {title.capitalize(): [{text: entry(path)} for text, path in entries(body)]}
        for title, body in zip(parts[::2], parts[1::2], strict=True)
    ]
    listed = {path for _, path in entries(index)}
    others = [site_path(path) for path in outside_pages(index) if path not in listed]
    return [{"Documentation": site_path(INDEX)}, *sections, *([{"Project": others}] if others else [])]


def entries(text: str) -> list[tuple[str, PurePosixPath]]:
    """Titles and paths of the pages that have a line of the index."""
    return [(title, repository_path(INDEX, link)) for title, link in ENTRY.findall(text)]


def entry(path: PurePosixPath) -> str | list[str | dict[str, str]]:
    """A page of the navigation; below it the pages of the folder of its name, in the order of its links."""
    if not (ROOT / path.with_suffix("")).is_dir():
        return site_path(path)
    below = [page for page in linked(path, (ROOT / path).read_text()) if page.parent == path.with_suffix("")]
    return [{"Overview": site_path(path)}, *map(site_path, below)]


def linked(here: PurePosixPath, text: str) -> list[PurePosixPath]:
    """Pages of the repository that a page links to, once each."""
    links = [match["link"] for match in FENCE_OR_LINK.finditer(text)]
    paths = [repository_path(here, link) for link in links if link and ":" not in link]
    return [path for path in dict.fromkeys(paths) if path.suffix == ".md"]


def outside_pages(index: str) -> list[PurePosixPath]:
    """Pages outside docs that the index links to, in their order."""
    # In the site the index is what README.md is in the repository.
    pages = [path for path in linked(INDEX, index) if str(path) != "README.md"]
    return [path for path in pages if not path.is_relative_to("docs")]


def repository_path(here: PurePosixPath, link: str) -> PurePosixPath:
    """Where a relative link of a file leads, from the root of the repository."""
    return PurePosixPath(os.path.normpath(here.parent / link.partition("#")[0]))


def site_path(path: PurePosixPath) -> str:
    """Where a file of the repository is in the site: docs is its root, other folders are below."""
    return str(path.relative_to("docs") if path.is_relative_to("docs") else path)


def relinked(
    markdown: str, here: PurePosixPath, pages: Collection[PurePosixPath], *, source: str | None = None
) -> str:
    """Return a page whose links stay inside the site.

    Parameters
    ----------
    markdown
        The page as it is in the repository.
    here
        Its path from the root of the repository.
    pages
        The pages outside docs that are in the site.
    source
        Address of the repository. Files that are not in the site are links below it; without one, text.
    """

    def change(match: re.Match[str]) -> str:
        text, link = match["text"], match["link"]
        if link is None or link.startswith("#") or re.match(r"[a-z]+:", link):
            return match.group()
        path = repository_path(here, link)
        if path.is_relative_to("docs") or path in pages:
            there = os.path.relpath(site_path(path), PurePosixPath(site_path(here)).parent)
            return f"{text}({there}{''.join(link.partition('#')[1:])})"
        if text.startswith("!") or not (ROOT / path).exists():
            log.warning("%s: %s is not there, or a picture outside docs", here, link)
        return f"{text}({source.rstrip('/')}/blob/HEAD/{path})" if source else named(text[1:-1], path, here)

    return FENCE_OR_LINK.sub(change, markdown)


def named(text: str, path: PurePosixPath, here: PurePosixPath) -> str:
    """What a link says and the file that it led to, as text; the file alone where its name says as much."""
    name = path.relative_to(here.parent) if path.is_relative_to(here.parent) else path
    return f"`{name}`" if text.strip("`") in str(path) else f"{text} (`{name}`)"


def with_wide_lists(markdown: str) -> str:
    """Return a page with lists as only MkDocs needs them: indented by four, with empty lines around them."""
    lines = markdown.split("\n")
    for token in FORGE.parse(markdown):
        first, last = token.map or (0, 0)
        if token.type == "list_item_open" and (marker := MARKER.match(lines[first])):
            missing = " " * (4 - len(marker[1]))
            for i in range(first + 1, last):
                lines[i] = missing + lines[i] if lines[i].strip() else lines[i]
            if "" in lines[first:last]:
                lines[last - 1] = lines[last - 1].rstrip("\n") + "\n"
        elif token.type.endswith("list_open") and token.level == 0 and first and lines[first - 1].strip():
            lines[first - 1] += "\n"
        elif token.type == "paragraph_open":
            # A number that a wrapped line begins with begins no list.
            for i in range(first + 1, last):
                lines[i] = re.sub(r"^( *\d+)\.", r"\1\\.", lines[i])
    return "\n".join(lines)


def with_bars(html: str) -> str:
    """Return a page without the backslashes that bars need in the code of a table, and only there."""
    return CELL.sub(lambda cell: cell.group().replace("\\|", "|"), html)


def elements(html: str) -> Counter[str]:
    """How often each element is in a text."""
    return Counter(re.findall(r"<([a-z]+[1-6]?)\b", html))


def fetched_elsewhere(text: str) -> list[str]:
    """Addresses on other hosts that a page or a style sheet makes a browser fetch."""
    return [first or second for first, second in LOADED.findall(text)]
