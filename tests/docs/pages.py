"""What tests read out of the pages: code blocks, links, and what a block leaves behind."""

import runpy
from pathlib import Path

from markdown_it import MarkdownIt

from tests.scenes import ROOT

FOLDER = Path(ROOT)
PAGES = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")
PAGES += tuple(sorted(f"docs/{path.name}" for path in (FOLDER / "docs").glob("*.md")))


def tokens(page):
    """All tokens of a page, those inside of lines too."""
    for token in MarkdownIt("gfm-like", {"linkify": False}).parse(
        (FOLDER / page).read_text(encoding="utf-8")
    ):
        yield token
        yield from token.children or ()


def blocks(page, language="python"):
    """Code blocks of a page in a language, in order."""
    return [t.content for t in tokens(page) if t.type == "fence" and t.info == language]


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


def run_block(text, folder):
    """Run a block as a script in a folder; returns the names it leaves."""
    script = folder / "block.py"
    script.write_text(text, encoding="utf-8")
    return runpy.run_path(str(script), run_name="block")
