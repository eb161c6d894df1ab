"""The look of programs: plain text in a pipe, style and folded cells on a terminal."""

import io
import os
import re
import time

import numpy as np
import pytest

from taichi_dem.kit import terminal
from taichi_dem.kit.study import look
from taichi_dem.kit.study.entries import Entry
from tests.terminal import without_orders

HEADER = ["figure", "value", "unit"]
ROWS = [
    ("a_name_of_a_figure_that_is_rather_long_and_has_no_spaces", "1.5", "mm"),
    ("[bold]no markup[/bold]", None, "m/s"),
    ("a sentence of some words that goes on and on", "not found", ""),
]


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    encoding = "utf-8"

    def isatty(self):
        return True


@pytest.fixture
def shown(monkeypatch):
    """``shown(columns)``: a terminal on standard output."""

    def make(columns, term="xterm-256color"):
        stream = Terminal()
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("TERM", term)
        monkeypatch.delenv("NO_COLOR", raising=False)
        monkeypatch.setattr("sys.stdout", stream)
        return stream

    return make


def letters(text):
    return re.sub(r"\s", "", text)


def cells_of(text, header):
    """Columns of a printed table as text without blanks, by where their names begin."""
    lines = text.splitlines()
    starts = [lines[0].index(name) for name in header]
    ends = [*starts[1:], None]
    return [letters("".join(line[a:b] for line in lines)) for a, b in zip(starts, ends)]


@pytest.mark.parametrize("columns", [40, 60, 120])
def test_a_table_fits_its_terminal_and_loses_nothing(shown, columns):
    stream = shown(columns)
    terminal.print_table(ROWS, HEADER)
    text = without_orders(stream.getvalue())
    assert "\x1b[1m" in stream.getvalue()
    assert max(map(len, text.splitlines())) <= columns
    for k, column in enumerate(cells_of(text, HEADER)):
        assert column == letters("".join([HEADER[k], *(str(row[k] or "-") for row in ROWS)]))


@pytest.mark.parametrize("columns", [30, 60, 80])
@pytest.mark.parametrize("seed", range(5))
def test_words_of_a_table_stay_whole_and_further_columns_have_tables_of_their_own(
    shown, columns, seed
):
    """Of any table whose words take less than half a line; each row is there once a table."""
    random = np.random.default_rng(seed)

    def cell(k):
        return " ".join("x" * n + str(k) for n in random.integers(1, columns // 2 - 2, 2))

    header = [f"name{k}" for k in range(random.integers(2, 12))]
    rows = [[f"first{i}", *(cell(k) for k in range(1, len(header)))] for i in range(4)]
    stream = shown(columns)
    terminal.print_table(rows, header)
    lines = without_orders(stream.getvalue()).splitlines()
    assert max(map(len, lines)) <= columns
    words = " ".join(lines).split()
    tables = words.count("name0")
    wanted = [word for row in (header, *rows) for cell in row[1:] for word in cell.split()]
    firsts = ["name0", *(row[0] for row in rows)]
    assert sorted(words) == sorted(wanted + tables * firsts)
    assert tables == 1 + lines.count("")


@pytest.mark.parametrize("columns", [40, 120])
def test_a_terminal_without_style_has_the_table_of_a_pipe(shown, capsys, columns):
    terminal.print_table(ROWS, HEADER)
    terminal.show_heading("[b]")
    piped = capsys.readouterr().out
    stream = shown(columns, term="dumb")
    terminal.print_table(ROWS, HEADER)
    terminal.show_heading("[b]")
    assert stream.getvalue() == piped and "\x1b" not in piped


@pytest.mark.parametrize("columns", [50, 120])
def test_names_stay_whole_and_their_lines_fit(shown, columns):
    stream, long = shown(columns), "x." * 40 + "end"
    rows = [("short.name", "What it does, in some more words than fit."), (long, "")]
    terminal.show_names("Title", rows)
    terminal.show_names("None", [])
    lines = without_orders(stream.getvalue()).splitlines()
    assert lines[:2] == ["", "Title"] and "None" not in lines
    assert long in [line.strip() for line in lines]
    assert letters(rows[0][1]) in letters("".join(lines))
    assert all(len(line) <= columns for line in lines if long not in line)


def test_a_paragraph_is_as_wide_as_the_terminal_but_no_wider_than_a_page(shown, capsys):
    words = "some words " * 40
    for columns, widest in ((60, 60), (200, 100)):
        stream = shown(columns)
        terminal.show_paragraph(words)
        assert widest - 6 < max(map(len, stream.getvalue().splitlines())) <= widest


def entry(**fields):
    texts = {"name": "x", "part": "", "question": "Why?", "look": ""}
    times = {"time": "15 s", "quick": "9 s"}
    return Entry(**{**texts, **times, "pictures": ("b.png", "a.gif"), **fields})


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ("15 s", "about 15 s on two cores; with --quick 9 s.\n"),
        ("about 6 min", "about 6 min on two cores; with --quick 9 s.\n"),
        ("5 min on one", "about 5 min on one core; with --quick 9 s.\n"),
    ],
)
def test_the_time_to_expect_is_a_sentence(capsys, time, words):
    look.show_opening("ignored", entry(time=time))
    said = capsys.readouterr().out
    assert said.startswith("Why?\n") and words in said
    look.show_opening("ignored", entry(time=time), quick=True)
    assert capsys.readouterr().out == "Why?\nTakes about 9 s on two cores.\n\n"
    look.show_opening("First line.\n\nMore.", None)
    assert capsys.readouterr().out == "First line.\n"


def test_key_figures_are_shown_the_papers_first_and_the_others_are_counted(capsys):
    figures = {f"k{n}": look_figure(None) for n in range(20)}
    figures.update(peak=look_figure(None), speed=look_figure(2.0))
    look.print_figures(figures, entry(figures=("peak",)))
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["figure", "speed", "peak", "and"]
    assert lines[-1] == "and 20 more in summary.json"
    # Without a key figure, the first dozen.
    look.print_figures({name: figures[name] for name in list(figures)[:20]}, entry())
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + 12 + 1 and lines[1].split()[0] == "k0"


def look_figure(paper):
    return {"value": 1.5, "unit": "m", "paper": paper}


def test_pictures_are_listed_the_most_telling_first_and_old_ones_not(tmp_path, capsys):
    for name in ("a.gif", "b.png", "c.png", "old.png", "d.csv", ".hidden.png"):
        (tmp_path / name).write_bytes(b"x")
    os.utime(tmp_path / "old.png", (1.0, 1.0))
    look.show_files(str(tmp_path), time.time(), ("", *entry().pictures))
    lines = capsys.readouterr().out.splitlines()
    paths = [f"  {tmp_path / name}" for name in ("b.png", "a.gif", "c.png")]
    assert lines == ["", "Pictures", *paths, f"Tables and all figures are in {tmp_path}"]
