"""What does a handful of particles in a box do to its vibration?

A container hangs on a spring and is released 30 mm above its rest. The particles in it fly, fall
and hit its walls. Beside it hangs one with as many fixed particles. Nothing shakes them, so a
shifted resonance plays no part: a faster decay is damping. The particles damp as long as the
container's peak acceleration is above about 1 g; below it they lie on the floor, and the
structure's own damping is left. Try other numbers of particles and other amplitudes.

    python experiments/demo_damper.py
    python experiments/demo_damper.py --particles 50 --amplitude 40
    python experiments/demo_damper.py --filling spheres                # in place of the automaton
    python experiments/demo_damper.py --compare                        # figures of both
    python experiments/demo_damper.py --all-pictures                   # also a page that plays

Figures are medians over nine starts, five in a quick run. An amplitude is sqrt(2) times the RMS
displacement of a cycle of the empty container.

With --effects auto the program computes the effects that the scene needs (such as rotation of the
spheres with friction); "listed", the default, takes the fillings as they are.

``python -m ca_damper demo`` is the same job for an installed package; ca_damper/demo.py has the
scene and the measures.

Writes damper.gif, decay.png, decay.csv, report.json and summary.json to
results/demo_damper/; with --all-pictures also view.html, which plays the film; with --no-pictures
neither picture nor film.
"""

import sys

from ca_damper import demo
from taichi_dem.kit import study

NAME = "demo_damper"


def options_parser():
    """Options of this experiment."""
    made = study.parser(NAME, __doc__, settings=demo.SETTINGS)
    demo.add_options(made)
    return made


def run(options):
    """Let containers go with free and with fixed particles, compare, picture."""
    demo.let_go(options, NAME)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
