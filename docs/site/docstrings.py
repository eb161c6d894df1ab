"""Docstrings in NumPy style, taken apart: summary, text, and sections as rows or paragraphs."""

import inspect
import re
from typing import NamedTuple

#: Sections that list items, "name : type" or a type alone, each with an indented description.
LISTS = ("Parameters", "Attributes", "Returns", "Yields", "Raises")
TEXTS = ("See Also", "Notes", "References", "Examples")


class Item(NamedTuple):
    """Entry of a section: name (empty in Returns), type (empty in Raises), and what it means."""

    name: str
    type: str
    text: str


class Docstring(NamedTuple):
    """Parts of a docstring; lists and texts by the name of their section."""

    summary: str
    body: str
    lists: dict
    texts: dict

    def names(self, section):
        """Names of the items of a section, in order."""
        return [item.name for item in self.lists.get(section, ())]


def parsed(text):
    """Docstring of its text, indented or not."""
    lines = inspect.cleandoc(text).split("\n")
    heads = [k for k in range(len(lines) - 1) if is_head(lines, k)]
    ends = [*heads[1:], len(lines)]
    before = "\n".join(lines[: heads[0] if heads else len(lines)])
    summary, _, body = before.partition("\n\n")
    lists, texts = {}, {}
    for start, end in zip(heads, ends):
        name, content = lines[start].strip(), lines[start + 2 : end]
        if name in LISTS:
            lists[name] = items(name, content)
        else:
            texts[name] = "\n".join(content).strip("\n")
    return Docstring(" ".join(summary.split()), body.strip("\n"), lists, texts)


def is_head(lines, k):
    """Whether a section begins at line k: a word, underlined as long as it is."""
    name = lines[k].strip()
    return bool(name) and bool(re.fullmatch(r"-{3,}", lines[k + 1])) and lines[k][0] != " "


def items(section, content):
    """Items of a list: lines that are not indented begin one."""
    found = []
    for line in content:
        if line and line[0] != " ":
            found.append([line.strip(), []])
        elif found:
            found[-1][1].append(line.strip())
    return [item(section, head, " ".join(filter(None, text))) for head, text in found]


def item(section, head, text):
    """An Item of its first line and its description."""
    name, _, kind = (part.strip() for part in head.partition(" : "))
    if section in ("Returns", "Yields") and not kind:
        name, kind = "", name
    return Item(name, kind, text)
