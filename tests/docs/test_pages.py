"""Pages keep their word: links lead on, names, files, commands and figures are those there are."""

import ast
import importlib
import itertools
import re
import shlex
import subprocess
import sys
from urllib.parse import unquote, urlsplit

import pytest

from docs.site.conf import CONTENTS
from gallery import fill_figures, list_of_experiments, sentences_of
from tests.docs.pages import FOLDER, PAGES, anchors, headings, links, text_of, tokens, words

PACKAGES = ("taichi_dem.", "ca_damper.")
PAPERS = {"The blast": {"eq": 4, "Fig": 15}, "The damper": {"eq": 11, "Fig": 12}}
#: What the history of the project says is no command, file or figure of today.
READ = [page for page in PAGES if page != "CHANGELOG.md"]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    for link in links(page):
        parts = urlsplit(link)
        if parts.scheme:
            assert parts.scheme == "https", link
            continue
        target = (FOLDER / page).parent / unquote(parts.path) if parts.path else FOLDER / page
        assert target.exists(), f"{page} links to {link}"
        if parts.fragment and target.suffix == ".md":
            assert parts.fragment in anchors(target.relative_to(FOLDER).as_posix()), link


def found(name):
    """What a dotted name stands for; an error where a part of it is not there."""
    parts = name.split(".")
    thing, path = importlib.import_module(parts[0]), parts[0]
    for part in parts[1:]:
        path += f".{part}"
        fields = getattr(thing, "__dataclass_fields__", {})
        if hasattr(thing, part):
            thing = getattr(thing, part)
        else:
            thing = fields[part] if part in fields else importlib.import_module(path)
    return thing


@pytest.mark.parametrize("page", READ)
def test_names_and_files_exist(page):
    roots = "|".join(("taichi_dem", "ca_damper", "experiments", "tests", "docs"))
    for word in words(page):
        if word.startswith(PACKAGES) and re.fullmatch(r"[\w.]+", word):
            found(word)
        path = re.match(rf"(?:python )?((?:{roots})/[\w/.]+)", word)
        if path and "NAME" not in word:
            assert (FOLDER / path[1]).exists(), f"{page} names {path[1]}"


#: Names of other libraries in docstrings.
OTHERS = re.compile(r"(dask|scipy|Axes|Figure|Artist)\.")


def docstrings():
    """(Source file, docstring) of every module, class and function of both packages."""
    for path in sorted(path for name in PACKAGES for path in (FOLDER / name[:-1]).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                yield path, ast.get_docstring(node) or ""


def test_dotted_names_in_docstrings_stand_for_something():
    """Each is written so in some source, or is a member of a class, an object or a module."""
    sources = {path: path.read_text(encoding="utf-8") for path, _ in docstrings()}
    used = re.sub(r'""".*?"""', "", "\n".join(sources.values()), flags=re.DOTALL)
    defined = {(path.parent.name, path.stem) for path in sources}
    for path, text in sources.items():
        package = path.stem == "__init__"
        words = re.findall(r"\w+" if package else r"^(?:def |class )?(\w+)", text, re.MULTILINE)
        defined |= {(path.parent.name if package else path.stem, name) for name in words}
    for node in (node for text in sources.values() for node in ast.walk(ast.parse(text))):
        if isinstance(node, ast.ClassDef):
            members = re.findall(r"\w+", ast.unparse(node))
            defined |= {(k, name) for k in (node.name, node.name.lower()) for name in members}
    files = {path.name for path in FOLDER.rglob("*.py")}
    for path, text in docstrings():
        for name in re.findall(r"``([a-zA-Z_]\w*(?:\.\w+)+)``", text):
            if name in files or OTHERS.match(name):
                continue
            for pair in itertools.pairwise(name.split(".")):
                assert pair in defined or ".".join(pair) in used, f"{path} names {name}"


def commands():
    """Words of each line for make and for a script of the experiments."""
    for page in READ:
        for token in tokens(page):
            shown = token.type == "fence" and token.info.strip() in ("", "sh")
            for line in token.content.splitlines() if shown or token.type == "code_inline" else ():
                if re.match(r"make .|\.venv/bin/python experiments/", line) and "NAME" not in line:
                    yield tuple(shlex.split(line, comments=True))


@pytest.mark.parametrize("command", sorted(set(commands())), ids=" ".join)
def test_a_command_names_a_target_or_a_script_with_options_that_there_are(command):
    program, *given = command
    if program == "make":
        subprocess.run(["make", "-n", *given], cwd=FOLDER, capture_output=True, check=True)
        return
    script = FOLDER / given[0]
    module = importlib.import_module(script.stem)
    assert script.is_file()
    if hasattr(module, "options_parser"):
        module.options_parser().parse_args(given[1:])
    else:
        assert all(word in script.read_text(encoding="utf-8") for word in given[1:2])


def test_every_equation_and_figure_of_the_papers_is_on_the_page():
    heading, titles, cells = "", dict(headings("docs/papers.md")), {}
    for number, token in enumerate(tokens("docs/papers.md")):
        heading = titles.get(number, heading)
        if token.type == "inline":
            cells[heading] = f"{cells.get(heading, '')} {token.content}"
    for heading, counts in PAPERS.items():
        for kind, count in counts.items():
            there = {int(number) for number in re.findall(rf"{kind}\. (\d+)", cells[heading])}
            assert there >= set(range(1, count + 1)), (heading, kind)


#: Pages whose measured figures in these units all come from kept figures.
WHOLE = {"README.md": "s|kJ|MB|times", "docs/limits.md": "kJ|MB|times"}


@pytest.mark.parametrize("page", READ)
def test_figures_are_those_kept_of_full_runs(page):
    text = text_of(page)
    assert fill_figures(page, FOLDER) == text, "renew them: experiments/gallery.py --readme"
    for pattern, _ in sentences_of(page, FOLDER):
        text = re.sub(pattern, "", text)
    # Tables and blocks apart: their times are those of the gallery's texts.
    text = re.sub(r"```.*?```|^ *\|.*?$", "", text, flags=re.DOTALL | re.M)
    typed = rf"[^\n]*\d (?:{WHOLE[page]})\b[^\n]*" if page in WHOLE else "(?!)"
    assert not re.findall(typed, text)


def test_the_list_of_experiments_is_that_of_the_gallery():
    listed = list_of_experiments()
    assert listed in text_of("docs/experiments.md"), "renew it: experiments/gallery.py --readme"


def test_the_site_lists_every_page_once():
    """The first page is the README, which has the list."""
    fits = [sorted(FOLDER.glob(f"{name}.md")) for names in CONTENTS.values() for name in names]
    listed = [path.relative_to(FOLDER).as_posix() for paths in fits for path in paths]
    assert sorted(page for page in listed if "docs/site" not in page) == sorted(
        {*PAGES} - {"README.md"}
    )


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    """Of a link that leads nowhere, a page that no list has, or a docstring that is no RST."""
    pytest.importorskip("sphinx")
    options = ("-q", "-W", "-c", "docs/site", ".", tmp_path)
    subprocess.run([sys.executable, "-m", "sphinx", *options], cwd=FOLDER, check=True)
