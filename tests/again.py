"""A scene that is run again and again, with other steps and other starts."""

from dataclasses import replace

import numpy as np

from taichi_dem import Simulation
from taichi_dem.contact.verlet_list import STALE
from taichi_dem.kit.allocation import assign
from taichi_dem.state.timeline import MACRO_TICKS

#: Fields of the pair store that say which slots and places are in use.
SLOTS = (
    *("first", "last", "first_of", "second_start", "free_count"),
    *("used_end", "sphere_count", "sphere_end", "near_count"),
)


class Again:
    """A simulation that begins anew at each ``restart``; its method gives all but the step."""

    def __init__(self, scene, method):
        self.simulation, self.method = Simulation(scene, method), method
        self.state, self.model = self.simulation.state, self.simulation.model

    def restart(self, step, velocity=None, position=None, orientation=None, spin=None):
        """Begin at t = 0 with a step [s] and the motion that is given; the mesh's own otherwise."""
        name = "dt" if hasattr(self.method, "dt") else "dt0"
        self.simulation.reset(method=replace(self.method, **{name: step}))
        if position is not None or velocity is not None:
            still = np.tile([1.0, 0.0, 0.0, 0.0], (self.model.body_count, 1))
            self.state.set_motion(
                self.model.centre if position is None else position,
                still if orientation is None else orientation,
                velocity,
                spin,
            )
        self.simulation.start()

    def search_anew(self):
        """Forget all contacts and find those that there are now."""
        search = self.simulation.broad_phase
        for part, names in ((search.store, SLOTS), (search.neighbours, ("first", "last"))):
            for name in names:
                assign(getattr(part, name), 0)
        assign(search.neighbours.stale, STALE)
        search.search()

    def run(self, steps, look=None):
        """Go on to a number of steps since the start; look() is called after steps with a search.

        Returns the positions (n, 3) then [m].
        """
        while self.state.tick[None] < steps * MACRO_TICKS:
            searches, end = self.simulation.searches, steps
            if look is not None:
                end = self.state.tick[None] // MACRO_TICKS + 1
            self.simulation.driver.run(end * MACRO_TICKS)
            assert self.state.bad_body[None] == self.model.body_count
            if look is not None and self.simulation.searches > searches:
                look()
        return self.simulation.values(self.state.position)
