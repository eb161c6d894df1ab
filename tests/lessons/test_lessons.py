"""What the lessons compute and tell: bits of runs made for the choice, accounts that close.

And their static pages: all frames are there, and a click in a browser shows another one.
"""

import base64
import importlib.util
import json
import re
import zlib
from pathlib import Path

import pytest

import _answers
import _grains
import _needs
import _page
import _static
import _time_step
from taichi_dem import Simulation, Uniform, effects, runtime
from taichi_dem.kit.session_thread import session
from taichi_dem.materials import CONCRETE
from taichi_dem.scene import Scene
from tests.browser import run_in_page
from tests.scenes import ROOT

pytestmark = pytest.mark.experiment

NOTEBOOKS = sorted(Path(ROOT, "experiments", "lessons").glob("wh*.py"))
LESSONS = pytest.mark.parametrize(
    "lesson", [_time_step, _answers, _grains, _needs], ids=lambda lesson: lesson.PAGE
)
MOST_BYTES = 3e6
#: What a reader sees: returns it once the picture is there.
SEEN = """
  const picture = document.getElementById("picture");
  const seen = async () => {
    await new Promise((go) => setTimeout(go, 500));
    await picture.decode();
    const inputs = [...document.querySelectorAll("input:checked")];
    const checked = inputs.map((one) => one.name + one.value);
    const told = document.getElementById("answer").innerText, state = location.hash;
    const fits = document.documentElement.scrollWidth <= innerWidth;
    return { state, checked, told, fits, picture: picture.dataset.wanted };
  };
"""
#: Chooses a control's other value, and the first guess, where the mouse would: in reach of it.
CLICK = """
  const before = await seen();
  for (const name of ["values", "guesses"]) {
    const chip = document.querySelector(`input[name=${name}]:not(:checked)`);
    chip.scrollIntoView({ block: "center" });
    const place = chip.getBoundingClientRect();
    document.elementFromPoint(place.x + place.width / 2, place.y + place.height / 2).click();
    await new Promise((go) => setTimeout(go, 500));
  }
  return [before, await seen()];
"""


@pytest.fixture(scope="module")
def engine(taichi_session):
    """The thread that the lessons share, with two of the CPU; it wants Taichi for itself."""
    runtime.stop()
    session.threads = 2
    yield session
    session.close()
    session.threads = None


def test_another_step_and_blow_give_the_bits_of_a_simulation_made_for_them(engine):
    """After a run with other numbers that has diverged, nothing of it is left."""
    step, rise, count = 8e-8, 5e-5, 300

    def fresh():
        blow = effects.GasPressure("left", peak=_time_step.PEAK, rise=rise, decay_ratio=1.0)
        scene = Scene(_time_step.scene().mesh, CONCRETE, [blow, effects.BondDamping()])
        simulation = Simulation(scene, Uniform(step))
        simulation.advance_to(count)
        return simulation.state.motion(), simulation.energy_balance.account()

    def again():
        _time_step.strike("explicit", 2.56e-6, 1e-5)
        made = _time_step.ready("explicit", step, rise)
        made.advance_to(count)
        return made.state.motion(), made.energy_balance.account()

    (expected, account), (motion, other) = engine.ask(fresh), engine.ask(again)
    assert all(motion[key].tobytes() == expected[key].tobytes() for key in expected)
    assert account == other and account["load_work"] > 0.0


def test_what_the_base_gives_is_what_dashpot_and_grains_take(engine):
    """In the steady state; first harmonics. 2 % is left of the transient after 60 cycles.

    A box that is as well damped as the empty one (0.012) forgets by exp(-2 pi 0.012 60) = 1 %, in
    amplitude, which counts twice in an energy.
    """
    answer = engine.ask(_grains.Answer, 30, 0.07, 0.6e-3, 0.97)
    given = answer.energy["base"]
    assert answer.energy["dashpot"] + answer.energy["filling"] == pytest.approx(given, rel=0.02)
    assert answer.energy["filling"] > 0.2 * given and answer.throw > 1.0


