"""The certificate of a run with effects="auto": how much was left out, part by part."""

import math

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.loads.pressure import Gravity
from taichi_dem.mesh.topology import parts_of
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.effects import Certificate, on_demand
from taichi_dem.report.energy_balance import EnergyBalance
from taichi_dem.report.estimates import AIR, BENDS, WEIGHT, PartScales
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.readings import Run
from taichi_dem.report.report import Report
from taichi_dem.step.sleeping import ROUNDINGS

_SHARE = "share of the energy put in, at most"


def certificate_of(
    run: Run, balance: EnergyBalance, report: Report, way: np.ndarray
) -> Certificate:
    """Certificate of a run so far; way: of each body since the start [m], (n,)."""
    now = report.until_s
    awake = np.nan_to_num(on_demand(run)[0]["awake"], nan=now)
    scales = PartScales(run.model, parts_of(run.model.mesh))
    energy = _energy(run, balance, scales)
    impulse, left_energy = _left_out(run, balance, scales, energy)
    return Certificate(
        acting=report.effect_activity,
        sleep=float(values(run.schedule.sleeping.share)),
        asleep=float(awake.mean() / now) if now > 0.0 else 0.0,
        impulse=impulse,
        energy=left_energy,
        left_out=_not_served(run, scales, energy, way, now),
        missing=report.missing_effects,
        warnings=report.needs[len(report.missing_effects) :],
    )


def _energy(run, balance, scales):
    """Energy that each part got [J]: from loads and supports, or what it has and took if more."""
    body, bond, _ = balance.tables()
    given = sum(np.abs(scales.sum(column)) for column in body[:, 1:3].T)
    taken = scales.sum(body[:, 0]) + scales.sum_of_bonds(bond.sum(axis=1))
    energy = np.maximum(given, taken)
    return np.where(energy > scales.sum_of_bonds(bond_rounding(run)), energy, 0.0)


def _left_out(run, balance, scales, energy):
    """Largest shares of impulse and energy of a part that sleep left out there."""
    table = np.zeros((max(1, run.model.bond_count), 2))
    run.readings.left_out(table)
    left = [scales.sum_of_bonds(column) for column in table[: run.model.bond_count].T]
    lightest = np.full(scales.count, np.inf)
    np.minimum.at(lightest, scales.part, run.model.body_mass)
    had = np.sqrt(2.0 * lightest * energy)
    wholes = np.maximum(had, balance.momentum_exchanged(scales.sum)), energy
    rounding = ROUNDINGS**2 * scales.sum_of_bonds(bond_rounding(run))
    left = [np.where(energy > rounding, part, 0.0) for part in left]
    return [float((part / np.maximum(whole, 1e-300)).max()) for part, whole in zip(left, wholes)]


def _not_served(run, scales, energy, way, until):
    """Estimates of what no law of the scene serves, from where the run has brought the bodies."""
    model, found = run.model, []
    speed = np.linalg.norm(run.readings.motion()[:, :3], axis=1)
    if not any(isinstance(effect, Gravity) for effect in model.loads):
        active = values(run.state.active_effects, slice(model.body_count))
        borne = scales.under((*model.supports, *model.ground))
        borne |= scales.sum(active & np.int64(CONTACT)) > 0
        fall = WEIGHT * until
        work = model.body_mass * (WEIGHT * way + fall * speed + 0.5 * fall**2)
        share = _share(scales.sum(work), energy)
        # What is borne and not moved at all does not fall.
        share = np.where(borne & (energy == 0.0), 0.0, share)
        groups = (share, _SHARE), (scales.bent(until, borne), BENDS)
        found.append(scales.worst("gravity", *groups))
    drag = 0.5 * AIR * math.pi * model.body_radius**2 * speed**2
    return (*found, scales.worst("air drag", (_share(scales.sum(drag * way), energy), _SHARE)))


def _share(work, energy):
    """Share of an energy; not known where there is none."""
    none = np.where(work > 0.0, np.nan, 0.0)
    return np.where(energy > 0.0, work / np.where(energy > 0.0, energy, 1.0), none)
