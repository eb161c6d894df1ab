"""Run every experiment, each in a process of its own, and show all of them on one static page.

    make gallery                                       # about 40 minutes on two cores
    make gallery GALLERY_OPTIONS=--quick               # about six
    python experiments/gallery.py --reuse              # the page alone, from what is there
    python experiments/gallery.py --only demo_damper   # one anew, the others from what is there

Open results/index.html: it needs no server. Ends with exit code 1 and a list when an experiment
failed or is missing from the page. A new experiment gets an entry in _gallery_pages.txt; --readme
then renews the table of README.md.
"""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

from taichi_dem import InputError
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study import bare_parser, exit_code, several
from taichi_dem.kit.study.results_page import (
    CAPTION,
    RUN,
    read_entries,
    shrink_picture,
    write_page,
)

HERE = Path(__file__).resolve().parent
PAGES = read_entries(HERE / "_gallery_pages.txt")
#: Scripts that are no experiment of their own, and why.
TOOLS = {
    "bench": "measures speed, `make bench`",
    "gallery": "builds the page",
    "make_meshes": "makes the meshes, `make mesh`",
}
#: Small pictures for the repository: widest side [pixels] and colours.
SMALL_PICTURES, SMALL = "docs/pictures", (960, 256)


def options_parser():
    """Options of the gallery."""
    made = bare_parser("gallery", __doc__)
    made.add_argument("--quick", action="store_true", help="run smaller jobs of under a minute")
    out = {"type": os.path.expanduser, "default": "results"}
    made.add_argument("--out", help="folder for page and results", **out)
    made.add_argument("--only", type=several(str), default=None, help="names, by comma")
    made.add_argument("--reuse", action="store_true", help="run only what has no result yet")
    made.add_argument("--readme", action="store_true", help="renew README.md, run nothing")
    words = f"renew {SMALL_PICTURES}, run nothing"
    made.add_argument("--pictures", action="store_true", help=words)
    return made


def main(arguments=None):
    """Run the gallery; returns the exit code: as an experiment's, or 1 with a list on stderr."""
    return exit_code(lambda: _work(options_parser().parse_args(arguments)))


def _work(options):
    if options.readme:
        return renew_readme(HERE.parent)
    if options.pictures:
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
    items = write_page(out, pages(), run_all(wanted, options))
    print(f"The page is {os.path.join(out, 'index.html')}: open it in any browser.")
    failed = [item for item in items if item.failed and item.page in wanted]
    return [
        *(f"{item.page.name}: {item.failed}" for item in failed),
        *(f"{name}: has no entry in _gallery_pages.txt" for name in without_entry()),
    ]


def run_all(wanted, options):
    """Run experiments one after the other, and print how each ended; name -> why it failed."""
    failed = {}
    for number, page in enumerate(wanted, 1):
        if options.reuse and Path(options.out, page.name, "summary.json").exists():
            continue
        print(f"{number:2d}/{len(wanted)} {page.name} ... ", end="", flush=True)
        started = time.perf_counter()
        failed[page.name] = run_one(page, options.out, options.quick)
        print(failed[page.name] or f"{time.perf_counter() - started:.0f} s", flush=True)
    return failed


def run_one(page, out, quick):
    """Run an experiment and note what it printed; returns why it failed, or ""."""
    folder = output_folder(os.path.join(out, page.name))
    # None of an earlier run shall pass for this one's.
    for name in ("summary.json", RUN, CAPTION, *page.pictures):
        Path(folder, name).unlink(missing_ok=True)
    line = [sys.executable, str(HERE / f"{page.name}.py"), *page.options.split()]
    line += ["--out", folder, *(["--quick"] if quick else [])]
    started = time.perf_counter()
    done = subprocess.run(line, capture_output=True, text=True)
    note = {"seconds": time.perf_counter() - started, "output": done.stdout}
    write_text(os.path.join(folder, RUN), json.dumps(note, indent=1))
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines() or ["it said nothing"]
    return f"exit code {done.returncode}: {said[-1]}"


def without_entry():
    """Names of experiments that the page would not show."""
    names = {path.stem for path in HERE.glob("*.py") if not path.stem.startswith("_")}
    return sorted(names - set(TOOLS) - {page.name for page in pages()})


def shrink_pictures(out, folder):
    """Small copies of each experiment's first picture for the repository; the names written."""
    return list(filter(None, (shrink_picture(page, out, folder, *SMALL) for page in pages())))


def readme_table():
    """The table of all experiments for README.md, with a small picture where there is one."""
    lines = ["| question | command | time on two cores | picture |", "|---|---|---|---|"]
    for page in pages():
        small = f"{SMALL_PICTURES}/{page.name}.png"
        link = f"[picture]({small})" if (HERE.parent / small).is_file() else ""
        lines.append(f"| {page.question} | `{page.command}` | {page.time} | {link} |")
    return "\n".join(lines) + "\n"


def renew_readme(root):
    """Renew the table of README.md in a folder, and show pictures whose place was kept for them."""
    path = Path(root, "README.md")

    def show(place):
        return place[1] if Path(root, place[2]).is_file() else place[0]

    text = path.read_text(encoding="utf-8")
    text = re.sub(r"\| question \|.*?\n\n", lambda _: f"{readme_table()}\n", text, flags=re.DOTALL)
    text = re.sub(r"<!-- (!\[[^]]+\]\((.+?)\)) -->", show, text)
    write_text(path, text)


if __name__ == "__main__":
    sys.exit(main())
