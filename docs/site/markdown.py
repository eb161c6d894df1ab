"""Markdown pages as HTML: anchors of headings, colours of code, links to pages of the site."""

import html
import re
from pathlib import PurePosixPath
from typing import NamedTuple
from urllib.parse import quote, unquote, urlsplit

from markdown_it import MarkdownIt
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound

#: Words for code that has no lexer of its own name.
_ALIASES = {"sh": "bash", "text": "text", "": "text", "mermaid": "text"}
STYLE = HtmlFormatter(style="friendly").get_style_defs(".code")


class Heading(NamedTuple):
    """Heading of a page: its level, its text without marks, and the anchor to link it by."""

    level: int
    text: str
    anchor: str


class Page(NamedTuple):
    """A page: title, HTML of its content, headings below the title, and files that it shows."""

    title: str
    content: str
    headings: tuple
    files: tuple


def anchor_of(text):
    """Anchor of a heading, as code hosts make it."""
    return re.sub(r"[^\w\- ]", "", text).strip().lower().replace(" ", "-")


def coloured(code, language):
    """Code as HTML; text of a language that is not known stays as it is."""
    try:
        lexer = get_lexer_by_name(_ALIASES.get(language, language))
    except ClassNotFound:
        lexer = get_lexer_by_name("text")
    return highlight(code, lexer, HtmlFormatter(cssclass="code", wrapcode=True))


def inline(text):
    """One line of text with code, links and emphasis, as HTML."""
    return _parser().renderInline(text)


def block(text):
    """Paragraphs and lists of a docstring as HTML; what is indented is code."""
    return _parser().render(text)


def _parser():
    made = MarkdownIt("gfm-like", {"linkify": False})
    made.add_render_rule("fence", _fence)
    made.add_render_rule("table_open", lambda *_: '<div class="wide"><table>\n')
    made.add_render_rule("table_close", lambda *_: "</table></div>\n")
    return made


def _fence(_, tokens, k, *__):
    language = tokens[k].info.split()[:1]
    return coloured(tokens[k].content, language[0].lower() if language else "")


def rendered(path, text, pages):
    """Page of a file of the repository.

    path: of the file from the root. pages: names of the site's pages by the paths they are made of.
    """
    made, files = _parser(), []
    tokens = made.parse(text)
    headings = []
    for k, token in enumerate(tokens):
        for part in (token, *(token.children or ())):
            for key in ("href", "src"):
                if part.attrGet(key):
                    part.attrSet(key, _led(path, part.attrGet(key), pages, files))
            if part.type == "image":
                part.attrSet("loading", "lazy")
        if token.type == "heading_open":
            words = "".join(part.content for part in tokens[k + 1].children)
            heading = Heading(int(token.tag[1]), words, anchor_of(tokens[k + 1].content))
            token.attrSet("id", heading.anchor)
            headings.append(heading)
    content = made.renderer.render(tokens, made.options, {})
    title = headings[0].text if headings else PurePosixPath(path).stem
    return Page(title, content, tuple(headings[1:]), tuple(files))


def _led(path, link, pages, files):
    """Where a link of a page leads on the site; files that are no pages are noted to be copied."""
    parts = urlsplit(link)
    if parts.scheme or not parts.path:
        return link
    target = _joined(PurePosixPath(path).parent, unquote(parts.path))
    end = f"#{parts.fragment}" if parts.fragment else ""
    if target in pages:
        return pages[target] + end
    files.append(target)
    return quote(f"files/{target}") + end


def _joined(folder, link):
    """A relative link from a folder as a path from the root."""
    found = []
    for part in (folder / link).parts:
        if part == "..":
            found.pop()
        elif part != ".":
            found.append(part)
    return "/".join(found)


def plain_text(content):
    """Words of HTML without marks, for the search."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", content)).split())
