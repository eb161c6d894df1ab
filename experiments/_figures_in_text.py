"""Figures in the pages: kept from the runs whose pictures the pages show, filled in by a script.

A figure in a page stands between two comments, the first of which says what it is:

    <!-- figure: demo_x.seconds / demo_x.steps, 2 digits -->0.12<!-- end -->

NAME.KEY is a figure of the summary.json of experiments/NAME.py, as it was kept with its picture.
"""

import json
import re
from pathlib import Path
from types import SimpleNamespace

from taichi_dem import InputError
from taichi_dem.kit.files import write_text
from taichi_dem.kit.study.results_page import read_json

#: Figures by experiment, with the command, the machine and the versions of its run.
KEPT = "docs/figures.json"
_MARK = re.compile(r"(<!-- figure: ([^>]+?), (\d) digits -->)(.*?)(<!-- end -->)", re.DOTALL)


def keep_figures(out, root, names):
    """Keep the figures of full runs in out/NAME for the pages; returns the names kept."""
    path = Path(root, KEPT)
    kept, renewed = read_json(path), []
    for name in names:
        summary = read_json(Path(out, name, "summary.json"))
        if summary and not summary["quick"]:
            values = {key: one["value"] for key, one in summary["figures"].items()}
            made_by = {key: summary[key] for key in ("command", "machine", "versions")}
            # Where its files lay is of no use to a reader.
            made_by["command"] = made_by["command"].partition(" --out ")[0]
            kept[name] = {"figures": values, **made_by}
            renewed.append(name)
    write_text(path, json.dumps(kept, indent=1, sort_keys=True) + "\n")
    return renewed


def fill_figures(text, root):
    """A page's text with the kept figures between its marks.

    Raises InputError where a mark names a figure that is not kept.
    """
    kept = read_json(Path(root, KEPT))
    names = {name: SimpleNamespace(**one["figures"]) for name, one in kept.items()}

    def fill(mark):
        begin, formula, digits, _, end = mark.groups()
        try:
            value = eval(formula, {"__builtins__": {}}, names)
        except (NameError, AttributeError) as error:
            raise InputError(f"figure {formula!r} must be one kept in {KEPT}: {error}") from None
        return f"{begin}{in_digits(value, int(digits))}{end}"

    return _MARK.sub(fill, text)


def in_digits(value, digits):
    """A number in a sentence: so many significant digits, whole ones by groups of three."""
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:,.0f}" if rounded >= 10 ** (digits - 1) else f"{rounded:.{digits}g}"
