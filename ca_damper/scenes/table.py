"""The numbers of every scene of a batch, one row a scene."""

from typing import Any

import numpy as np

from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import SMALLEST, choice, positive, real_numbers, shown, whole

_WHOLE = ("particles", "seed")
#: A container that is not driven stands still: only a Batch needs its cycles.
_MAY_BE_ZERO = ("frequency", "base_amplitude", "damping")
#: Scenes of a table, and the largest seed.
_MOST_SCENES, _MOST_SEED = 2**24, 2**31 - 1


class SceneTable:
    """Parameters of each scene of a batch, one row a scene; plain NumPy.

    Plain NumPy. Parameters are given as scalars or sequences and are broadcast against each other.
    A Batch checks them against its filling. What a scene does depends on its own row only.

    Parameters
    ----------
    particles : int or array_like
        Number of particles.
    seed : int or array_like
        Seed.
    dt : float or array_like
        Step [s].
    frequency : float or array_like, default 6.0
        Frequency of the base [Hz].
    base_amplitude : float or array_like, default 0.0
        Amplitude of the base [m].
    mass : float or array_like, default 0.086
        Mass of the empty container [kg].
    stiffness : float or array_like, default 123.4
        Stiffness of its spring [N/m].
    damping : float or array_like, default 0.08
        Damping of its dashpot [N s/m].

    Attributes
    ----------
    count : int
        Number of scenes.
    """

    COLUMNS = (
        *("particles", "seed", "dt", "frequency", "base_amplitude"),
        *("mass", "stiffness", "damping"),
    )

    def __init__(
        self,
        particles: object,
        seed: object,
        dt: object,
        frequency: object = 6.0,
        base_amplitude: object = 0.0,
        mass: object = 0.086,
        stiffness: object = 123.4,
        damping: object = 0.08,
    ):
        values = (particles, seed, dt, frequency, base_amplitude, mass, stiffness, damping)
        columns = {name: _checked(name, value) for name, value in zip(self.COLUMNS, values)}
        lengths = {len(column) for column in columns.values()} - {1}
        self.count = lengths.pop() if lengths else 1
        if lengths or not 1 <= self.count <= _MOST_SCENES:
            listed = ", ".join(f"{len(column)} of {name}" for name, column in columns.items())
            raise InputError(
                "a table must have one number or one a scene of everything, from 1 to "
                f"{_MOST_SCENES} scenes, got {listed}"
            )
        self._host = {name: _kept(column, self.count) for name, column in columns.items()}

    def copy(self) -> "SceneTable":
        """Return a table of the same numbers."""
        return SceneTable(**self._host)

    def __repr__(self) -> str:
        ends = {name: (of.min(), of.max()) for name, of in self._host.items()}
        words = (
            f"{name} {low:.6g}" + (f" to {high:.6g}" if high > low else "")
            for name, (low, high) in ends.items()
        )
        return in_brief(self, counted(self.count, "scene"), *words)

    def change(self, **numbers: Any) -> None:
        """Replace numbers of all scenes by name.

        Parameters
        ----------
        **numbers : float or array_like
            Numbers by the name of a column, each a scalar or (scenes,).
        """
        for name in numbers:
            choice("number to change", name, self.COLUMNS)
        changed = SceneTable(**{**self._host, **numbers})
        if changed.count != self.count:
            raise InputError(
                f"numbers to change must be one for all or {self.count}, got {changed.count}"
            )
        self._host = changed._host

    def drive(self, frequency: object, dt: object) -> None:
        """Change frequency and step of all scenes.

        Parameters
        ----------
        frequency : float or array_like
            Frequency of the base [Hz], a scalar or (scenes,).
        dt : float or array_like
            Step [s], a scalar or (scenes,).
        """
        self.change(frequency=frequency, dt=dt)

    def column(self, name: str) -> np.ndarray:
        """Column of the table by name, shape (scenes,); read-only, see ``change``.

        Parameters
        ----------
        name : str
            Name of the column.
        """
        return self._host[choice("name", name, self.COLUMNS)]

    def row(self, s: int) -> dict[str, Any]:
        """Numbers of a scene by name.

        Parameters
        ----------
        s : int
            Number of the scene, from 0.
        """
        whole("s", s, 0, self.count - 1)
        return {name: self._host[name][s].item() for name in self.COLUMNS}


def _kept(column: np.ndarray, count: int) -> np.ndarray:
    kept = np.broadcast_to(column, count).copy()
    kept.flags.writeable = False
    return kept


def _checked(name: str, value: object) -> np.ndarray:
    """One number or a sequence as an array (n,) of 64 bits; InputError for any out of range."""
    zero_allowed = name in _WHOLE + _MAY_BE_ZERO
    column = np.atleast_1d(real_numbers(name, value, 0.0 if zero_allowed else SMALLEST))
    if column.ndim != 1:
        raise InputError(f"{name} must be a number or a sequence of numbers, got {shown(value)}")
    if name not in _WHOLE:
        for number in column[(column > 0.0) & (column < SMALLEST)][:1].tolist():
            positive(name, number, zero_allowed)
        return column
    bad = column[(column > _MOST_SEED) | (column != np.floor(column))]
    if len(bad):
        raise InputError(
            f"{name} must be whole numbers from 0 to {_MOST_SEED}, got {shown(bad[0].item())}"
        )
    return column.astype(np.int64)


def dealt(cost: np.ndarray, threads: int) -> np.ndarray:
    """Scene numbers in an order that gives each thread the same cost, (scenes,) i32."""
    # A thread takes a contiguous part of the loop: scenes are dealt out in turn by falling cost.
    dear_first = np.argsort(-cost, kind="stable")
    hands = [dear_first[k::threads] for k in range(threads)]
    return np.concatenate(hands)
