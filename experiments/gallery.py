"""Run every experiment, each in a process of its own, and show all of them on one static page.

    make gallery                                       # times are in docs/experiments.md
    make gallery GALLERY_OPTIONS=--quick               # smaller jobs
    python experiments/gallery.py --reuse              # the page from present results
    python experiments/gallery.py --only demo_damper   # one again, others as they are

Open results/index.html, or with --quick results/quick/index.html: it needs no server. The exit code
is 1, with a list, if an experiment failed or is missing from the page. A new experiment gets an
entry in _gallery_pages.txt; --readme then updates the table of docs/experiments.md. --pictures
copies small pictures and figures of full runs into docs, and CPU times of runs with --cold, full
and quick ones, into _gallery_pages.txt; --readme writes these into the pages.
"""

import json
import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace

from taichi_dem import InputError
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study import add_out, bare_parser, main_of_tool, several
from taichi_dem.kit.study.entries import ENTRIES, read_entries, with_time
from taichi_dem.kit.study.results_page import (
    RUN,
    markdown_table,
    read_json,
    run_entries,
    shrink_picture,
    write_page,
)

HERE = Path(__file__).resolve().parent
PAGES = read_entries(HERE / ENTRIES)
#: Scripts that are no experiment of their own, and why.
TOOLS = {
    "bench": "measures speed, `make bench`",
    "gallery": "builds the page",
    "make_meshes": "makes the meshes, `make mesh`",
}
#: Small pictures for the repository: widest side [pixels] and colours.
SMALL_PICTURES, SMALL = "docs/pictures", (960, 256)
#: Figures by experiment, lines of the table that it writes for a page, if any, and the command, the
#: machine and the versions of its run.
KEPT = "docs/figures.json"
_MARK = re.compile(
    r"(<!--\s+figure:\s+([^>]+?),\s+(\d)\s+digits\s+-->)(.*?)(<!--\s+end\s+-->)", re.DOTALL
)
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
FLAGS = {
    "quick": "run smaller jobs, with results and a page of their own",
    "reuse": "run only experiments without a result",
    "cold": "compile all kernels in each: its CPU time is that of a first run",
    "readme": "update the table of experiments and the figures in all pages, run nothing",
    "pictures": f"update {SMALL_PICTURES} and the figures for the pages, run nothing",
}


def main(arguments=None):
    """Run the gallery; returns the exit code: as an experiment's, or 1 with a list on stderr."""
    made = bare_parser("gallery", __doc__)
    add_out(made, "")
    made.add_argument("--only", type=several(str), default=None, help="names with commas")
    for name, words in FLAGS.items():
        made.add_argument(f"--{name}", action="store_true", help=words)
    return main_of_tool(_work, made, arguments)


def _work(options):
    if options.readme:
        return renew_readme(HERE.parent)
    if options.pictures:
        keep_figures(options.out, HERE.parent, [page.name for page in pages()])
        keep_times(options.out, HERE / ENTRIES)
        return print("\n".join(shrink_pictures(options.out, HERE.parent / SMALL_PICTURES)))
    amiss = build(options)
    if amiss:
        print("\n".join(["Without a result:", *amiss]), file=sys.stderr)
    return 1 if amiss else 0


def pages():
    """The entries whose script is there, in order."""
    return tuple(page for page in PAGES if (HERE / f"{page.name}.py").is_file())


def build(options):
    """Run the experiments asked for and write the page; returns a line for each thing amiss."""
    known = {page.name: page for page in pages()}
    for name in options.only or ():
        if name not in known:
            raise InputError(f"only must name experiments out of {', '.join(known)}, got {name!r}")
    out = output_folder(options.out)
    wanted = [known[name] for name in options.only or known]
    asked = {name: getattr(options, name) for name in ("quick", "reuse", "cold")}
    failed = run_entries(HERE, wanted, out, **asked)
    items = write_page(out, pages(), failed)
    print(f"The page is {os.path.join(out, 'index.html')}: open it in any browser.")
    return [
        *(f"{one.page.name}: {one.failed}" for one in items if one.failed and one.page in wanted),
        *(f"{name}: has no entry in _gallery_pages.txt" for name in without_entry()),
    ]


