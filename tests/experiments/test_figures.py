"""What ``tests.figures`` finds in a figure, and figures drawn of made-up numbers."""

import pytest

from _hard_cases import registry
from taichi_dem.kit.plot_style import (
    BLACK,
    BLUE,
    GREEN,
    RED,
    STYLES,
    line_key,
    power,
    styled,
    styles_of,
)
from taichi_dem.kit.study.cases_picture import case_title, with_powers
from tests.figures import bad_words_in, defects


def of(draw):
    """Defects of a figure with one pair of axes, labelled with units, that a function changes."""
    with styled() as (figure, axes):
        axes.set(xlabel="time [s]", ylabel="displacement [mm]")
        axes.plot([0.0, 1.0], [0.0, 1.0], color=BLACK)
        draw(axes)
        figure.canvas.draw()
        return defects(figure)


def legend_of(label, **look):
    def draw(axes):
        axes.plot([0.0, 1.0], [1.0, 0.0], label=label, **look)
        axes.legend()

    return draw


def covered(axes, drawn):
    """A legend in the middle of the axes, instead of the line that each figure has."""
    axes.lines[0].remove()
    axes.legend(handles=[line_key("some words")], loc="center")
    return drawn


def two_lines(axes, *colours, **look):
    """Two lines instead of the one that each figure has."""
    axes.lines[0].remove()
    for level, colour in enumerate(colours):
        axes.plot([0.0, 1.0], [level, level + 1.0], color=colour, **{"ls": "-", **look})


FAULTS = {
    "code": lambda axes: axes.set_title("multirate_held"),
    "code of a tick": lambda axes: axes.set_yticks([0.0], ["ca_static"]),
    "code in a legend": legend_of("paper_uniform"),
    "number": lambda axes: axes.set_title("a step of 1e-07 s"),
    "unit": lambda axes: axes.set_xlabel("time"),
    "no label": lambda axes: axes.set_ylabel(""),
    "colour": legend_of("one fixed step, solved dashpots", color=RED),
    "colour of a part": legend_of("struck end, paper's rule, multirate", color=RED),
    "dotted": lambda axes: axes.axhline(0.5, ls=":"),
    "dashed": lambda axes: axes.axvline(0.5, ls="--"),
    "band": lambda axes: axes.fill_between([0.0, 1.0], 0.0, 1.0, alpha=0.2),
    "stripe": lambda axes: axes.axhspan(0.0, 0.5, color="0.9"),
    "small letters": lambda axes: axes.set_title("small", fontsize=6.4),
    "small letters of a wide figure": lambda axes: axes.figure.set_size_inches(9.5, 4.0),
    "words beyond the edge": lambda axes: axes.figure.text(
        0.9, 0.5, "a long line of words, too long"
    ),
    "legend on a line": lambda axes: covered(axes, axes.plot([0.0, 1.0], [0.4, 0.6], color=BLUE)),
    "legend on points": lambda axes: covered(axes, axes.plot(0.5, 0.5, "o", color=BLUE)),
    "legend on a bar": lambda axes: covered(axes, axes.bar(0.5, 1.0, 0.1, color=BLUE)),
    "legend on dots": lambda axes: covered(axes, axes.scatter(0.5, 0.5, color=BLUE)),
    "hue of lines": lambda axes: two_lines(axes, RED, GREEN),
    "hue of marks": lambda axes: two_lines(axes, RED, GREEN, ls="none", marker="o"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_figure_that_leaves_something_unsaid_is_found(fault):
    assert len(of(FAULTS[fault])) == 1


GOOD = {
    "mathematics": lambda axes: axes.set_title("f / f$_0$"),
    "words": lambda axes: axes.set(ylabel="", yticks=[0.0, 1.0], yticklabels=["this", "that"]),
    "quoted": lambda axes: axes.set_title("“v_max is 1e-07 m/s”"),
    "colour": legend_of("spheres, all pairs", color=STYLES["dem"].colour),
    "dotted": legend_of("bound", ls=":"),
    "nothing shown": lambda axes: axes.set_axis_off(),
    "no ticks": lambda axes: axes.set(ylabel="", yticks=[]),
    "ticks beyond the limits": lambda axes: (
        axes.set_xticks([-9.0, 0.5, 9.0]) and axes.set_xlim(0, 1)
    ),
    "legend on a guide": lambda axes: covered(axes, axes.axhline(0.5, color=BLUE)),
    "lightness": lambda axes: two_lines(axes, BLACK, RED),
    "width": lambda axes: two_lines(axes, RED, GREEN) or axes.lines[0].set_lw(3.0),
    "rows of marks": lambda axes: [
        axes.plot(1, k, "x", color=c) for k, c in ((0, RED), (1, GREEN))
    ],
}


@pytest.mark.parametrize("good", GOOD)
def test_figure_that_says_what_it_shows_passes(good):
    assert of(GOOD[good]) == []


def test_names_of_a_method_share_its_style_and_others_take_free_colours():
    made = styles_of(["paper_uniform", "uniform", "dem_tsuji", "spheres", "mine", "yours"])
    assert made["paper_uniform"] is made["uniform"]
    assert made["dem_tsuji"] is made["spheres"]
    assert made["mine"].label == "mine"
    assert len({style.colour for style in made.values()}) == 3


def test_methods_of_the_blast_differ_without_colour_too():
    """Their lines, which some pictures draw without marks."""
    blast = list(STYLES.values())[: list(STYLES).index("ca_static")]

    def draw(axes):
        for style in blast:
            axes.plot([0.0, 1.0], [1.0, 0.0], color=style.colour, ls=style.line, label=style.label)
        axes.figure.legend(loc="outside upper left")

    assert of(draw) == []


def test_methods_of_a_package_differ_in_colour():
    names = list(STYLES)
    blast, damper = names[: names.index("ca_static")], names[names.index("ca_static") :]
    for own in (blast, damper):
        assert len({STYLES[name].colour for name in own}) == len(own)
    assert len({style.label for style in STYLES.values()}) == len(names)


@pytest.mark.parametrize(
    ("value", "words"),
    [(1e-6, "10⁻⁶"), (3.14e-7, "3.1 × 10⁻⁷"), (2e4, "2 × 10⁴"), (9.96e3, "10⁴"), (1.0, "10⁰")],
)
def test_power_has_two_figures(value, words):
    assert power(value) == words


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("fragment_at_1_km_s", "fragment at 1 km/s"),
        ("coordinates_at_1_km", "coordinates at 1 km"),
        ("wall_at_30_m_slides", "wall at 30 m slides"),
        ("mass_ratio_1e4", "mass ratio 10⁴"),
        ("full_box", "full box"),
    ],
)
def test_case_is_told_in_words(name, words):
    assert case_title(name) == words


@pytest.mark.parametrize("case", registry(), ids=lambda case: case.name)
def test_names_and_questions_of_hard_cases_are_words(case):
    assert not list(bad_words_in((case_title(case.name), with_powers(case.question))))
