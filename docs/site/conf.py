"""Configuration of the site: all pages, the API and the gallery, for reading offline.

``make docs`` builds it with Sphinx into results/docs; pages are the Markdown files of the
repository, and docstrings are in NumPy style.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from taichi_dem.kit.study.entries import read_entries  # noqa: E402
from taichi_dem.kit.version import __version__  # noqa: E402

project, version, release = "taichi-dem", __version__, __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx.ext.mathjax"]
root_doc = "README"
include_patterns = ["*.md", "docs/*.md", "docs/decisions/*.md", "docs/site/*.md"]
html_theme = "furo"
html_title = "taichi-dem"
html_copy_source = False
html_show_sphinx = False
# ARCHITECTURE.md draws its layers in mermaid, which stays text here.
suppress_warnings = ["misc.highlighting_failure"]
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

#: Parts of the list of pages. A page that no part names comes under "More".
CONTENTS = {
    "Start": ["docs/tutorial", "docs/experiments", "docs/site/gallery"],
    "Guide": [
        "docs/guide",
        "docs/sweeps",
        "docs/accuracy",
        "docs/effects_auto",
        "docs/material",
        "docs/boundaries",
        "docs/strength_tests",
        "docs/tunnel",
        "docs/damper_engineering",
        "docs/measured_bracket",
        "docs/results",
        "docs/units",
        "docs/gpu",
        "docs/bench",
        "docs/limits",
    ],
    "How to add": ["docs/add_*"],
    "Papers and trust": [
        "docs/papers",
        "docs/trust",
        "docs/damper_validity",
        "docs/hard_cases",
    ],
    "API": ["docs/site/taichi_dem", "docs/site/ca_damper"],
    "Development": ["ARCHITECTURE", "CONTRIBUTING", "RELEASE", "CHANGELOG"],
    "Decisions": ["docs/decisions/README", "docs/decisions/0*"],
}


def contents():
    """The list of pages as hidden tables of contents, which the frame of each page shows."""
    for part, pages in CONTENTS.items():
        lines = "\n".join(f"/{page}" for page in pages)
        yield f"```{{toctree}}\n:caption: {part}\n:hidden:\n:glob:\n\n{lines}\n```\n"


def experiments():
    """Each experiment with its question, picture, command and what to see."""
    for entry in read_entries(ROOT / "experiments/_gallery_pages.txt"):
        picture = f"![](/docs/pictures/{entry.name}.png)"
        paper = f"In the paper: {entry.paper}" if entry.paper else ""
        how = f"`{entry.command}`, {entry.expected_time(quick=False)}\n"
        yield "\n\n".join(filter(None, (f"## {entry.question}", picture, entry.look, paper, how)))


def with_lists(app, name, source):
    """Add what is listed elsewhere: the pages to the first one, experiments to the gallery."""
    if name == root_doc:
        # A link of Markdown to a file would lead to a copy beside no page.
        source[0] = re.sub(r"\[([^][]+)\]\((docs/live/.*?)\)", r'<a href="\2">\1</a>', source[0])
        source[0] += "\n".join(contents())
    if name == "docs/site/gallery":
        source[0] += "\n".join(experiments())


def setup(app):
    """Connect what completes the pages, and give the first one the name that a browser opens."""
    app.connect("source-read", with_lists)
    app.connect("build-finished", lambda app, error: error or add_files(Path(app.outdir)))


def add_files(folder):
    """A first page that leads on to the README, and the live pages, with links to these pages."""
    leads = '<meta http-equiv="refresh" content="0; url=README.html">'
    (folder / "index.html").write_text(leads, encoding="utf-8")
    (folder / "docs/live").mkdir(exist_ok=True)
    for page in (ROOT / "docs/live").glob("*.html"):
        text = page.read_text(encoding="utf-8").replace('.md">', '.html">')
        (folder / "docs/live" / page.name).write_text(text, encoding="utf-8")
