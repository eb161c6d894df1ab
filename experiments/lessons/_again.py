"""A simulation that is compiled once and run again and again, with other steps and other loads."""

import numpy as np

from taichi_dem import Simulation
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.timeline import MACRO_TICKS, MAX_LEVEL


class Again:
    """A scene that begins at rest and a method, put back to the start before every run.

    The method is one of a fixed step without ``control``: there nothing that is compiled depends on
    the step (of ``ImplicitDashpots`` only after how many steps it renews its blocks). Runs have the
    bits of a simulation that is made for them.
    """

    def __init__(self, scene, method):
        self.simulation = made = Simulation(scene, method)
        made.start()
        self.memory = FieldMemory(made)
        self.fields = self.memory.read()
        self.parts = (made, made.energy_balance, made.missing_effects, made.step_resolution)
        self.begun = [
            {name: np.array(value) for name, value in part.saved().items()} for part in self.parts
        ]

    def back(self, step):
        """Go back to the start with a step [s]; returns the simulation.

        What effects keep in fields, as the law of a load, is as in the scene, and free to be set.
        """
        made = self.simulation
        self.memory.write(self.fields)
        for part, saved in zip(self.parts, self.begun):
            part.resume(saved)
        schedule = made.schedule
        schedule.dt0, schedule.tick_seconds = step, step / MACRO_TICKS
        schedule.step_seconds.from_numpy(step / 2.0 ** np.arange(MAX_LEVEL + 1))
        # The step is in the first impulses, of springs not at rest in their last bit, and in the
        # blocks of solved dashpots.
        made.state.slot.fill(0.0)
        made.step.prime()
        return made
