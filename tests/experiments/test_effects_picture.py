"""Picture of the effects' costs: a cost that the spread of the repeats hides."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from taichi_dem.kit.plot_style import BLUE, SKY, styled


def effect(cost, least, most, sign=1.0):
    costs = {"spared_percent": cost, "spared_least_percent": least, "spared_most_percent": most}
    return "some_effect", {name: sign * value for name, value in costs.items()}, sign


EFFECTS = [
    effect(-5.0, -12.0, 6.0),
    effect(24.0, 17.0, 33.0),
    effect(-20.0, -30.0, -8.0),
    effect(14.0, 7.0, 21.0, sign=-1.0),
]


@pytest.fixture
def axes(script):
    with styled() as (_, made):
        script("cost_of_effects").draw_costs(made, EFFECTS)
        yield made


def test_a_cost_whose_range_holds_zero_is_pale_and_says_so(axes):
    words = [text.get_text().strip() for text in axes.texts]
    assert words == ["-5 %, within the spread", "24 %", "-20 %", "14 %"]
    colours = [to_hex(bar.get_facecolor()).lower() for bar in axes.patches]
    assert colours == [colour.lower() for colour in (SKY, BLUE, BLUE, BLUE)]


def test_no_number_is_changed_and_the_range_is_drawn(axes):
    assert [bar.get_width() for bar in axes.patches] == [-5.0, 24.0, -20.0, 14.0]
    ranges = [tuple(line.get_xdata()) for line in axes.lines[:4]]
    assert np.allclose(ranges, [(-12.0, 6.0), (17.0, 33.0), (-30.0, -8.0), (7.0, 21.0)])
    assert axes.get_yticklabels()[3].get_text() == "some effect (added)"
