"""The site: pages of the repository, of the API and of the gallery, with one frame around each.

Static files that need neither a server nor a network; the same bytes from the same sources.
"""

import json
import os
import re
import shutil
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

from jinja2 import Environment, FileSystemLoader

from docs.site.api import api_pages
from docs.site.gallery import gallery_page
from docs.site.markdown import STYLE, plain_text, rendered
from taichi_dem import InputError
from taichi_dem.kit.version import __version__

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CONTENTS = HERE / "contents.txt"
#: Lines of the list that stand for pages which are not files.
MADE = ("gallery", "api")
#: Files of the frame that are copied as they are.
FRAME = ("style.css", "search.js")


class Part(NamedTuple):
    """A part of the list of pages: its heading, and (name of the file, Page) of each page."""

    heading: str
    pages: list


def contents():
    """(heading, lines) of each part of the list, with the pages that it leaves out at the end."""
    parts = []
    for line in CONTENTS.read_text(encoding="utf-8").splitlines():
        if line.startswith("# "):
            parts.append((line[2:], []))
        elif line and parts:
            parts[-1][1].extend(fitting(line))
    listed = {line for _, lines in parts for line in lines}
    there = sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))
    more = [name for name in there if name not in listed]
    return [*parts, ("More pages", more)] if more else parts


def fitting(line):
    """The line itself, or the pages that it fits where it has a star."""
    if "*" not in line:
        return [line]
    return sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob(line))


def file_of(path):
    """Name of the page of a Markdown file: the first page is the index."""
    return "index.html" if path == "README.md" else f"{PurePosixPath(path).stem.lower()}.html"


def parts_of_site():
    """All parts with their pages."""
    listed = contents()
    names = {path: file_of(path) for _, lines in listed for path in lines if path not in MADE}
    found = []
    for heading, lines in listed:
        pages = []
        for line in lines:
            if line == "api":
                pages += api_pages()
            elif line == "gallery":
                pages.append(("gallery.html", gallery_page(ROOT)))
            else:
                text = (ROOT / line).read_text(encoding="utf-8")
                pages.append((names[line], rendered(line, text, names)))
        found.append(Part(heading, pages))
    return found


def build(folder):
    """Write the site to a folder, which is emptied before; InputError for a link that is broken."""
    folder = Path(folder)
    _cleared(folder)
    parts = parts_of_site()
    options = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    template = Environment(loader=FileSystemLoader(HERE), **options).get_template("page.html")
    for part in parts:
        for name, page in part.pages:
            made = template.render(page=page, name=name, parts=parts, version=__version__)
            (folder / name).write_text(made, encoding="utf-8")
            for path in page.files:
                target = folder / "files" / path
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / path, target)
    for name in FRAME:
        shutil.copyfile(HERE / name, folder / name)
    with open(folder / "style.css", "a", encoding="utf-8") as file:
        file.write(f"\n/* Colours of code. */\n{STYLE}\n")
    (folder / "search_index.js").write_text(search_index(parts), encoding="utf-8")
    broken = broken_links(folder)
    if broken:
        raise InputError(f"{len(broken)} links of the site lead nowhere: {'; '.join(broken[:5])}")
    return folder / "index.html"


def _cleared(folder):
    """Empty a folder of an earlier site; InputError for one with files of another kind."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "search_index.js").is_file():
        raise InputError(f"folder must be new, empty or that of an earlier site, got {folder}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)


def search_index(parts):
    """Script with the titles, headings and words of all pages."""
    rows = []
    for part in parts:
        for name, page in part.pages:
            headings = [[heading.text, heading.anchor] for heading in page.headings]
            words = sorted(set(re.findall(r"[a-z_][a-z_0-9]+", plain_text(page.content).lower())))
            rows.append([name, page.title, headings, " ".join(words)])
    text = json.dumps(rows, ensure_ascii=False, separators=(",", ":"))
    return f"const PAGES = {text};\n"


def broken_links(folder):
    """Links of pages to files, or to places in pages, that are not there."""
    folder = Path(folder)
    texts = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.html"))}
    places = {name: set(re.findall(r'\bid="([^"]+)"', text)) for name, text in texts.items()}
    found = []
    for name, text in texts.items():
        for link in re.findall(r'\b(?:href|src)="([^"]+)"', text):
            parts = urlsplit(link.replace("&amp;", "&"))
            if parts.scheme:
                continue
            target = unquote(parts.path) or name
            known = places.get(target)
            missing = not (folder / target).is_file()
            if missing or (
                parts.fragment and known is not None and unquote(parts.fragment) not in known
            ):
                found.append(f"{name} links to {link}")
    return found
