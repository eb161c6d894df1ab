"""Energy and momentum account of a run, term by term.

work of loads and supports + energy at the start = kinetic + bond strain + contact strain
+ bond dashpots + slip + softening + release + friction + contact dashpots + contact hysteresis
+ ground dashpots - injected + residual. Terms of all contacts are called ``sphere_*``.
"""

from collections.abc import Callable, Mapping

import numpy as np

from taichi_dem.report.readings import Kept, Run

#: Terms of the account in the order of tables and files, all in J.
TERMS = tuple(
    "kinetic bond_strain sphere_strain bond_dashpot softening release slip sphere_dashpot friction "
    "hysteresis ground_dashpot injected load_work support_work residual".split()
)
#: Terms that the columns of the three tables add to.
_COLUMNS = (
    "kinetic load_work support_work sphere_dashpot friction injected hysteresis "
    "ground_dashpot".split(),
    "bond_strain bond_dashpot slip release softening".split(),
    "sphere_strain sphere_dashpot friction injected hysteresis".split(),
)
#: Terms that the bodies hold; all others are booked as they are given or taken.
HELD = ("kinetic", "bond_strain", "sphere_strain")
#: Terms of the energy put in and injected; all others are what it goes into.
GIVEN = ("load_work", "support_work", "injected")
#: Share of the energy beyond which an account counts as open.
OPEN = 0.5
#: Share of the energy put in from which on injected and unexplained energy are told.
NOTED = 0.01
#: Share of all impulses of loads and supports, by their sizes, below which no momentum is a scale.
_LEAST_SHARE = 1e-6


def unexplained_share(account: Mapping[str, float], round_off: float = 0.0) -> float:
    """Residual of an account over all energy that went through it; NaN where a term is none."""
    through = sum(abs(value) for name, value in account.items() if name != "residual")
    return abs(account["residual"]) / max(through, 100.0 * round_off, 1e-300)


def energy_at_start(account: Mapping[str, float]) -> float:
    """Energy [J] that the bodies had at the start, which the residual leaves."""
    return abs(sum(-value if name in GIVEN else value for name, value in account.items()))


def energy_put_in(account: Mapping[str, float]) -> float:
    """Energy at the start, and work of loads and of supports where they gave more than took [J]."""
    return energy_at_start(account) + sum(max(0.0, account[name]) for name in GIVEN[:2])


def given_and_held(account: Mapping[str, float]) -> tuple[float, float]:
    """Energy put in, and energy held at the end [J]."""
    return energy_put_in(account), sum(account[name] for name in HELD)


def put_in_words(account: Mapping[str, float], round_off: float = 0.0) -> str:
    """Energy put in and its parts; also what loads or supports took. round_off: as above."""
    start = {"at the start": energy_at_start(account)}
    parts = {**start, "by loads": account["load_work"], "by supports": account["support_work"]}
    given = [f"{value:.6g} J {how}" for how, value in parts.items() if value > round_off]
    taken = [f"{-value:.6g} J taken {how}" for how, value in parts.items() if -value > round_off]
    return f"{energy_put_in(account):.6g} J{_listed(given)}{_listed(taken)}"


def _listed(words):
    return f" ({', '.join(words)})" if words else ""


def injected_words(account: Mapping[str, float], round_off: float = 0.0) -> str:
    """Energy that releases injected, in words, from ``NOTED`` of the energy put in on; else ""."""
    put_in = energy_put_in(account)
    if account["injected"] < NOTED * put_in or account["injected"] <= round_off:
        return ""
    share = 100.0 * account["injected"] / max(put_in, 1e-300)
    return (
        f"{account['injected']:.6g} J, {share:.3g} % of the energy put in, came from no load but "
        "from faces that overlapped as they broke (docs/limits.md)"
    )


