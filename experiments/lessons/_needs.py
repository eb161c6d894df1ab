"""Effects that a scene needs: a bar is pulled open and pressed together, with any effects.

Every choice of effects is a program of its own, and to compile one takes seconds. So answers come
from two programs, with contact and without, in which the numbers of the other effects are such that
they never act: the same bits (a test demands it). The cost of a choice is measured with its own
program, on demand. All runs on the engine's thread.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from _engine import engine
from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    needed_effects,
)
from taichi_dem.diagnostics.missing_effects import unserved
from taichi_dem.engine.model import Model
from taichi_dem.mesh.shapes import bar

LENGTH, WIDTH, CELLS = 0.3, 0.1, (3, 2, 2)
STEP, UNTIL, LOOKS = 2e-8, 9e-4, 20
#: The right end goes with v cos(2 pi f t), and sideways at half of it: v [m/s] to choose, f [Hz].
SPEEDS = (0.05, 0.2, 0.5, 0.75, 1.0, 1.5, 2.0)
SIDEWAYS, FREQUENCY = 0.5, 900.0
#: Looks at which the bar is drawn: pulled open, and pressed together.
SHOWN = {"pulled open": 6, "pressed together": LOOKS}
EFFECTS = {
    "bond_damping": effects.BondDamping,
    "softening": effects.Softening,
    "shear_slip": effects.ShearSlip,
    "sphere_contact": effects.SphereContact,
    "friction": effects.Friction,
}
ALL = tuple(EFFECTS)
WITHOUT_CONTACT = ALL[:3]
#: Times the strength that no effect left out shall reach.
_STRONGER = 2.0**40
WORDS = {
    "bond_damping": "dashpots of the bonds",
    "softening": "fracture",
    "shear_slip": "slip in shear",
    "sphere_contact": "contact of fragments",
    "friction": "friction of fragments",
}

#: Questions of the notebook, and what unfolds below them.
QUESTIONS = {
    "Pull gently, with 0.2 m/s. Which effects can you switch off, and how do you know?": (
        "All but the dashpots. The table says *never acted*: without an effect that never "
        "acted **not a bit** of the answer differs. Switch off fracture, slip, contact and "
        "friction, and the change stays zero."
    ),
    "Pull with 2 m/s and switch off the contact. What do you see, what does the program say?": (
        "The pieces pass through each other when the bar is pressed together. The run ends "
        "without a word of error: **every figure looks fine**. Only the last row tells: "
        "bodies overlap, *list it*. A program that stays silent here would be dangerous."
    ),
    "Switch off fracture. Why is contact then never missed?": (
        "Nothing breaks, so nothing comes loose that could touch. Effects hang together: ask "
        "for one, and others follow."
    ),
    "A hard pull makes the program warn of sphere dashpots. How wrong is it?": (
        "By 0.2 %: so far do the bodies end elsewhere when the step is halved, and the "
        "warning stays. Twice as long a step would be wrong by 2 %. A warning is a reason to "
        "try a shorter step, and not yet an error."
    ),
    "Which effect is dear, and is it the one that matters most?": (
        "Leave out one at a time and press the button. Dear and important are two things: "
        "look at the share of the energy in the table, and at where the bodies end."
    ),
    "Fracture takes 2 % of the energy. Can it go?": (
        "No. It *steers*: it takes little and decides where everything goes. The program "
        "never drops such an effect because its energy is small, only because it never acted."
    ),
}


@dataclass(frozen=True, eq=False)
class Outcome:
    """A run with some effects.

    names: of the effects. motions: of all bodies, by the names of SHOWN, so far as the run came.
    broken: which bonds at the end, bool. step_s: CPU seconds of a step, NaN where that was not
    measured. advice: of ``needed_effects``. sentence: of the program where it ended the run, or "".
    unresolved: its sentences about processes for which the step is too long.
    """

    names: tuple
    motions: dict
    broken: np.ndarray
    step_s: float
    advice: object
    sentence: str
    unresolved: tuple


@dataclass(frozen=True, eq=False)
class Answer:
    """Runs for one choice: the Outcome chosen and that with all effects; model: of the bar.

    speed: at which the right end begins [m/s].
    """

    speed: float
    chosen: Outcome
    complete: Outcome
    model: object

    @property
    def stroke(self):
        """Largest displacement of the right end [m]."""
        return self.speed / (2.0 * np.pi * FREQUENCY)

    @property
    def change(self):
        """Mean distance of the bodies from where all effects bring them, by how far that is.

        None where the chosen run did not come to its end.
        """
        if self.chosen.sentence or self.complete.sentence:
            return None
        here, there = (
            made.motions["pressed together"]["position"] for made in (self.chosen, self.complete)
        )
        way = np.linalg.norm(there - self.model.centre, axis=1).mean()
        return float(np.linalg.norm(here - there, axis=1).mean() / way)


def allowed(names):
    """The effects that can be listed out of names, in order: friction acts in contacts only."""
    kept = set(names)
    if "sphere_contact" not in kept:
        kept.discard("friction")
    return tuple(name for name in ALL if name in kept)


def scene(names):
    """The bar, held on the left and moved on the right, with some effects."""
    moved = effects.PrescribedMotion("right", (1.0, SIDEWAYS, 0.0), FREQUENCY)
    listed = [EFFECTS[name]() for name in names]
    return Scene(bar(LENGTH, WIDTH, CELLS), CONCRETE, [*listed, effects.Fixed("left"), moved])


def ready(program):
    """The bar at rest with all effects of a program, which is compiled once."""
    made = Simulation(scene(program), Uniform(STEP))
    made.start()
    return made


@engine.remember
def model():
    """Constants of the bar."""
    return Model(scene(()).mesh, CONCRETE, [])


def silenced(made, names):
    """Set the numbers of the effects that are not named to what never acts; watch out for them."""
    model = made.tables
    laws = (model.dashpot, model.tension, model.shear, model.friction)
    dashpot, tension, shear, friction = (bool(law.name) and law.name not in names for law in laws)
    if dashpot:
        model.dashpot.law.fill(0.0)
    if tension:
        # As strong as nothing is: strength, its opening, and the failure beyond, by a power of two.
        model.tension.law[0] *= _STRONGER
        limits = model.tension.unit.to_numpy()
        limits[:, 0] *= _STRONGER
        model.tension.unit.from_numpy(limits)
        model.tension.law[1] = 2.0 * float(limits[:, 0].max())
    if shear:
        model.shear.law[0] *= _STRONGER
    if friction:
        model.friction.law[0] = 0.0
    made.missing_effects.needed = unserved({EFFECTS[name].role for name in names})
    return made


@engine.remember
def outcome(names, speed):
    """Move the bar with these effects; the Outcome knows no cost, as others stand silent by."""
    program = ALL if "sphere_contact" in names else WITHOUT_CONTACT
    return replace(moved(program, names, speed), step_s=math.nan)


def measured(names, speed):
    """The same by the program of these effects alone, which knows its cost."""
    return moved(names, names, speed)


def moved(program, names, speed):
    """Outcome of a program with the effects named; the others in it never act."""
    made = silenced(ready(program), names)
    motion = made.tables.supports[1].law
    motion[0], motion[1] = speed, SIDEWAYS * speed
    every, motions, sentence, spent = round(UNTIL / LOOKS / STEP), {}, "", 0.0
    try:
        for k in range(1, LOOKS + 1):
            started = time.thread_time()
            made.advance_to(k * every)
            spent += time.thread_time() - started
            made.sample()
            motions.update({name: made.state.motion() for name, at in SHOWN.items() if at == k})
    except SimulationDiverged as diverged:
        sentence = str(diverged)
    report = made.report()
    listed = tuple(use for use in report.effect_activity if use.effect in names)
    return Outcome(
        names=names,
        motions=motions,
        broken=made.state.broken_tick.to_numpy()[: made.model.bond_count] >= 0,
        step_s=spent / max(1, report.substeps),
        advice=needed_effects(replace(report, effect_activity=listed)),
        sentence=sentence,
        unresolved=report.unresolved,
    )


def answer(names, speed):
    """The Answer to a choice: effects by name, as ``allowed`` gives them, and one of SPEEDS."""
    return Answer(speed, outcome(names, speed), outcome(ALL, speed), model())


def price(names, speed):
    """The Answer with costs: both programs run one after the other."""
    ready(names)
    chosen, complete = (measured(one, speed) for one in (names, ALL))
    return replace(answer(names, speed), chosen=chosen, complete=complete)


def compile_all():
    """Compile both programs that answers come from, so that no later answer has to wait."""
    for names in (ALL, WITHOUT_CONTACT):
        ready(names)


def verdicts(answer):
    """A row for every effect: (words, whether listed, what it did, what the program advises)."""
    advice = answer.chosen.advice
    uses = {use.effect: use for use in advice.uses}
    missed = {finding.effect: finding for finding in advice.missing}
    rows = []
    for name, words in WORDS.items():
        finding = missed.get(EFFECTS[name].__name__)
        if name in uses:
            says = "drop it" if name in advice.droppable else "keep it"
            rows.append((words, True, str(uses[name]), says))
        elif finding is not None:
            did = f"{finding.what}: up to {finding.most} at a time"
            rows.append((words, False, did, "list it"))
        else:
            rows.append((words, False, "left out", "not missed"))
    return rows
