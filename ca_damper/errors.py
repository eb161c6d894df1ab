"""Exceptions for users of the package; scripts end with exit codes 2 and 3 on them."""

from collections.abc import Mapping

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.errors import SimulationDiverged as _SimulationDiverged


class SimulationDiverged(_SimulationDiverged):
    """A scene left the range of meaningful numbers.

    Parameters
    ----------
    sentence : str
        The message.
    scene : mapping
        Numbers of the scene's row, by name.
    step : int
        Number of the step after which it was found.
    time_s : float
        Time of that [s].
    dt : float
        Step that was used [s].
    dt_allowed : float
        Step that suffices [s], also in ``advice``.
    """

    def __init__(
        self,
        sentence: str,
        *,
        scene: Mapping[str, float],
        step: int,
        time_s: float,
        dt: float,
        dt_allowed: float,
    ):
        super().__init__(sentence)
        self.scene, self.step, self.time_s = scene, step, time_s
        self.dt, self.dt_allowed = dt, dt_allowed
        self.advice = {"dt": dt_allowed}


__all__ = ["InputError", "SimulationDiverged"]
