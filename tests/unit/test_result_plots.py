"""Pictures of a result: one line each, figures that say what they show, files where asked."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from taichi_dem import PAPER_BLOCK, InputError, read_mesh
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.output.body_values import COLOURS
from tests.figures import defects
from tests.made_result import made_result

PLOTS = {
    "history": lambda plot, **to: plot.history(**to),
    "columns": lambda plot, **to: plot.history(["kinetic_J", "friction_J", "broken_faces"], **to),
    "energy": lambda plot, **to: plot.energy(**to),
    "energy shares": lambda plot, **to: plot.energy_shares(**to),
    "cracks": lambda plot, **to: plot.cracks(**to),
    "crack area": lambda plot, **to: plot.crack_area(**to),
    "fragments": lambda plot, **to: plot.fragments(**to),
    "rose": lambda plot, **to: plot.rose(**to),
    "oblique rose": lambda plot, **to: plot.rose((1, 1, 1), sectors=12, **to),
    **{
        f"block by {name}": lambda plot, name=name, **to: plot.block(colour=name, **to)
        for name in COLOURS
    },
}


@pytest.fixture(scope="module")
def result():
    return made_result()


@pytest.mark.parametrize("name", PLOTS)
def test_a_picture_is_a_figure_that_explains_itself(result, tmp_path, name):
    figure = PLOTS[name](result.plot, path=tmp_path / "picture.png")
    assert isinstance(figure, Figure)
    assert (tmp_path / "picture.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    figure.canvas.draw()
    # A rose has no axes with units; its title has the unit.
    assert [one for one in defects(figure) if "rose" not in name] == []


def test_without_a_path_nothing_is_written(result, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("rose", "block by speed"):
        assert PLOTS[name](result.plot)._repr_png_()[:4] == b"\x89PNG"
    assert not list(tmp_path.iterdir())


BARE = {
    "nothing broke": lambda made: dataclasses.replace(
        made, broken_time=np.full(made.model.bond_count, np.nan)
    ),
    "one frame": lambda made: dataclasses.replace(made, frames=made.frames[:1]),
    "all zero": lambda made: dataclasses.replace(
        made,
        history={name: np.zeros(7) for name in made.history},
        peak_speed=np.zeros(made.model.body_count),
    ),
    "a body alone": lambda made: made_result(mesh=single(), share=0.0),
    "all broken": lambda made: made_result(mesh=bar(0.2, 0.1, (2, 1, 1)), share=1.0),
}


@pytest.mark.parametrize("name", BARE)
def test_a_run_without_much_to_show_is_drawn_too(result, name):
    made = BARE[name](result)
    for key in ("energy shares", "fragments", "rose", "block by speed"):
        assert isinstance(PLOTS[key](made.plot), Figure)


def test_attenuation_is_fitted_to_what_there_is():
    """Velocities that fall as 30 r^-1.5 around the paper's hole: the law is found."""
    made = made_result(mesh=read_mesh(PAPER_BLOCK), frames=1)
    found = made.attenuation()
    speed = 30.0 * found.distance**-1.5
    fall = dataclasses.replace(made, peak_speed=speed)
    law = fall.attenuation().power_law(4.0, inner_only=False)
    assert law == pytest.approx((-1.5, 30.0), rel=1e-9)
    assert np.isnan(fall.attenuation().power_law(4.0)).all()
    figure = fall.plot.attenuation()
    figure.canvas.draw()
    words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert "power −1.50 (fitted to all bodies)" in words
    assert defects(figure) == []


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda plot: plot.history(["speed"]), "names must be a tuple out of"),
        (lambda plot: plot.history("time_s"), "names must be a tuple out of"),
        (lambda plot: plot.block(colour="red"), "colour must be one of"),
        (lambda plot: plot.block(99), "frame must be a whole number"),
        (lambda plot: plot.block(magnify=0), "magnify must be a positive"),
        (lambda plot: plot.block(axis=(0, 0, 0)), "axis must be longer"),
        (lambda plot: plot.cracks(magnify=-1), "magnify must be a positive"),
        (lambda plot: plot.rose(sectors=0), "sectors must be"),
        (lambda plot: plot.attenuation(nearest=0.0), "nearest must be|group must name"),
        (lambda plot: plot.energy(path="no/where.png"), "there is no folder"),
    ],
)
def test_what_cannot_be_drawn_is_refused(result, draw, words):
    with pytest.raises(InputError, match=words):
        draw(result.plot)
