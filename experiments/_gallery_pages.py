"""Texts of the gallery and the first page: one entry an experiment.

A new experiment gets an entry in _gallery_pages.txt; ``gallery.py --readme`` then renews the table
of README.md.
"""

import re
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
#: Scripts that are no experiment of their own, and why.
TOOLS = {
    "bench": "measures speed, `make bench`",
    "gallery": "builds the page",
    "make_meshes": "makes the meshes, `make mesh`",
}
SMALL_PICTURES = "docs/pictures"


@dataclass(frozen=True)
class Page:
    """Description of one experiment.

    name: of the script. part: heading under which it stands. question: that it answers. look:
    what to read off its pictures. time: of the full run on two cores, in words. pictures: names
    of its pictures and films, the most telling first; what else it writes is linked. figures:
    patterns of the key figures in summary.json; figures with a paper's value are always shown.
    paper: what the paper says of it, empty where it does not ask this. options: of the command.
    """

    name: str
    part: str
    question: str
    look: str
    time: str
    pictures: tuple
    figures: tuple = ()
    paper: str = ""
    options: str = ""

    @property
    def command(self):
        """Command line of a user."""
        return " ".join(filter(None, [f"python experiments/{self.name}.py", self.options]))


def read_pages(path):
    """Entries of a text file: "# part", "## name", and lines "field: text", indented to go on."""
    part, found = "", []
    for block in Path(path).read_text(encoding="utf-8").split("\n\n"):
        head, *lines = re.sub(r"\n  +", " ", block).strip().split("\n")
        if head.startswith("# "):
            part = head[2:]
        elif head.startswith("## "):
            fields = dict(line.split(": ", 1) for line in lines)
            words = {name: tuple(fields.get(name, "").split()) for name in ("pictures", "figures")}
            found.append(Page(name=head[3:], part=part, **{**fields, **words}))
    return tuple(found)


PAGES = read_pages(HERE / "_gallery_pages.txt")


def pages():
    """The entries whose script is there, in order."""
    return tuple(page for page in PAGES if (HERE / f"{page.name}.py").is_file())


def readme_table():
    """The table of all experiments for README.md, with a small picture where there is one."""
    lines = ["| question | command | time on two cores | picture |", "|---|---|---|---|"]
    for page in pages():
        small = f"{SMALL_PICTURES}/{page.name}.png"
        there = (HERE.parent / small).is_file()
        link = f"[picture]({small})" if there else ""
        lines.append(f"| {page.question} | `{page.command}` | {page.time} | {link} |")
    return "\n".join(lines) + "\n"
