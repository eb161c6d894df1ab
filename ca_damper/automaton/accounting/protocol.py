"""Contract of an accounting: which impulses of the particles act on the container."""

from typing import Any, ClassVar, Protocol

from ca_damper.scenes.scene_fields import SceneFields


class Accounting(Protocol):
    """Books the velocity along x that particles gain, each gain once, when it happens.

    A gain that counts acts on the container with the opposite sign, times the mass of a particle.
    The ti.funcs below with a ``gain`` [m/s] return the part that counts, in quanta
    (``impulse_balance.quanta``), and add what does not count to the impulse balance.
    """

    #: Labels of an automaton without and with static contact, for tables and files.
    labels: ClassVar[tuple[str, str]]
    #: Effects counted beside "landing", in words for the report.
    effects: ClassVar[tuple[str, ...]]
    #: Whether particles rest on the floor unless the user says otherwise.
    static_contact: ClassVar[bool]
    #: Whether every gain counts, so that nothing is left for the impulse balance.
    counts_all: ClassVar[bool]

    @property
    def needs_lattice_impulse(self) -> bool:
        """Whether ``lattice_impulse`` has any effect; if not, gains in flight are not summed."""

    def __init__(self, table: SceneFields, lattice: Any, impulse_balance: Any) -> None:
        """Allocate its fields, with ``table.field``."""

    def clear(self, s: int) -> None:
        """Reset scene s, the impulse balance included."""

    def moved(self, s: int, origin: int, target: int) -> None:
        """Follow a particle from one cell to another."""

    def arrive(self, s: int, cell: int) -> None:
        """Note that a particle has flown into a cell."""

    def wall_impulse(self, s: int, cell: int, gain: float) -> int:
        """Book the gain of a particle that meets a wall or comes to rest on the floor."""

    def push(self, s: int, gain: float) -> int:
        """Book the gain of a particle that a wall pushes along."""

    def lattice_impulse(self, s: int, item: int, gain: float) -> int:
        """Book a gain that the lattice causes: ``item`` of the impulse balance."""
