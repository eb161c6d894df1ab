"""What reports follow over a run, and the report that they make of it."""

import copy
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_table import EffectTable
from taichi_dem.loads.history import unresolved_histories
from taichi_dem.methods import Method
from taichi_dem.report.divergence import DivergenceCheck
from taichi_dem.report.effects import certificate_of, effect_uses
from taichi_dem.report.energy_balance import EnergyBalance, open_account
from taichi_dem.report.hops import Hops
from taichi_dem.report.missing_effects import MissingEffects
from taichi_dem.report.readings import Kept, Run
from taichi_dem.report.report import Report, known_error
from taichi_dem.report.resolution import StepResolution
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.scene import Scene
from taichi_dem.state.model import names_of
from taichi_dem.step_control import CRITERIA

#: Figures of a report that the schedule counts, in its order.
_COUNTS = "substeps body_updates bond_evaluations pair_evaluations uniform_evaluations".split()


class Followed:
    """Energy, missing effects, shared volume and resolved steps of a run, from its start on."""

    def __init__(self, run: Run):
        self.run, self.first = run, values(run.state.position, slice(run.model.body_count))
        self.energy_balance = EnergyBalance(run)
        self.divergence_check = DivergenceCheck(run, self.energy_balance)
        self.shared_volume = SharedVolume(run)
        self.missing_effects = MissingEffects(run, self.shared_volume)
        self.step_resolution, self.hops = StepResolution(run), Hops(run)

    @property
    def kept(self) -> dict[str, Kept]:
        """What a checkpoint holds of it, by name."""
        names = "energy_balance", "missing_effects", "shared_volume", "step_resolution", "hops"
        return {name.replace("_", " "): getattr(self, name) for name in names}

    def at_start(self) -> tuple[str, ...]:
        """What is wrong before the first step, in sentences."""
        return *self.shared_volume.at_start(), *self.step_resolution.at_start()

    def sample(self, time_s: float, brief: bool) -> None:
        """Sample missing effects and unresolved steps; brief: only what ends a run, or chance."""
        if not brief:
            self.missing_effects.sample(time_s)
            self.hops.sample(time_s)
        elif self.divergence_check.keeps_bodies_apart:
            self.shared_volume.sample(time_s)
        self.divergence_check.check_shared(self.shared_volume)
        self.step_resolution.sample(time_s)

    def report(
        self, scene: Scene, method: Method, figures: Mapping[str, Any], brief: bool
    ) -> Report:
        """Report of the run so far; figures: those that others count."""
        run, model, state = self.run, self.run.model, self.run.state
        here = slice(model.body_count)
        # A look of its own: to report changes nothing of what later samples find.
        shared_volume = copy.copy(self.shared_volume)
        if not brief:
            shared_volume.sample(run.schedule.time_s, finished=True)
        linear, angular = self.energy_balance.momentum_errors()
        account = self.energy_balance.account()
        bound = np.bincount(values(state.bound, here), minlength=len(CRITERIA))
        unconverged, worst = self.step_resolution.unconverged
        missing = () if brief else self.missing_effects.findings(shared_volume)
        slip = self.step_resolution.bond_slip()
        slipped = (sliding for sliding in slip if sliding.count)
        unresolved = self._unresolved(scene, method, shared_volume, account)
        report = Report(
            method=method.name,
            effects=tuple(filter(None, names_of(model.effects))),
            until_s=run.schedule.time_s,
            body_count=model.body_count,
            bond_count=model.bond_count,
            broken_faces=int(state.broken().sum()),
            smallest_step_s=method.dt0 / 2.0 ** int(values(state.level, here).max()),
            **dict(zip(_COUNTS, values(run.schedule.evaluations).tolist())),
            **figures,
            unconverged_steps=unconverged,
            worst_residual=worst,
            energy_balance=account,
            linear_momentum_error=float(linear),
            angular_momentum_error=float(angular),
            effect_table=self._table(scene, account, missing, (*map(str, slipped), *unresolved)),
            unresolved=unresolved,
            interpenetration=shared_volume.worst if shared_volume.has_looked else None,
            bound_by={name: n for name, n in zip(CRITERIA, bound.tolist()) if n},
            bond_slip=slip,
            round_off_J=self.divergence_check.round_off(),
        )
        return replace(report, known_error=known_error(report, scene, method))

    def _table(self, scene, account, missing, warnings):
        """The table of effects; with effects="auto" as a certificate."""
        run, balance = self.run, self.energy_balance
        acting = effect_uses(run, balance, account)
        table = EffectTable(acting=acting, missing=missing, warnings=warnings)
        if not scene.on_demand:
            return table
        place = values(run.state.position, slice(run.model.body_count))
        distance = np.linalg.norm(place - self.first, axis=1)
        return certificate_of(run, balance, table, distance)

    def _unresolved(self, scene, method, shared_volume, account):
        return (
            *self.step_resolution.findings(),
            *unresolved_histories(scene.effects, method.dt0),
            *self.hops.findings(),
            *shared_volume.findings(),
            *open_account(account, self.divergence_check.round_off()),
        )
