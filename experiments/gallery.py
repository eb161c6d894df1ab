"""Run every experiment, each in a process of its own, and keep what the pages show of them.

    make gallery                                       # times are in docs/experiments.md
    make gallery GALLERY_OPTIONS=--quick               # smaller jobs
    python experiments/gallery.py --only demo_damper   # one of them

Results go to results/NAME, or with --quick to results/quick/NAME; `make docs` shows all experiments
on the page Gallery. The exit code is 1, with a list, if an experiment failed. A new experiment gets
an entry in _gallery_pages.txt; --readme then updates the list of docs/experiments.md. --pictures
copies small pictures and figures of full runs into docs, and CPU times of runs with --cold, full
and quick ones, into _gallery_pages.txt; --readme writes these into the pages.
"""

import itertools
import json
import os
import re
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

from taichi_dem import InputError
from taichi_dem.kit import children
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study import add_out, bare_parser, main_of_tool, several
from taichi_dem.kit.study.entries import ENTRIES, read_entries, with_time

HERE = Path(__file__).resolve().parent
PAGES = read_entries(HERE / ENTRIES)
#: Scripts that are no experiment of their own, and why.
TOOLS = {
    "bench": "measures speed, `make bench`",
    "bench_others": "measures other programs beside, `make bench-others`",
    "gallery": "runs the others",
    "make_meshes": "makes the meshes, `make mesh`",
}
#: Small pictures for the repository: widest side [pixels] and colours.
SMALL_PICTURES, SIDE, COLOURS = "docs/pictures", 960, 256
#: CPU seconds of a first run, beside its output.
CPU_TIME = "cpu_seconds.txt"
#: Figures by experiment, lines of the table that it writes for a page, if any, and the command, the
#: machine and the versions of its run.
KEPT = "docs/figures.json"
#: Sentences of pages with kept figures, a line each: "PAGE: words {formula, digits} words".
SENTENCES = "docs/figures.txt"
_FIGURE, _NUMBER = re.compile(r"\{([^{}]+), (\d)\}"), r"[\d.,]*\d"
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
FLAGS = {
    "quick": "run smaller jobs",
    "cold": "compile all kernels in each: its CPU time is that of a first run",
    "readme": "update the list of experiments and the figures in all pages, run nothing",
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
        keep_figures(options.out, HERE.parent)
        keep_times(options.out, HERE / ENTRIES)
        return keep_pictures(options.out, HERE.parent / SMALL_PICTURES)
    known = {page.name: page for page in PAGES}
    for name in options.only or ():
        if name not in known:
            raise InputError(f"only must name experiments out of {', '.join(known)}, got {name!r}")
    failed = []
    for name in options.only or known:
        words = run_experiment(known[name], options.out, options.quick, options.cold)
        print(f"{name}: {words or 'done'}", flush=True)
        failed += [f"{name}: {words}"] if words else []
    if failed:
        print("\n".join(["Without a result:", *failed]), file=sys.stderr)
    return 1 if failed else 0


def run_experiment(entry, out, quick, cold):
    """Run an experiment into out/NAME; returns why it failed, or ""."""
    folder = Path(output_folder(os.path.join(out, entry.name)))
    # None of an earlier run shall pass for this one's.
    for name in ("summary.json", CPU_TIME, *entry.pictures):
        (folder / name).unlink(missing_ok=True)
    line = [sys.executable, str(HERE / f"{entry.name}.py"), *entry.options.split()]
    line += ["--out", str(folder), *(["--quick"] if quick else [])]
    before = os.times()
    with tempfile.TemporaryDirectory() as empty:
        own = {"TI_OFFLINE_CACHE_FILE_PATH": empty} if cold else {}
        done = children.run(line, env={**os.environ, **own})
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or ["it printed nothing"]
        return f"exit code {done.returncode}: {said[-1]}"
    if cold:
        write_text(folder / CPU_TIME, str(sum(os.times()[2:4]) - sum(before[2:4])))
    return ""


def keep_figures(out, root):
    """Keep the figures of full runs in out/NAME for the pages."""
    path = Path(root, KEPT)
    kept = json.loads(path.read_text(encoding="utf-8"))
    for found in Path(out).glob("*/summary.json"):
        summary, name = json.loads(found.read_text(encoding="utf-8")), found.parent.name
        if name in {page.name for page in PAGES} and not summary["quick"]:
            values = {key: one["value"] for key, one in summary["figures"].items()}
            made_by = {key: summary[key] for key in ("command", "machine", "versions")}
            # Where its files lay is of no use to a reader.
            made_by["command"] = made_by["command"].partition(" --out ")[0]
            for page in found.parent.glob("*.md"):
                made_by["table"] = page.read_text(encoding="utf-8").splitlines()
            kept[name] = {"figures": values, **made_by}
    write_text(path, json.dumps(kept, indent=1, sort_keys=True) + "\n")


def keep_times(out, path):
    """Write CPU times of first runs, full ones in out and quick ones in out/quick, to entries."""
    text = path.read_text(encoding="utf-8")
    for field, folder in (("time", Path(out)), ("quick", Path(out, "quick"))):
        for note in folder.glob(f"*/{CPU_TIME}"):
            text = with_time(text, note.parent.name, field, float(note.read_text()))
    write_text(path, text)


def keep_pictures(out, folder):
    """Write a small copy of each experiment's first picture, of a film its last image."""
    from PIL import Image

    for page in PAGES:
        source = Path(out, page.name, page.pictures[0])
        if source.is_file():
            with Image.open(source) as image:
                image.seek(getattr(image, "n_frames", 1) - 1)
                small = image.convert("RGB")
            small.thumbnail((SIDE, SIDE))
            # With too few colours, or without the means, thin lines take those of their neighbours.
            small = small.quantize(COLOURS, kmeans=3, dither=Image.Dither.NONE)
            small.save(Path(folder, f"{page.name}.png"), optimize=True)


def sentences_of(page, root):
    """Sentences of a page with kept figures: pattern with groups of words, [(formula, digits)].

    A pattern finds its sentence whatever its line ends and numbers.
    """
    for line in Path(root, SENTENCES).read_text(encoding="utf-8").splitlines():
        name, _, sentence = line.partition(": ")
        if name == page:
            parts = (f"({re.escape(part)})" for part in _FIGURE.split(sentence)[::3])
            yield _NUMBER.join(parts).replace(r"\ ", r"\s+"), _FIGURE.findall(sentence)


def fill_figures(page, root):
    """A page's text with the kept figures in its sentences and the kept tables between its marks.

    Raises InputError where a sentence is not on the page, or one of its figures is not kept.
    """
    kept = json.loads(Path(root, KEPT).read_text(encoding="utf-8"))
    names = {name: SimpleNamespace(**one["figures"]) for name, one in kept.items()}
    text = Path(root, page).read_text(encoding="utf-8")
    for pattern, figures in sentences_of(page, root):
        found = re.search(pattern, text)
        if found is None:
            raise InputError(f"{page} must have the sentence {pattern!r} of {SENTENCES}")
        numbers = [number_of(formula, int(digits), names) for formula, digits in figures]
        parts = itertools.zip_longest(found.groups(), numbers, fillvalue="")
        text = text.replace(found[0], "".join(itertools.chain.from_iterable(parts)))

    def fill_table(mark):
        begin, name, _, end = mark.groups()
        if "table" not in kept.get(name, ()):
            raise InputError(f"table {name!r} must be one kept in {KEPT}")
        return "\n".join([begin, *kept[name]["table"], "", end])

    return _TABLE.sub(fill_table, text)


def number_of(formula, digits, names):
    """A kept figure with so many significant digits, whole numbers by groups of three."""
    try:
        value = eval(formula, {"__builtins__": {}}, names)
    except (NameError, AttributeError) as error:
        raise InputError(f"figure {formula!r} must be one kept in {KEPT}: {error}") from None
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:,.0f}" if rounded >= 10 ** (digits - 1) else f"{rounded:.{digits}g}"


def list_of_experiments():
    """All experiments as a list for a page of the docs: names, which lead to pictures."""
    return "".join(f"- [{one.name}](pictures/{one.name}.png): {one.question}\n" for one in PAGES)


def renew_readme(root):
    """Renew the list of experiments, and in the sentences of all pages the figures."""
    path, listed = Path(root, "docs/experiments.md"), list_of_experiments()
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"(- \[\w+\]\(pictures/.*\n)+", lambda _: listed, text)
    write_text(path, text)
    for path in (Path(root, "README.md"), *sorted(Path(root, "docs").glob("*.md"))):
        filled = fill_figures(path.relative_to(root).as_posix(), root)
        if filled != path.read_text(encoding="utf-8"):
            write_text(path, filled)


if __name__ == "__main__":
    sys.exit(main())
