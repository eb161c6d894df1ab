"""A scene on the device, ready to step: builds all parts once and connects them."""

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.engine import ENGINES, BlastEngine, Structure
from taichi_dem.kit import runtime
from taichi_dem.kit.allocation import values
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.progress import compiling
from taichi_dem.kit.validation import choice, flag, instance, shown, whole
from taichi_dem.methods import Method
from taichi_dem.report.effects import on_demand
from taichi_dem.report.followed import Followed
from taichi_dem.report.forces import Forces
from taichi_dem.report.readings import Readings, Run
from taichi_dem.report.report import Report
from taichi_dem.scene import Scene
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables, capacity_of
from taichi_dem.state.timeline import MACRO_TICKS
from taichi_dem.step.drivers import DRIVERS, driver_name
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.phases import Step

#: Largest steps of a run, of which the ticks are counted in 64 bits.
MOST_STEPS = 2**42
#: Parts in which the kernels of a run are compiled, the last of them the recording's.
PARTS = 5


def _part(name) -> Any:
    """A part of the engine of a simulation, as a property; it checks the session."""
    return property(lambda simulation: getattr(simulation.engine, name))


class Simulation:
    """One scene, one method, one driver, on an engine of the session.

    ``simulate`` makes one; use it directly to control the steps. Its parts are those of its engine
    (contacts and broad_phase: None without contact); ``values`` reads their fields.

    Parameters
    ----------
    scene : Scene
        Scene.
    method : Method
        Method, from ``taichi_dem.methods``.
    driver : str, default "auto"
        ``"resident"``, ``"parallel"``, or ``"auto"``: parallel on a GPU, or from 10,000 bonds on.

    Attributes
    ----------
    model : Model
        Arrays of the scene.
    cut_short : str
        What interrupted a step, in words, after which bits differ; ``""`` otherwise.
    run_seconds, run_cpu_seconds : float
        Wall and CPU time spent in steps so far [s], without compiling and without readings.

    Examples
    --------
    >>> simulation = Simulation(scene, ImplicitDashpots())  # doctest: +SKIP
    >>> simulation.advance_to(100)  # doctest: +SKIP
    """

    tables: Tables = _part("tables")
    state: State = _part("state")
    schedule: Schedule = _part("schedule")
    step: Step = _part("step")
    readings: Readings = _part("readings")
    forces: Forces = _part("forces")
    contacts = _part("contacts")
    broad_phase = _part("broad_phase")

    def __init__(self, scene: Scene, method: Method, driver: str = "auto"):
        instance("scene", scene, Scene)
        instance("method", method, Method)
        choice("driver", driver, ("auto", *DRIVERS))
        runtime.check_thread("simulation")
        started = time.perf_counter()
        compiling("set-up", 1, PARTS)
        self.scene, self.method = scene, method
        self.model = scene.model()
        name = driver_name(driver, self.model.bond_count)
        structure = Structure(scene.effects, method, scene.on_demand)
        self._engine = ENGINES.borrow(structure, capacity_of(self.model), self.model, self)
        self._upload()
        self.driver = self.engine.drivers[name]
        self.compile_seconds = time.perf_counter() - started

    def __repr__(self):
        bodies = counted(self.model.body_count, "body")
        bonds = counted(self.model.bond_count, "bond")
        return in_brief(self, bodies, bonds, self.method.name, f"{self.driver.name} driver")

    @property
    def engine(self) -> BlastEngine:
        """Fields and kernels; InputError if closed, after its session, or on another thread."""
        self._engine.check(self)
        return self._engine

    def close(self) -> None:
        """Give the engine back; else others get it once nothing refers to the simulation.

        A closed simulation only has what was read before.
        """
        self.engine.owner = None

    @property
    def followed(self) -> Any:
        """What reports follow, a ``Followed``; None before the start."""
        self._engine.check(self)
        return self._followed

    @property
    def energy_balance(self) -> Any:
        """Account of the energy, None before the start."""
        return self.followed and self.followed.energy_balance

    def values(self, field: ti.Field) -> np.ndarray:
        """Copy of a field of one of the parts.

        Parameters
        ----------
        field : Field
            Field, such as ``simulation.state.level``.

        Returns
        -------
        ndarray
            Its values; of a field with an entry a body, bond, unit, face or sphere, the scene's.
        """
        return self.engine.values(field)

    def _upload(self):
        self.cut_short = ""
        with self._undivided("its scene was loaded"):
            self._upload_engine()
            if self.scene.initial_motion:
                self.state.set_motion(self.model.centre, **self.scene.initial_motion)
            self._followed: Any = None
            self.run_seconds = self.run_cpu_seconds = 0.0
            self.first_motion: dict[str, np.ndarray] = {}

    def _upload_engine(self):
        numbers = self.scene.max_speed, self.scene.sleep or 0.0
        self.engine.upload(self.model, self.method, *numbers)

    @contextlib.contextmanager
    def _undivided(self, what: str) -> Iterator[None]:
        """In its block an exception leaves a simulation that can only be reset."""
        before, self.cut_short = self.cut_short, what
        yield
        self.cut_short = before

    def reset(self, scene: Scene | None = None, method: Method | None = None) -> None:
        """Begin again at time zero as the scene says, optionally with another scene or method.

        Parameters
        ----------
        scene : Scene, optional
            Scene of the same structure (kinds of effects); the present one if None.
        method : Method, optional
            Method of the same kind; the present one if None.
        """
        scene = self.scene if scene is None else instance("scene", scene, Scene)
        method = self.method if method is None else instance("method", method, Method)
        same = scene is self.scene
        model = self.model if same else scene.model()
        self._check_reset(scene, method, model)
        self.scene, self.method, self.model = scene, method, model
        self._upload()

    def _check_reset(self, scene, method, model):
        engine = self.engine
        if Structure(scene.effects, method, scene.on_demand) != engine.structure:
            raise InputError(
                "reset must have a scene and a method of the same structure, kinds of effects and "
                f"of steps, got {scene!r} and {method!r}: make a new Simulation"
            )
        if not engine.fits(capacity_of(model)) or not engine.accepts(model):
            raise InputError(
                f"reset must have a scene that fits, up to {engine.capacity[0]} bodies with such "
                f"contact lists, got {scene!r}: make a new Simulation"
            )

    @property
    def time_s(self) -> float:
        """Present time [s]."""
        return self.schedule.time_s

    @property
    def macro_step(self) -> int:
        """Number of largest steps done."""
        return int(values(self.state.tick)) // MACRO_TICKS

    def start(self, brief: bool = False) -> None:
        """Choose the first steps, evaluate the bonds and open the account; done once.

        Compiles everything, so that the time of the run is that of stepping alone.
        """
        opened = self.energy_balance is not None
        flag("brief", brief)
        if self.cut_short:
            raise InputError(
                f"this simulation was interrupted while {self.cut_short}, and cannot "
                "continue: reset it, or make a new one"
            )
        if opened:
            return
        started = time.perf_counter()
        compiling("time step", 2, PARTS)
        with self._undivided("it was started"):
            self._start(brief)
        self.compile_seconds += time.perf_counter() - started

    def _start(self, brief):
        motion = self.state.motion()
        names = ("position", "orientation", "velocity", "spin")
        self.first_motion = {name: motion[name] for name in names}
        if self.model.has_contact:
            self.state.expose(self.model.topology, self.model.geometry.outer_faces is True)
        self.driver.begin()
        if self.contacts is not None:
            compiling("contact search", 3, PARTS)
            self.broad_phase.ask(everywhere=True)
        self.driver.prepare()
        self._find_room()
        if self.schedule.controlled and len(self.readings.near_bodies()):
            # Steps follow the contacts that were found, before velocities are set half a step back.
            self.step.start(0)
            self.step.start(1)
        compiling("energy balance", 4, PARTS)
        self.readings.step_back()
        with self.readings.held():
            self._followed = Followed(self.parts)
            self.sample(brief)
            self.followed.divergence_check.check()

    @property
    def parts(self) -> Run:
        """Parts that reports read."""
        parts = self.model, self.state, self.schedule, self.step, self.readings, self.contacts
        return Run(*parts)

    def motion(self) -> dict[str, np.ndarray]:
        """Motion of the bodies by name, as in ``State.motion``, at the time of the positions."""
        motion, table = self.state.stored(), self.readings.motion()
        for place, name in enumerate(("velocity", "spin", "angular_momentum")):
            motion[name] = table[:, 3 * place : 3 * place + 3].copy()
        return motion

    def sample(self, brief: bool = False) -> None:
        """Sample missing effects and unresolved steps; brief: only what ends a run, or chance."""
        self.followed.sample(self.time_s, flag("brief", brief))

    def advance_to(self, macro_step: int, on_call: Callable[[], object] | None = None) -> None:
        """Step until a number of largest steps.

        Parameters
        ----------
        macro_step : int
            Number of largest steps since the start.
        on_call : callable, optional
            Function without arguments that is called about five times a second.

        Raises
        ------
        SimulationDiverged
            The run left its bounds; the message names place and reason.
        """
        end = whole("macro_step", macro_step, 0, MOST_STEPS) * MACRO_TICKS
        if not (on_call is None or callable(on_call)):
            raise InputError(f"on_call must be a function or None, got {shown(on_call)}")
        self.start()
        while values(self.state.tick) < end:
            with self._undivided("it stepped"), self._timed():
                self.driver.run(end)
            with self.readings.held():
                # A runaway fills the lists: it is named first.
                self.followed.divergence_check.check(hurried=bool(values(self.state.tick) < end))
                if on_call is not None:
                    on_call()
            self._find_room()

    @contextlib.contextmanager
    def _timed(self):
        """Count the time; checks between calls are not in it, as their first ones are compiled."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.run_seconds += time.perf_counter() - wall
            self.run_cpu_seconds += time.process_time() - cpu

    def _find_room(self):
        """Make a search for which the lists had no room again, with longer ones."""
        while self.contacts is not None and any(lacking := self.broad_phase.lacking()):
            started = time.perf_counter()
            self.broad_phase.ask_again()
            self.make_room((0, 0, *(n + n // 8 for n in lacking)))
            with self._undivided("its contact lists grew"):
                self.driver.prepare()
            self.compile_seconds += time.perf_counter() - started

    def make_room(self, room: Sequence[int]) -> None:
        """Go on, with the same bits, in an engine with at least so much room (``Capacity``)."""
        old = self.engine
        wanted = [max(pair) for pair in zip(old.capacity, room)]
        if wanted == [*old.capacity]:
            return
        compiling("longer contact lists", 3, PARTS)
        # Without memory for it, the run stays as it is.
        larger = ENGINES.borrow(old.structure, wanted, self.model, self)
        with self._undivided("its contact lists grew"):
            arrays, name = FieldMemory(old).read(), self.driver.name
            self._engine = larger
            self._upload_engine()
            FieldMemory(larger).write(arrays)
            self.driver = larger.drivers[name]
            self.driver.follow(old.drivers[name])
            if self._followed is not None:
                vars(self._followed.run).update(vars(self.parts))
            ENGINES.free(old)

    @property
    def searches(self) -> int:
        """Contact searches so far."""
        return int(values(self.broad_phase.searches)) if self.contacts is not None else 0

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint beside the fields, arrays by name."""
        cost = np.array([self.run_seconds, self.run_cpu_seconds])
        return {"cost": cost, "room": np.array(self.engine.capacity)}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.run_seconds, self.run_cpu_seconds = saved["cost"].tolist()

    def evaluations(self) -> int:
        """Bonds and contact pairs evaluated so far."""
        return int(values(self.schedule.evaluations)[2:4].sum())

    def sweeps(self) -> int:
        """Sweeps over all dashpots so far; 0 for a method that solves none."""
        solver = self.step.solver
        return int(values(solver.total_sweeps)) if solver is not None else 0

    def report(self, brief: bool = False) -> Report:
        """Report of the run so far.

        Parameters
        ----------
        brief : bool, default False
            Whether to leave out the last comparison of all bodies, and so missing effects.
        """
        flag("brief", brief)
        if self.energy_balance is None:
            raise InputError("report must follow start(), but the simulation was not started")
        figures = {
            "driver": self.driver.name,
            "sweeps": self.sweeps(),
            "searches": self.searches,
            "compile_seconds": self.compile_seconds,
            "run_seconds": self.run_seconds,
            "run_cpu_seconds": self.run_cpu_seconds,
        }
        with self.readings.held():
            return self.followed.report(self.scene, self.method, figures, brief)

    def acting_since(self) -> dict[str, np.ndarray]:
        """Time [s] from which each effect acted on each body, by name; with effects="auto"."""
        return on_demand(self.parts)[0]
