"""Cases of damper_trust.py: what others have published of dampers, and the same by our fillings."""

import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import ca_damper as ca
from ca_damper.runs.grains import DENSITY, Grains, diameter_of

FILLINGS = (ca.Automaton(), ca.Spheres())
OWN, GRAVITY, CELL = ca.Oscillator(), 9.81, 6e-3
#: Shares of the container's mass, restitutions, clearances in cells and f/f0 of one grain.
MASRI = ((0.02, 0.05, 0.1), (0.3, 0.5, 0.75), (2, 4), (0.97, 1.0, 1.03))
#: Frequency [Hz], mass ratio, accelerations [g] and clearances in cells of a beam with grains.
BEAM_HZ, BEAM_RATIO, BEAM_G, BEAM_CELLS = 18.0, 0.06, (1.5, 20.0), (1, 2, 3, 4, 6, 8, 12)
#: Columns of boxes without a lid, layers, frequency [Hz], accelerations [g], rows.
COLUMNS, LAYERS, OPEN_HZ, OPEN_G, ROWS = (1, 3, 10), 5, 30.0, (1.2, 15.0), 60
#: Ranges of the fits [g]: moderate accelerations for the mass, which then turns negative.
MASS_FIT, LOSS_FIT = (1.5, 4.0), (3.0, 15.0)
#: Fillings of one mass: numbers of grains, and restitution and friction of the usual 30.
EQUAL_MASS = ((10, 0.75, 0.5), (20, 0.75, 0.5), (50, 0.75, 0.5), (30, 0.5, 0.5), (30, 0.75, 0.1))
#: Frequencies f/f0 among which their peaks are sought.
RATIOS = np.arange(0.94, 0.996, 0.005)


class Row(NamedTuple):
    """A line of the table: published value and ours, the range wanted, and why where it misses."""

    key: str
    words: str
    source: str
    published: str
    ours: float
    low: float
    high: float
    drawn: Any = None


def with_restitution(filling, value, **more):
    """A filling with one restitution for grains and walls."""
    return replace(filling, restitution=value, wall_restitution=value, **more)


def masri(filling, options):
    """One grain between two walls without gravity: RMS over that of the closed form."""
    ratios, found = options.grid[3], []
    for share, e, cells in itertools.product(*options.grid[:3]):
        mass = share * OWN.mass
        box = Grains(1, mass, CELL, CELL, (cells + 1) * CELL)
        grain = with_restitution(box.put_into(filling), e, gravity=0.0)
        run = {"transient_cycles": options.long, "measured_cycles": 50, "progress": None}
        rms = ca.frequency_response(grain, particles=1, seeds=1, ratios=ratios, **run).rms[0, :, 0]
        for ratio, value in zip(ratios, rms):
            hertz = ratio * OWN.natural_frequency
            case = ca.ImpactDamper(OWN, mass, e, cells * CELL, hertz)
            stable = [u for u in case.speeds if case.is_stable(u)]
            if len(stable) == 1:
                found.append((case.rms(stable[0]), value))
    exact, ours = np.array(found).T
    off = 100.0 * np.abs(ours / exact - 1.0)
    source, title = "Masri 1970", f"one grain, {len(off)} cases: RMS off the closed form [%]"
    drawn = (1e3 * exact, 1e3 * ours)
    yield Row("masri_median_percent", f"{title}, median", source, "0", np.median(off), 0, 1, drawn)
    yield Row("masri_worst_percent", f"{title}, worst", source, "0", off.max(), 0, 5)


def beam(filling, options):
    """Greatest specific damping capacity over acceleration and clearance: 2 mu E of a map."""
    levels = np.geomspace(*BEAM_G, options.levels)
    size = levels * GRAVITY / (2.0 * np.pi * BEAM_HZ) ** 2
    job = {"frequencies": BEAM_HZ, "particles": 30, "seeds": options.seeds, "progress": None}
    job |= {"transient_cycles": options.cycles, "measured_cycles": options.cycles}
    gaps = [CELL * cells for cells in options.gaps]
    made = ca.damper_map(filling, amplitudes=size, clearances=gaps, **job)
    capacity = 200.0 * BEAM_RATIO * made.energy[:, 0, :, 0].mean(axis=-1)
    words = "beam with 6 % of grains: greatest specific damping capacity [%]"
    drawn = levels, capacity, options.gaps
    source = "Friend & Kinra 2000"
    yield Row("capacity_percent", words, source, "about 50", capacity.max(), 40, 60, drawn)


def open_boxes(filling, options):
    """Exponents of apparent mass and loss over acceleration in boxes without a lid."""
    levels = np.geomspace(*OPEN_G, 2 * options.levels)
    size = levels * GRAVITY / (2.0 * np.pi * OPEN_HZ) ** 2
    job = {"frequencies": OPEN_HZ, "seeds": options.seeds, "progress": None}
    job |= {"transient_cycles": options.cycles, "measured_cycles": 3 * options.cycles}
    drawn = {}
    for columns in options.columns:
        count = columns * LAYERS
        box = Grains(count, filling.particle_mass, CELL, columns * CELL, ROWS * CELL)
        made = ca.damper_map(box.put_into(filling), amplitudes=size, particles=count, **job)
        drawn[columns] = (one[0, 0, :, 0].mean(axis=-1) for one in (made.mass_share, made.loss))
        drawn[columns] = levels, *drawn[columns]
        words, source = f"open box, {columns} column{'s' * (columns > 1)}: ", "Ferreyra et al. 2021"
        fits = ("mass", 1, MASS_FIT, "-2", -2.5, -1.5), ("loss", 2, LOSS_FIT, "-1", -1.25, -0.75)
        for name, k, ends, published, low, high in fits:
            value, error = exponent(levels, drawn[columns][k], ends)
            title = f"{words}exponent of the {name} over acceleration, ± {error:.2f}"
            key = f"exponent_{name}_{columns}"
            yield Row(key, title, source, published, value, low, high, drawn)


def exponent(level, values, ends):
    """Slope of log values over log levels between two of them, and half of its 95 % bar."""
    used = (level >= ends[0]) & (level <= ends[1]) & (values > 0.0)
    if used.sum() < 4:
        return np.nan, np.nan
    fit, covariance = np.polyfit(np.log(level[used]), np.log(values[used]), 1, cov=True)
    return float(fit[0]), float(2.0 * np.sqrt(covariance[0, 0]))


def equal_mass(filling, options):
    """Spread of the peaks of fillings of one mass in a box that leaves them room."""
    peaks, base = [], 6e-3
    for count, e, friction in options.fillings:
        own = base / count
        size = diameter_of(own, DENSITY)
        columns, rows = int(60e-3 / size), int(96e-3 / size)
        box = Grains(count, own, size, columns * size, rows * size)
        made = with_restitution(box.put_into(filling), e, friction=friction, wall_friction=friction)
        run = {"transient_cycles": 2 * options.cycles, "measured_cycles": options.cycles // 2}
        job = {"particles": count, "ratios": RATIOS, "seeds": options.seeds, "progress": None}
        peaks.append(1e3 * float(ca.frequency_response(made, **job, **run).rms[0].mean(-1).max()))
    spread = 100.0 * (max(peaks) / min(peaks) - 1.0)
    words = f"{len(peaks)} fillings of one mass, best clearance: spread of the peaks [%]"
    source, drawn = "Sanchez et al. 2012", (options.fillings, peaks)
    yield Row("spread_percent", words, source, "no dependence", spread, 0, 10, drawn)


#: Functions of filling and options that yield rows, by panel of the picture.
CASES = {"masri": masri, "beam": beam, "open": open_boxes, "equal": equal_mass}
