"""Pictures of cases: curves of every case, and how far methods stay within their bounds."""

import math
import re
import textwrap
from collections.abc import Mapping, Sequence

from taichi_dem.kit.plot_style import BLACK, GREY, RED, line_key, picture, power, styles_of
from taichi_dem.kit.study.cases import FAILED, PASSED, REFUSED, Trial

#: Margins from which on more means nothing; where those stand that refuse, and those that fail.
_MOST, _PLACES = 1e4, {REFUSED: 0.05, FAILED: 0.4}
_TICKS = {0.05: "refused", 1.0: "1", 10.0: "10", 100.0: "100", _MOST: "≥ 10⁴"}
#: Style of a method in ``styles_of``, where it has another name there.
Alias = Mapping[str, str]


def case_title(name: str) -> str:
    """Name of a case in words: fragment_at_1_km_s -> fragment at 1 km/s."""
    words = re.sub(r"(\d+_k?m)_s(?![a-z])", r"\1/s", name).replace("_", " ")
    return with_powers(words)


def with_powers(words: str) -> str:
    """Words with powers of ten for numbers as a program prints them: 1e4 -> 10⁴."""
    return re.sub(r"\d+(?:\.\d+)?e[-+]?\d+", lambda found: power(float(found[0])), words)


def _distinct(trials, name):
    """Different values of a member of trials, in their order."""
    return list(dict.fromkeys(getattr(trial, name) for trial in trials))


def _looks_of(trials, alias):
    """Label, colour, mark and dashes of every method."""
    methods = _distinct(trials, "method")
    styles = styles_of((alias or {}).get(method, method) for method in methods)
    return {
        m: {"label": s.label, "color": s.colour, "marker": s.marker, "ls": s.line}
        for m, s in zip(methods, styles.values())
    }


def picture_cases(
    path: str, trials: Sequence[Trial], columns: int = 3, alias: Alias | None = None
) -> None:
    """A panel a case with the curves of its methods; one case alone with its question."""
    cases, looks = _distinct(trials, "case"), _looks_of(trials, alias)
    # The first are thick, so that all are seen.
    for k, look in enumerate(looks.values()):
        look.update(lw=max(0.8, 3.0 - 0.45 * k))
    alone = len(cases) == 1
    columns = 1 if alone else columns
    rows = -(-len(cases) // columns)
    size = (7.0, 4.6) if alone else (3.06 * columns, 0.6 + 2.6 * rows)
    with picture(path, rows, columns, size, squeeze=False) as (figure, axes):
        for axis in axes.ravel()[len(cases) :]:
            axis.set_axis_off()
        for axis, case in zip(axes.ravel(), cases):
            own = [trial for trial in trials if trial.case is case]
            _draw_case(axis, own, looks)
        shown = dict.fromkeys(trial.method for trial in trials if trial.curve)
        keys = [line_key(**{**looks[method], "marker": None}) for method in shown]
        place = "lower center" if alone else "upper left"
        figure.legend(handles=keys, loc=f"outside {place}", ncols=2)
        if alone:
            question = textwrap.fill(with_powers(cases[0].question), 100)
            figure.suptitle(question, fontsize=9.0, x=0.02, ha="left")


def _draw_case(axis, own, looks):
    """Curves of the methods of a case, and how they fared in the title."""
    shown = [trial for trial in own if trial.curve]
    for trial in shown:
        curve, look = trial.curve, dict(looks[trial.method])
        if curve.dots:
            look.update(ls="none", ms=1.6 * look["lw"] + 1.0, mfc="none", lw=1.0)
        else:
            look.update(marker=None)
        for y in curve.lines:
            axis.plot(curve.x, y, **look)
        axis.set(xlabel=curve.xlabel, ylabel=curve.ylabel)
    if shown:
        axis.locator_params(axis="x", nbins=5)
    else:
        said = textwrap.fill(f"“{own[0].words}”", 32)
        axis.set(xticks=[], yticks=[])
        axis.text(0.03, 0.92, said, fontsize=8.5, va="top", transform=axis.transAxes)
    lowest, highest = axis.get_ylim()
    if 0.0 < lowest < 0.95 * highest:
        axis.set_ylim(0.0, 1.05 * highest)
    failed = any(trial.status == FAILED for trial in own)
    title = f"{case_title(own[0].case.name)}: {_verdict(own)}"
    look = {"fontsize": 9.0, "color": RED if failed else BLACK}
    axis.set_title(textwrap.fill(title, 32), **look)


def _verdict(own):
    """How the methods of a case fared, in words."""
    counts = {
        word: sum(trial.status == word for trial in own) for word in (PASSED, REFUSED, FAILED)
    }
    said = [f"{n} {'FAILED' if word == FAILED else word}" for word, n in counts.items() if n]
    least = min((trial.margin for trial in own if trial.worst), default=math.inf)
    if math.isfinite(least):
        margin = f"margin {power(least) if least >= 100.0 else format(least, '.2g')}"
        # A line of the title shall not end within it.
        said.append(margin.replace(" ", "\N{NO-BREAK SPACE}"))
    return ", ".join(said)


def picture_margins(path: str, trials: Sequence[Trial], alias: Alias | None = None) -> None:
    """A panel a package, a row a case, a mark a method: its margin, or that it refuses."""
    packages = dict.fromkeys(trial.case.package for trial in trials)
    panels = {name: [trial for trial in trials if trial.case.package == name] for name in packages}
    size = (
        4.6 * len(panels),
        2.2 + 0.155 * max(len(_distinct(own, "case")) for own in panels.values()),
    )
    with picture(path, 1, len(panels), size, squeeze=False) as (_, axes):
        for axis, (package, own) in zip(axes[0], panels.items()):
            _draw_margins(axis, own, _looks_of(own, alias))
            look = {"title_fontsize": 9.5, "alignment": "left"}
            look.update(loc="lower left", bbox_to_anchor=(-0.3, 1.0), borderpad=0.0)
            axis.legend(title=f"{package}: {len(own)} runs", **look)


def _draw_margins(axis, own, looks):
    """Marks of all methods, those that fail as stars."""
    cases = _distinct(own, "case")
    failed = [trial for trial in own if trial.status == FAILED]
    for k, (method, look) in enumerate(looks.items()):
        spread = 0.5 * (k / max(1, len(looks) - 1) - 0.5)
        look = {**look, "ls": "none", "mew": 0.0, "ms": 5.0}
        for some, more in ((own, {}), (failed, {"marker": "*", "ms": 11.0, "label": None})):
            mine = [trial for trial in some if trial.method == method]
            where = [_place_of(trial) for trial in mine]
            level = [cases.index(trial.case) + spread for trial in mine]
            axis.plot(where, level, **{**look, **more})
    if failed:
        axis.plot([], [], "*", ms=11.0, color=BLACK, label="failed")
    axis.axvline(1.0, color=GREY, lw=1.0, label="at the bound")
    axis.set(xscale="log", xlim=(0.02, 2.5 * _MOST), ylim=(len(cases) - 0.3, -0.7))
    axis.set_yticks(range(len(cases)), [case_title(case.name) for case in cases])
    axis.set_xticks(list(_TICKS), list(_TICKS.values()))
    axis.set_xticks([], minor=True)
    axis.set_xlabel("margin: bound / worst figure [1]")


def _place_of(trial):
    """Place of a trial on the axis of margins."""
    return _PLACES.get(trial.status, min(trial.margin, _MOST))
