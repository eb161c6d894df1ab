"""Contracts of fillings, devices and accountings: each member left out once, and none forgotten."""

import ast
from dataclasses import dataclass
from pathlib import Path

import pytest
import taichi as ti

import ca_damper
from ca_damper import (
    Automaton,
    Batch,
    InputError,
    RigidMass,
    SceneTable,
    frequency_response,
    runtime,
)
from ca_damper.automaton.accounting import ACCOUNTINGS, Accounting, Uncounted
from ca_damper.contracts import members_of
from ca_damper.engine.damper_engine import _POOL
from ca_damper.filling import Action, DeviceFilling, Filling
from ca_damper.fixed_mass import FixedMass

PACKAGE = Path(ca_damper.__file__).parent
TABLE = SceneTable([2, 3], 1, 1e-4, 6.0, 1e-3)
LOADED = [*members_of(DeviceFilling), "load"]


def parts_of(whole, *left_out):
    """A class with the members of another but for some."""
    kept = {
        name: member
        for name, member in vars(whole).items()
        if name not in left_out and (not name.startswith("__") or name == "__init__")
    }
    return type("Partial", (), kept)


@pytest.mark.parametrize("name", members_of(Filling))
def test_a_filling_without_a_member_is_refused_by_its_name(name):
    partial = parts_of(RigidMass, name, "__init__", "__post_init__")()
    for ask in (
        lambda: Batch(partial, TABLE),
        lambda: frequency_response(partial, particles=1, ratios=1.0),
    ):
        with pytest.raises(InputError, match=f"filling must have '{name}'") as refused:
            ask()
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", LOADED)
def test_a_device_without_a_member_is_refused_by_its_name(name):
    partial = ti.data_oriented(parts_of(FixedMass, name, "_data_oriented"))

    @dataclass(frozen=True)
    class Binds(RigidMass):
        def bind(self, table):
            return partial(table)

    with pytest.raises(InputError, match=f"bind of a filling returns must have '{name}'"):
        Batch(Binds(), TABLE)
    Batch(RigidMass(), TABLE).start()


@pytest.mark.parametrize("name", members_of(Accounting))
def test_an_accounting_without_a_member_is_refused_by_its_name(name, monkeypatch):
    monkeypatch.setitem(ACCOUNTINGS, "partial", parts_of(Uncounted, name))
    with pytest.raises(InputError, match=f"accounting 'partial' must have '{name}'"):
        Automaton(rules="paper", accounting="partial")


def members_asked(path, owner):
    """Members that a source asks of what it calls ``owner``, or ``self.owner``."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            of = node.value
            if owner == getattr(of, "id", getattr(of, "attr", None)):
                yield node.attr


@pytest.mark.parametrize(
    ("owner", "contract", "optional"),
    [
        (
            "filling",
            Filling,
            {"structure", "activated", "checked_range", "clearance", "with_clearance"},
        ),
        ("device", DeviceFilling, {"load", "first_steps", "audit", "find_blows", "carry_out"}),
    ],
)
def test_the_package_asks_for_no_more_than_the_contract_has(owner, contract, optional):
    folders = (PACKAGE, PACKAGE / "engine", PACKAGE / "scenes")
    paths = [path for folder in folders for path in folder.glob("*.py")]
    paths = [path for path in paths if path.stem not in ("__init__", "fixed_mass")]
    asked = {name for path in paths for name in members_asked(path, owner)}
    assert asked <= {*members_of(contract), *optional, "fixed_mass", "filling"}
    assert set(members_of(contract)) <= asked


def test_the_rules_ask_an_accounting_for_no_more_than_its_contract_has():
    paths = (PACKAGE / "automaton").glob("*.py")
    asked = {name for path in paths for name in members_asked(path, "accounting")}
    assert asked <= {*members_of(Accounting), "ACCOUNTINGS", "Accounting"}


@ti.data_oriented
class Frozen:
    """A carried mass that is compiled."""

    def __init__(self, table, mass):
        self.table, self.particle_mass = table, mass

    @ti.func
    def reset(self, s):
        """Nothing to place."""

    @ti.func
    def advance(self, s, step, motion):
        return Action(0.0, self.table.particles[s] * self.particle_mass)

    @ti.func
    def energy(self, s):
        return 0.0

    @ti.func
    def momentum(self, s):
        return 0.0

    @ti.func
    def divergence_code(self, s):
        return 0

    def uses(self, effects):
        return ()

    def snapshot(self, s):
        return {}


@dataclass(frozen=True)
class FrozenMass:
    """A filling without ``structure``, as short as can be."""

    particle_mass: float = 1e-3
    label = "frozen"
    default_dt = 1e-4
    capacity = 10
    gravity = 9.8
    effects = ()
    step_bound = None

    def check(self, particles, dt):
        """Everything is possible."""

    def divergence(self, code, particles, dt):
        return "cannot", dt

    def bind(self, table):
        return Frozen(table, self.particle_mass)


def test_a_filling_without_structure_compiles_its_numbers_and_takes_any_table():
    def displaced(filling, particles):
        batch = Batch(filling, SceneTable(particles, 1, 1e-4, 6.0, 1e-3))
        batch.start("rigid")
        batch.advance(100)
        return batch.sample()["x"].tolist()

    runtime.clear()
    for mass, particles in ((1e-3, [1]), (1e-3, [4, 5, 6]), (2e-3, [3])):
        exact = displaced(RigidMass(mass), particles)
        assert displaced(FrozenMass(mass), particles) == exact
    assert _POOL.count == 3