def test_answers_hold_the_truth_and_narrower_ones_cost_more_runs(engine):
    """A bar that is asked for to a share is no wider; the truth's own error is below 1e-6.

    It falls by four from step to step: from 1.5e-6 s, where it is 3 %, to 1e-8 s.
    """
    last = [engine.ask(_answers.answer, tolerance) for tolerance in (10.0, 0.29, 0.01)][-1]
    assert list(last.answers) == [10.0, 0.3, 0.01]
    for tolerance, found in last.answers.items():
        assert found.reached and 0.0 < last.bar(tolerance) <= 0.01 * tolerance
        assert last.error(tolerance) <= last.bar(tolerance) + 3e-6
    runs = [found.plan.runs for found in last.answers.values()]
    assert runs == sorted(runs) and runs[0] < runs[-1]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_without_a_browser(path, engine, capfd):
    pytest.importorskip("marimo", reason="marimo is not installed: make lessons installs it")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.app.run()
    assert capfd.readouterr().err == ""


@pytest.fixture(scope="module")
def pages(engine, tmp_path_factory):
    """Path of the quick static page of a lesson, built when it is asked for."""
    folder, made = tmp_path_factory.mktemp("lessons"), {}

    def page_of(lesson):
        if lesson not in made:
            made[lesson] = _static.build(lesson.__name__, folder, quick=True)
        return made[lesson]

    return page_of


def data_of(path):
    """What a static page holds."""
    found = re.search(r'id="data">(.*?)</script>', path.read_text(encoding="utf-8"))
    return json.loads(found[1])


@LESSONS
def test_a_static_page_has_a_frame_for_each_value_and_asks_for_nothing(lesson, pages):
    text, data = pages(lesson).read_text(encoding="utf-8"), data_of(pages(lesson))
    assert not re.search(
        r"https?://|@import|url\(|<(link|script|img)[^>]*(src|href)=\"(?!data:)", text
    )
    pictures = [zlib.decompress(base64.b64decode(one)) for one in data["pictures"]]
    assert all(b"<svg" in one for one in pictures)
    shown = [(frame["wide"], frame["tall"]) for one in data["questions"] for frame in one["frames"]]
    assert {*sum(shown, ())} == {*range(len(pictures))}
    for question in data["questions"]:
        assert len(question["values"]) == len(question["frames"]) == _static.QUICK
        assert len(question["replies"]) == len(question["guesses"])
        told = [reply.startswith("<p><strong>Right.") for reply in question["replies"]]
        assert told.index(True) == question["right"] and sum(told) == 1


@LESSONS
def test_a_full_page_is_small(lesson, pages):
    """No larger than the quick one would be with two such pictures for each value."""
    asked = _page.questions(_page.parts_of(lesson)[1])
    values = [_static.options_of(lesson.CONTROLS[one.control][0]) for one in asked]
    pictures = data_of(pages(lesson))["pictures"]
    mean = sum(map(len, pictures)) / len(pictures)
    assert pages(lesson).stat().st_size + 2 * mean * sum(map(len, values)) < MOST_BYTES


@LESSONS
@pytest.mark.parametrize("size", [(1280, 800), (500, 900)], ids=["lecture", "telephone"])
def test_a_click_changes_address_and_picture_and_a_reload_shows_the_same(lesson, size, pages):
    before, after = run_in_page(pages(lesson), "#at=1", SEEN + CLICK, size)
    assert before["state"] == "#at=1" and before["told"] == ""
    assert after["state"].startswith("#at=1&values=") and after["picture"] != before["picture"]
    assert after["told"].startswith(("Right.", "No:"))
    assert {"guesses0"} < {*after["checked"]} and before["fits"] and after["fits"]
    again = run_in_page(pages(lesson), after["state"], SEEN + "return seen();", size)
    assert again == after
    assert pages(lesson).with_suffix(".png").stat().st_size > 10_000
