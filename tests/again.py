"""A scene that is run again and again, with other steps and other starts, compiled once."""

import numpy as np

from taichi_dem import Simulation
from taichi_dem.timeline import MACRO_TICKS, MAX_LEVEL


class Again:
    """A simulation that can be put back to its start.

    Its method gives all but the step, its largest one: ``restart`` takes that.
    """

    def __init__(self, scene, method):
        self.simulation = Simulation(scene, method)
        self.simulation.start()
        self.state, self.model = self.simulation.state, self.simulation.model
        self._first = {name: f.to_numpy() for name, f in self.state.fields().items()}

    def restart(self, step, velocity=None, position=None, orientation=None, spin=None):
        """Begin at t = 0 with a step [s] and the motion that is given; the mesh's own otherwise."""
        for name, field in self.state.fields().items():
            field.from_numpy(self._first[name])
        self.state.slot.fill(0.0)
        lengths = step / 2.0 ** np.arange(MAX_LEVEL + 1)
        self.simulation.schedule.step_seconds.from_numpy(lengths)
        self.simulation.schedule.evaluations.fill(0)
        if position is not None or velocity is not None:
            still = np.tile([1.0, 0.0, 0.0, 0.0], (self.model.body_count, 1))
            self.state.set_motion(
                self.model.centre if position is None else position,
                still if orientation is None else orientation,
                velocity,
                spin,
            )
        self.simulation.step.prime()
        if self.simulation.contacts is not None:
            self.search_anew()
        self._open_account()

    def search_anew(self):
        """Forget all contacts and find those that there are now."""
        self.simulation.broad_phase.clear()
        self.simulation.broad_phase.search()

    def _open_account(self):
        balance = self.simulation.energy_balance
        balance.start_energy = 0.0
        account = balance.account()
        strain = account["bond_strain"] + account["sphere_strain"]
        balance.start_energy = account["kinetic"] + strain
        balance.start_momentum = balance.momentum()

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
        return self.state.position.to_numpy()
