"""What tests read out of the pages: code blocks, links, headings and names."""

import re
from pathlib import Path

from markdown_it import MarkdownIt

from tests.scenes import ROOT

FOLDER = Path(ROOT)
PAGES = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "RELEASE.md")
for _pattern in ("docs/*.md", "docs/decisions/*.md"):
    PAGES += tuple(sorted(path.relative_to(FOLDER).as_posix() for path in FOLDER.glob(_pattern)))


def text_of(page):
    """A page as it stands."""
    return (FOLDER / page).read_text(encoding="utf-8")


def tokens(page):
    """All tokens of a page, those inside of lines too."""
    for token in MarkdownIt("gfm-like", {"linkify": False}).parse(text_of(page)):
        yield token
        yield from token.children or ()


def blocks(page):
    """Python blocks of a page, in order, under whatever name the language goes."""
    fences = [token for token in tokens(page) if token.type == "fence"]
    return [token.content for token in fences if token.info.strip().lower().startswith("py")]


def lines(page):
    """Commands in the shell blocks of a page, in order."""
    fences = [token for token in tokens(page) if token.type == "fence" and token.info == "sh"]
    return [line for fence in fences for line in fence.content.splitlines() if line]


def links(page):
    """What a page links to and shows."""
    for token in tokens(page):
        for key in ("href", "src"):
            if token.attrGet(key):
                yield token.attrGet(key)


def words(page):
    """What stands between single backquotes, in order."""
    return [token.content for token in tokens(page) if token.type == "code_inline"]


def headings(page):
    """(Place among the tokens, text) of every heading of a page."""
    everything = list(tokens(page))
    for number, token in enumerate(everything):
        if token.type == "heading_open":
            yield number + 1, everything[number + 1].content


def anchors(page):
    """Names that a page's headings can be linked by."""
    made = set()
    for _, text in headings(page):
        made.add(re.sub(r"[^\w\- ]", "", text).strip().lower().replace(" ", "-"))
    return made
