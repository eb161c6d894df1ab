"""What does a handful of particles in a box do to its vibration?

A container hangs on a spring and is shaken; the particles in it fly, fall and hit its walls.
Beside it hangs an empty one. Both begin as the empty one swings for good, so that one sees what
the particles take. Try other numbers of particles, frequencies (1 is where the empty container
swings most) and amplitudes of the shaking base.

    python experiments/demo_damper.py                                  # ten seconds
    python experiments/demo_damper.py --particles 60 --frequency 0.95
    python experiments/demo_damper.py --filling spheres --amplitude 1.2

With --effects auto, which is the default, the program computes the effects that the scene calls
for (the spheres turn where friction makes them); "listed" takes the filling as it is.

``python -m ca_damper demo`` is the same job where only the package is installed: the scene and what
is measured of it stand in ca_damper/demo.py.

Writes damper.gif, view.html (the same to play), motion.png, motion.csv, caption.txt and
summary.json to results/demo_damper/.
"""

import sys
from functools import partial

from ca_damper import demo
from taichi_dem.kit import study

NAME = "demo_damper"
options_parser = partial(study.parser, NAME, __doc__, settings=demo.SETTINGS)


def run(options):
    """Let the full and the empty container swing, compare, picture."""
    demo.swing(options, NAME)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
