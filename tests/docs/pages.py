"""What tests read out of the pages: code blocks, links, and what a block leaves behind."""

import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from markdown_it import MarkdownIt

from tests.processes import users_environment
from tests.scenes import ROOT

FOLDER = Path(ROOT)
PAGES = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "RELEASE.md")
PAGES += tuple(sorted(f"docs/{path.name}" for path in (FOLDER / "docs").glob("*.md")))


def tokens(page):
    """All tokens of a page, those inside of lines too."""
    for token in MarkdownIt("gfm-like", {"linkify": False}).parse(
        (FOLDER / page).read_text(encoding="utf-8")
    ):
        yield token
        yield from token.children or ()


def blocks(page):
    """Python blocks of a page, in order, under whatever name the language goes."""
    fences = [token for token in tokens(page) if token.type == "fence"]
    return [token.content for token in fences if token.info.strip().lower().startswith("py")]


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


class Program(NamedTuple):
    """A block that has run: the folder with its files, what it printed, and what was wanted."""

    folder: Path
    said: str
    left: object


#: Runs a file as Python does, and keeps the value that an expression has at its end.
_RUNNER = """
import pickle, runpy, sys
left = runpy.run_path("pasted.py", run_name="__main__")
with open("left.pickle", "wb") as file:
    pickle.dump(eval(sys.argv[1], left), file)
"""


def run_pasted(text, folder, wanted="None"):
    """Run a block as a user does: as it stands, in a file in a folder, by a process of its own.

    wanted: expression of names that the program leaves, whose value tests look at.
    """
    (folder / "pasted.py").write_text(text, encoding="utf-8")
    line = [sys.executable, "-c", _RUNNER, wanted]
    options = {"capture_output": True, "text": True, "timeout": 600}
    done = subprocess.run(line, cwd=folder, env=users_environment(), **options)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return Program(folder, done.stdout, pickle.loads((folder / "left.pickle").read_bytes()))