def without_entry():
    """Names of experiments that the page would not show."""
    names = {path.stem for path in HERE.glob("*.py") if not path.stem.startswith("_")}
    return sorted(names - set(TOOLS) - {page.name for page in pages()})


def keep_figures(out, root, names):
    """Keep the figures of full runs in out/NAME for the pages."""
    path = Path(root, KEPT)
    kept = read_json(path)
    for name in names:
        summary = read_json(Path(out, name, "summary.json"))
        if summary and not summary["quick"]:
            values = {key: one["value"] for key, one in summary["figures"].items()}
            made_by = {key: summary[key] for key in ("command", "machine", "versions")}
            # Where its files lay is of no use to a reader.
            made_by["command"] = made_by["command"].partition(" --out ")[0]
            for page in Path(out, name).glob("*.md"):
                made_by["table"] = page.read_text(encoding="utf-8").splitlines()
            kept[name] = {"figures": values, **made_by}
    write_text(path, json.dumps(kept, indent=1, sort_keys=True) + "\n")


def keep_times(out, path):
    """Write CPU times of first runs, full ones in out and quick ones in out/quick, to entries."""
    text = path.read_text(encoding="utf-8")
    for field, folder in (("time", Path(out)), ("quick", Path(out, "quick"))):
        for page in pages():
            note = read_json(folder / page.name / RUN)
            if note.get("cold") and (folder / page.name / "summary.json").is_file():
                text = with_time(text, page.name, field, note["cpu_s"])
    write_text(path, text)


def fill_figures(text, root):
    """A page's text with the kept figures and tables between its marks.

    Raises InputError where a mark names one that is not kept.
    """
    kept = read_json(Path(root, KEPT))
    names = {name: SimpleNamespace(**one["figures"]) for name, one in kept.items()}

    def fill(mark):
        begin, formula, digits, _, end = mark.groups()
        try:
            value = eval(formula, {"__builtins__": {}}, names)
        except (NameError, AttributeError) as error:
            raise InputError(f"figure {formula!r} must be one kept in {KEPT}: {error}") from None
        # So many significant digits, whole numbers by groups of three.
        rounded = float(f"{value:.{digits}g}")
        whole = rounded >= 10 ** (int(digits) - 1)
        return f"{begin}{rounded:,.0f}{end}" if whole else f"{begin}{rounded:.{digits}g}{end}"

    def fill_table(mark):
        begin, name, _, end = mark.groups()
        if "table" not in kept.get(name, ()):
            raise InputError(f"table {name!r} must be one kept in {KEPT}")
        return "\n".join([begin, *kept[name]["table"], "", end])

    return _TABLE.sub(fill_table, _MARK.sub(fill, text))


def shrink_pictures(out, folder):
    """Small copies of each experiment's first picture for the repository; the names written."""
    return list(filter(None, (shrink_picture(page, out, folder, *SMALL) for page in pages())))


def table_of_experiments():
    """All experiments as a table for a page of the docs."""
    return markdown_table(pages(), HERE.parent / "docs", Path(SMALL_PICTURES).name)


def renew_readme(root):
    """Renew the table of experiments, and in the sentences of all pages the figures."""
    path, table = Path(root, "docs/experiments.md"), table_of_experiments()
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"\| question \|.*?\n\n", lambda _: f"{table}\n", text, flags=re.DOTALL)
    write_text(path, text)
    for page in (Path(root, "README.md"), *sorted(Path(root, "docs").glob("*.md"))):
        text = page.read_text(encoding="utf-8")
        filled = fill_figures(text, root)
        if filled != text:
            write_text(page, filled)


if __name__ == "__main__":
    sys.exit(main())
