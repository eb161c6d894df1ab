"""One picture of all hard cases: how far every method stays within what physics allows."""

import math
import re

from _hard_cases._case import FAILED, REFUSED
from taichi_dem.kit.plot_style import BLACK, GREY, picture, power, styles_of

#: A uniform step of a hard case is fixed: the paper's rule does not shorten it.
_MEANT = {"uniform": "fixed"}
#: Margins from which on more means nothing; where those stand that refuse, and those that fail.
_MOST, _REFUSED, _FAILS = 1e4, 0.05, 0.4


def case_title(name):
    """Name of a case in words: fragment_at_1_km_s -> fragment at 1 km/s."""
    words = re.sub(r"(\d+_k?m)_s(?![a-z])", r"\1/s", name).replace("_", " ")
    return with_powers(words)


def with_powers(words):
    """Words with powers of ten for numbers as a program prints them: 1e4 -> 10⁴."""
    number = r"\d+(?:\.\d+)?e[-+]?\d+"
    return re.sub(number, lambda found: power(float(found[0])), words)


def method_styles(methods):
    """MethodStyle of every method of the hard cases."""
    meant = styles_of([_MEANT.get(method, method) for method in methods])
    return {method: meant[_MEANT.get(method, method)] for method in methods}


def picture_margins(path, results):
    """A panel a package, a row a case, a mark a method: its margin, or that it refuses."""
    packages = list(dict.fromkeys(result.package for result in results))
    panels = [[result for result in results if result.package == package] for package in packages]
    rows = max(len(_named(own, "case")) for own in panels)
    size = (4.4 * len(panels), 1.4 + 0.17 * rows)
    with picture(path, 1, len(panels), size, squeeze=False) as (_, axes):
        for axis, own, package in zip(axes[0], panels, packages):
            _panel(axis, own)
            axis.set_title(f"{package}: {len(own)} runs", pad=14.0 + 10.5 * -(-_entries(own) // 2))


def _entries(own):
    """Entries of a panel's legend: methods, the bound, and failures where there are any."""
    return len(_named(own, "method")) + 1 + any(result.status == FAILED for result in own)


def _named(own, what):
    return list(dict.fromkeys(getattr(result, what) for result in own))


def _panel(axis, own):
    cases, methods = _named(own, "case"), _named(own, "method")
    styles = method_styles(methods)
    for k, method in enumerate(methods):
        mine = [result for result in own if result.method == method]
        spread = 0.5 * (k / max(1, len(methods) - 1) - 0.5)
        where = [_place(result) for result in mine]
        level = [cases.index(result.case) + spread for result in mine]
        style = styles[method]
        axis.plot(where, level, "o", ms=3.4, mew=0.0, color=style.colour, label=style.label)
        failed = [k for k, result in enumerate(mine) if result.status == FAILED]
        axis.plot(
            [where[k] for k in failed], [level[k] for k in failed], "X", ms=8.0, color=style.colour
        )
    if any(result.status == FAILED for result in own):
        axis.plot([], [], "X", ms=8.0, color=BLACK, ls="none", label="failed")
    axis.axvline(1.0, color=GREY, lw=1.0, label="at the bound")
    axis.set(xscale="log", xlim=(0.02, 2.5 * _MOST), ylim=(len(cases) - 0.3, -0.7))
    axis.set_yticks(range(len(cases)), [case_title(case) for case in cases], fontsize=6.5)
    marks = {_REFUSED: "refused", 1.0: "1", 10.0: "10", 100.0: "100", _MOST: "10⁴ or exact"}
    axis.set_xticks(list(marks), list(marks.values()), fontsize=7.0)
    axis.set_xticks([], minor=True)
    axis.set_xlabel("margin: bound of physics / worst figure [1]")
    axis.legend(ncols=2, fontsize=6.5, loc="lower left", bbox_to_anchor=(-0.3, 1.0), borderpad=0.0)


def _place(result):
    """Where a result stands on the axis of margins."""
    if result.status == REFUSED:
        return _REFUSED
    if result.status == FAILED:
        return _FAILS
    return min(result.margin, _MOST) if math.isfinite(result.margin) else _MOST
