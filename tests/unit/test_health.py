"""Runs that leave their bounds end with the place, the reason and a step that would do."""

import re

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, SimulationDiverged, Uniform, effects, simulate
from taichi_dem.mesh_shapes import bar

MESH = bar(0.3, 0.1, (3, 1, 1))


def damped():
    """A bar under gas pressure with Table 1's dashpots: explicit steps must be short."""
    return Scene(MESH, CONCRETE, [effects.BondDamping(), effects.GasPressure("left", rise=1e-5)])


@pytest.fixture(scope="module")
def diverged(tmp_path_factory):
    """Folder, sentence and result of a run with a step twenty times too long."""
    folder = tmp_path_factory.mktemp("diverged")
    with pytest.raises(SimulationDiverged) as caught:
        simulate(damped(), method=Uniform(dt0=1e-6), until=2e-4, output=folder, frames=5)
    return folder, str(caught.value), caught.value.result


def test_the_sentence_names_body_neighbour_level_time_and_a_step_that_would_do(diverged):
    _, sentence, _ = diverged
    for pattern in (r"body \d+", r"bond \d+", r"level 0", r"t = [\d.e-]+ s", "bond dashpots"):
        assert re.search(pattern, sentence), sentence
    assert re.search(r"try a step of ([\d.e-]+) s", sentence)


def test_the_step_that_it_names_is_stable(diverged):
    """Work put in stays in the account: nothing comes from nowhere."""
    step = float(re.search(r"try a step of ([\d.e-]+) s", diverged[1]).group(1))
    assert step < 1e-6
    result = simulate(damped(), method=Uniform(dt0=step), until=5e-5, samples=4)
    assert abs(result.history["residual_J"][-1]) < 0.05 * result.history["gas_work_J"][-1]


def test_the_last_good_output_is_left(diverged):
    folder, sentence, result = diverged
    assert result.diverged == sentence
    rows = (folder / "history.csv").read_text().splitlines()
    assert len(rows) == 1 + len(result.history["time_s"])
    assert np.all(np.isfinite(result.history["kinetic_J"]))
    assert not list(folder.glob("*.part*"))


def test_nan_is_found_at_once():
    """A body that is no number: the comparison that finds runaway finds it too."""
    simulation = Simulation(damped(), Uniform(dt0=1e-8))
    motion = simulation.state.motion()
    motion["velocity"][4, 1] = np.nan
    simulation.state.place(motion["position"], motion["orientation"], motion["velocity"])
    with pytest.raises(SimulationDiverged, match="body"):
        simulation.advance_to(10)
    assert simulation.state.tick[None] <= 10 << 20
