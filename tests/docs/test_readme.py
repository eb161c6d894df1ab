"""The first page: its scenes run as they stand, its table and its pictures are those there are."""

import csv
import re
from pathlib import Path

import meshio
import pytest

from _gallery_pages import SMALL_PICTURES, readme_table
from gallery import renew_readme
from taichi_dem import runtime
from tests.docs.pages import FOLDER, PAGES, blocks, links, run_block, words
from tests.scenes import ROOT

README = FOLDER / "README.md"
MOST_LINES = 20
MOST_BYTES = 3_000_000


@pytest.fixture
def left_by(tmp_path, monkeypatch):
    """``left_by(k)``: names that the k-th Python block of the page leaves, run in a folder."""

    def run(k):
        runtime.stop()
        (tmp_path / "experiments").symlink_to(Path(ROOT) / "experiments")
        monkeypatch.chdir(tmp_path)
        return run_block(blocks("README.md")[k], tmp_path)

    return run


def test_the_scenes_are_short():
    """Two scenes, and the long run, which tests/equivalence/test_restart.py runs in its way."""
    assert [len(text.splitlines()) <= MOST_LINES for text in blocks("README.md")] == [True] * 3


def test_the_blast_runs_and_leaves_what_the_page_says(left_by, tmp_path):
    report = left_by(0)["result"].report
    assert report.broken_faces > 0 and not report.needs
    mine = tmp_path / "results" / "mine"
    for name in ("history.csv", "bonds.csv", "mesh.msh", "report.json", "paraview/mine.pvd"):
        assert (mine / name).is_file(), name
    # The cell values that docs/paraview.md lists are those of the last snapshot.
    last = meshio.read(sorted((mine / "paraview").glob("*.vtu"))[-1])
    page = words("docs/paraview.md")
    assert len(last.cell_data) == 6
    assert all(name in page for name in last.cell_data)


def test_the_damper_runs_and_both_fillings_agree(left_by, tmp_path):
    """30 grains of 0.2 g pull the peak down as a rigid mass does: sqrt(86 / 92) f0 = 0.967.

    Within the 0.01 by which the ratios are apart.
    """
    left = left_by(1)
    assert left["filling"].label == "dem"
    assert left["ratio"][0, 0] == pytest.approx((86.0 / 92.0) ** 0.5, abs=0.01)
    for label in ("dem", "ca_static"):
        with open(tmp_path / f"{label}.csv", newline="") as rows:
            assert len(list(csv.DictReader(rows))) == 4


def test_the_table_is_that_of_the_gallery():
    text = README.read_text(encoding="utf-8")
    assert readme_table() in text, "renew it: python experiments/gallery.py --readme"


def test_renewing_writes_the_table_and_shows_what_is_there(tmp_path):
    """A picture that is there leaves its comment; the rest stays, and once is enough."""
    (tmp_path / "there.png").touch()
    places = "<!-- ![One](there.png) -->\n<!-- ![Two](not_there.png) -->\n"
    page = tmp_path / "README.md"
    page.write_text(f"Before\n\n| question | old |\n|---|---|\n| a | b |\n\nAfter\n{places}")
    for _ in range(2):
        renew_readme(tmp_path)
        expected = f"Before\n\n{readme_table()}\nAfter\n![One](there.png)\n"
        assert page.read_text() == f"{expected}<!-- ![Two](not_there.png) -->\n"


def test_every_picture_is_shown_or_linked():
    """One whose place was kept in a comment is shown by: python experiments/gallery.py --readme."""
    used = {Path(link).name for page in PAGES for link in links(page)}
    there = {path.name for path in (FOLDER / SMALL_PICTURES).iterdir() if path.suffix != ".md"}
    assert there <= used, sorted(there - used)


def test_pictures_in_the_repository_are_small():
    sizes = [path.stat().st_size for path in (FOLDER / SMALL_PICTURES).iterdir()]
    assert sum(sizes) < MOST_BYTES and max(sizes) < MOST_BYTES / 10


def test_pictures_that_are_not_there_yet_are_named_in_a_comment():
    """A place for a picture breaks nothing, and is ready to be used."""
    text = README.read_text(encoding="utf-8")
    for line in re.findall(r"<!--(.*?)-->", text, re.DOTALL):
        for name in re.findall(r"!\[[^]]+\]\((.+?)\)", line):
            assert not (FOLDER / name).exists(), f"{name} is there: gallery.py --readme shows it"