def open_account(account: Mapping[str, float], round_off: float) -> tuple[str, ...]:
    """Sentence about energy that an account does not explain, from ``NOTED`` on; else none."""
    given, held = given_and_held(account)
    residual, whole = abs(account["residual"]), max(given, held)
    if residual <= round_off or residual < NOTED * whole:
        return ()
    share, of = 100.0 * residual / max(whole, 1e-300), "held" if held > given else "put in"
    return (
        f"the energy balance leaves {account['residual']:.3g} J unexplained, {share:.3g} % of the "
        f"energy {of}: take a shorter step, or start with velocities that bond dashpots do not "
        "stop within one step",
    )


class EnergyBalance(Kept):
    """Energy balance: sums of booked terms, and stored energies computed by the laws of the step.

    start_energy: energy at the start [J].
    """

    kept = "start_energy", "start_momentum", "start", "start_works"

    def __init__(self, run: Run):
        self.run, self.start_energy, self.start = run, 0.0, np.zeros(len(TERMS))
        self.start_works = np.zeros(1)
        first = self._account()
        self.start_energy = sum(first[name] for name in HELD)
        # Half a step of what acts from the start is booked at time zero.
        held = *HELD, "residual"
        self.start = np.array([0.0 if name in held else first[name] for name in TERMS])
        self.start_works = self.works()
        self.start_momentum = _own(run.readings.momentum())

    def account(self) -> dict[str, float]:
        """All terms in J by name; residual is the unexplained remainder."""
        return dict(self.run.readings.once("account", self._account))

    def _account(self):
        terms = {name: 0.0 for name in TERMS if name != "residual"}
        for names, table in zip(_COLUMNS, self.tables()):
            for name, column in zip(names, table.T):
                terms[name] += column.sum()
        for name, start in zip(terms, self.start):
            terms[name] -= start
        given = terms["load_work"] + terms["support_work"] + terms["injected"] + self.start_energy
        terms["residual"] = given - sum(terms[name] for name in terms if name not in GIVEN)
        return {name: float(value) for name, value in terms.items()}

    def tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tables that the terms are summed from [J]."""
        readings = self.run.readings
        with readings.held():
            return readings.bodies(), readings.bonds(), readings.pairs()

    def works(self) -> np.ndarray:
        """Work of each load, all supports and each ground on every body, since the start [J]."""
        return self.run.readings.works() - self.start_works

    def load_work(self, index: int) -> float:
        """Work of one load [J], by its place in the scene's list of loads."""
        return float(self.works()[:, index].sum())

    def momentum_errors(self) -> tuple[float, float]:
        """Errors of linear and angular momentum, relative to the momentum exchanged."""
        rows = self.run.readings.momentum()
        # The squares of a run that has diverged may be beyond all numbers.
        with np.errstate(over="ignore", invalid="ignore"):
            lost = _own(rows) - self.start_momentum
            linear, angular = _exchanged(rows)
            return np.linalg.norm(lost[:3]) / linear, np.linalg.norm(lost[3:]) / angular

    def momentum_exchanged(self, total: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Size of the momentum of bodies, or of their load impulse if larger [N s], summed."""
        rows = self.run.readings.momentum()
        sizes = (np.linalg.norm(rows[:, k : k + 3], axis=1) for k in (0, 6))
        return np.max([total(column) for column in (*sizes, _LEAST_SHARE * rows[:, 12])], axis=0)


def _own(rows):
    """Linear [N s] and angular momentum [N m s] less what loads and supports gave, (6,)."""
    return rows[:, :6].sum(axis=0) - rows[:, 6:12].sum(axis=0)


def _exchanged(rows):
    """Linear and angular momentum that bodies have, or have got from loads if that is more."""
    sizes = [np.linalg.norm(rows[:, k : k + 3], axis=1).sum() for k in (0, 3, 6, 9)]
    given = _LEAST_SHARE * rows[:, 12:].sum(axis=0)
    return max(*sizes[0::2], given[0], 1e-300), max(*sizes[1::2], given[1], 1e-300)
