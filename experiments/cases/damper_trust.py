"""Cases of damper_trust.py: what a filling gives in each, by key, and the range that is wanted."""

import itertools
from dataclasses import replace

import numpy as np

import ca_damper as ca
from ca_damper.plot.boxes import BoxSize
from ca_damper.plot.curves import FilmMeasures
from ca_damper.report.measures import first_harmonic, peak
from ca_damper.runs.grains import DENSITY, Grains, diameter_of

FILLINGS = {
    "dem": ca.Spheres(),
    "paper": ca.Automaton(ca.Paper()),
    "place": ca.Automaton(),
}
OWN, GRAVITY, CELL = ca.Oscillator(), 9.81, 6e-3
SILENT = {"progress": None}
#: Shares of the container's mass, restitutions, clearances in cells and f/f0 of one grain.
MASRI = ((0.02, 0.05, 0.1), (0.3, 0.5, 0.75), (2, 4), (0.97, 1.0, 1.03))
#: Frequency [Hz], mass ratio, accelerations [g] and clearances in cells of a beam with grains.
BEAM_HZ, BEAM_RATIO, BEAM_G, BEAM_CELLS = 18.0, 0.06, (1.5, 20.0), (1, 2, 3, 4, 6, 8, 12)
#: Columns of boxes without a lid, layers, frequency [Hz], accelerations [g], rows.
COLUMNS, LAYERS, OPEN_HZ, OPEN_G, ROWS = (1, 3, 10), 5, 30.0, (1.2, 15.0), 60
#: Ranges of the fits [g]: moderate accelerations for the mass, which then turns negative.
FITS = {"mass": (1.5, 4.0), "loss": (3.0, 15.0)}
#: Fillings of one mass: numbers of grains, and restitution and friction of the usual 30.
EQUAL_MASS = ((10, 0.75, 0.5), (20, 0.75, 0.5), (50, 0.75, 0.5), (30, 0.5, 0.5), (30, 0.75, 0.1))
#: Frequencies f/f0 among which the peaks of these, and of others, are sought.
EQUAL_RATIOS, RATIOS = np.arange(0.94, 0.996, 0.005), np.arange(0.93, 1.0001, 0.005)
#: Swinging grains: amplitude [m], frequency [Hz], frames a cycle.
SWING, FRAMES = (24e-3, 6.0), 32
#: Grains and frequency [Hz] of the loss of a low heap.
LOSS_GRAINS, LOSS_HZ = 30, 50.0
#: Grains without gravity, frequency [Hz], amplitudes of the jump and beyond it [m].
PLUG_GRAINS, PLUG_HZ, JUMP, BEYOND = 40, 6.0, np.arange(17e-3, 27.1e-3, 1e-3), (24e-3, 30e-3)


def with_restitution(filling, value, **more):
    """A filling with one restitution for grains and walls."""
    return replace(filling, restitution=value, wall_restitution=value, **more)


def masri(filling, options):
    """One grain between two walls without gravity: RMS off that of the closed form."""
    ratios, found = options.grid[3], []
    for share, e, cells in itertools.product(*options.grid[:3]):
        mass = share * OWN.mass
        box = Grains(1, mass, CELL, CELL, (cells + 1) * CELL)
        grain = with_restitution(box.put_into(filling), e, gravity=0.0)
        run = {"transient_cycles": options.periods, "measured_cycles": 50, **SILENT}
        rms = ca.frequency_response(grain, particles=1, seeds=1, ratios=ratios, **run).rms[0, :, 0]
        for ratio, value in zip(ratios, rms):
            hertz = ratio * OWN.natural_frequency
            case = ca.ImpactDamper(OWN, mass, e, cells * CELL, hertz)
            stable = [u for u in case.speeds if case.is_stable(u)]
            if len(stable) == 1:
                found.append((case.rms(stable[0]), value))
    exact, ours = np.array(found).T
    off = 100.0 * np.abs(ours / exact - 1.0)
    values = {"masri_median_percent": np.median(off), "masri_worst_percent": off.max()}
    return values, None


def beam(filling, options):
    """Greatest specific damping capacity over acceleration and clearance: 2 mu E of a map."""
    levels = np.geomspace(*BEAM_G, options.levels)
    size = levels * GRAVITY / (2.0 * np.pi * BEAM_HZ) ** 2
    job = {"frequencies": BEAM_HZ, "particles": 30, "seeds": options.few, **SILENT}
    job |= {"transient_cycles": options.driven, "measured_cycles": options.driven}
    gaps = [CELL * cells for cells in options.gaps]
    made = ca.damper_map(filling, amplitudes=size, clearances=gaps, **job)
    capacity = 200.0 * BEAM_RATIO * made.energy[:, 0, :, 0].mean(axis=-1)
    return {"capacity_percent": capacity.max()}, (levels, capacity)


def open_boxes(filling, options):
    """Exponents of apparent mass and loss over acceleration in boxes without a lid."""
    levels = np.geomspace(*OPEN_G, 2 * options.levels)
    size = levels * GRAVITY / (2.0 * np.pi * OPEN_HZ) ** 2
    job = {"frequencies": OPEN_HZ, "seeds": options.few, **SILENT}
    job |= {"transient_cycles": options.driven, "measured_cycles": 3 * options.driven}
    values, drawn = {}, []
    for columns in options.columns:
        count = columns * LAYERS
        box = Grains(count, filling.particle_mass, CELL, columns * CELL, ROWS * CELL)
        made = ca.damper_map(box.put_into(filling), amplitudes=size, particles=count, **job)
        curves = {"mass": made.mass_share[0, 0, :, 0], "loss": made.loss[0, 0, :, 0]}
        curves = {name: one.mean(axis=-1) for name, one in curves.items()}
        drawn.append((levels, *curves.values()))
        for name, curve in curves.items():
            values[f"exponent_{name}_{columns}"] = exponent(levels, curve, FITS[name])
    return values, drawn


def exponent(level, values, ends):
    """Slope of log values over log levels between two of them."""
    used = (level >= ends[0]) & (level <= ends[1]) & (values > 0.0)
    if used.sum() < 4:
        return np.nan
    return np.polyfit(np.log(level[used]), np.log(values[used]), 1)[0]


def equal_mass(filling, options):
    """Spread of the peaks of fillings of one mass in a box that leaves them room."""
    peaks, base = [], 6e-3
    for count, e, friction in options.fillings:
        own = base / count
        size = diameter_of(own, DENSITY)
        columns, rows = int(60e-3 / size), int(96e-3 / size)
        box = Grains(count, own, size, columns * size, rows * size)
        rough = {"friction": friction, "wall_friction": friction}
        if isinstance(filling, ca.Automaton):
            rough = {"rules": ca.Place(**rough)}
        made = with_restitution(box.put_into(filling), e, **rough)
        run = {"transient_cycles": 2 * options.driven, "measured_cycles": options.driven // 2}
        job = {"particles": count, "ratios": EQUAL_RATIOS, "seeds": options.few, **SILENT}
        peaks.append(1e3 * float(ca.frequency_response(made, **job, **run).rms[0].mean(-1).max()))
    return {"spread_percent": 100.0 * (max(peaks) / min(peaks) - 1.0)}, None


def started(filling, seeds, particles, frequency, amplitude, **options):
    """A batch of all seeds of each scene in turn, started."""
    scenes = np.broadcast_arrays(np.atleast_1d(particles), frequency, amplitude)
    count, frequency, amplitude = (np.repeat(one, seeds) for one in scenes)
    seed = np.tile(np.arange(seeds) + 1, len(scenes[0]))
    table = ca.SceneTable(count, seed, filling.default_dt, frequency, amplitude)
    batch = ca.Batch(filling, table, **options)
    batch.start()
    return batch


def driven(filling, seeds, cycles, *scenes):
    """Cycles of containers that the base moves; cycles: before those measured, and these."""
    batch = started(filling, seeds, *scenes, mount="base", measured_cycles=cycles[1])
    return batch.run(*cycles)


def swing(filling, options):
    """Swing [mm] and lag of the mean height of grains in a container moved by +-24 mm at 6 Hz."""
    values = {}
    for count in options.swings:
        # Five grains meet seldom, and their seeds differ most.
        seeds, shots = (4 if count == 5 else 1) * options.seeds, []
        batch = started(filling, seeds, count, SWING[1], SWING[0], mount="base")
        batch.run(options.transient // 5, 0)
        steps = int(batch.steps_per_cycle[0])
        phase = np.arange(FRAMES) * (steps // FRAMES) / steps
        every = {"sample_every": steps, "frame_every": steps // FRAMES, **SILENT}
        for _ in range(options.filmed):
            shots += [cycle[:FRAMES] for cycle in ca.film(batch, steps, **every).frames]
        height = FilmMeasures.of(BoxSize.of(filling), shots, phase).mean_height_mm
        values[f"swing_mm_N{count}"], values[f"lag_deg_N{count}"] = first_harmonic(phase, height)
    return values, None


def heap(filling, options):
    """Loss c / (N m w) and apparent mass / (N m) of a low heap at 50 Hz: medians over the seeds."""
    values, omega = {}, 2.0 * np.pi * LOSS_HZ
    mass = LOSS_GRAINS * filling.particle_mass
    for level in (2, 5):
        scene = LOSS_GRAINS, LOSS_HZ, level * GRAVITY / omega**2
        made = driven(filling, options.seeds, (options.transient, 3 * options.cycles), *scene)
        values[f"loss_{level}g"] = np.median(made.apparent_damping / (mass * omega))
        values[f"mass_{level}g"] = np.median(made.apparent_mass / mass)
    return values, None


def plug(filling, options):
    """Energy a cycle over N m A^2 w^2 of grains without gravity, which gather to a plug."""
    sizes, seeds = np.concatenate([options.jump, BEYOND]), max(2, options.seeds // 2)
    grains, omega = replace(filling, gravity=0.0), 2.0 * np.pi * PLUG_HZ
    made = driven(grains, seeds, (30, 10), PLUG_GRAINS, PLUG_HZ, sizes)
    taken = (made.complex_power.real / PLUG_HZ).reshape(-1, seeds).mean(axis=1)
    energy = taken / (PLUG_GRAINS * filling.particle_mass * omega**2 * sizes**2)
    values = {f"plug_energy_{1e3 * size:.0f}mm": one for size, one in zip(BEYOND, energy[-2:])}
    return {"plug_jump_mm": jump_mm(options.jump, energy[:-2]), **values}, None


def jump_mm(amplitude, energy):
    """Least amplitude [mm] at which the energy passes half of its largest; linear between."""
    level = 0.5 * energy.max()
    k = int(np.argmax(energy > level))
    two = slice(max(0, k - 1), k + 1)
    return 1e3 * np.interp(level, energy[two], amplitude[two])


def peaks(filling, options):
    """Frequency ratio and RMS [mm] of the peak of the median over the seeds."""
    values, seeds = {}, 1 if filling.label == "dem" else max(1, options.seeds // 4)
    cycles = {"transient_cycles": options.transient, "measured_cycles": options.cycles}
    job = {"ratios": RATIOS, "seeds": seeds, **cycles, **SILENT}
    for count in options.peaks:
        response = ca.frequency_response(filling, particles=[count], **job)
        ratio, rms = peak(RATIOS, np.median(response.rms[0], axis=1))
        values[f"peak_ratio_N{count}"], values[f"peak_rms_mm_N{count}"] = ratio, 1e3 * rms
    return values, None


def lasting(filling, options):
    """Response of ten grains near resonance after a long time, over that after the transient."""
    measured = max(1, options.long // 8)
    where = 10, 0.985 * OWN.natural_frequency, OWN.base_amplitude
    batch = started(filling, min(4, options.seeds), *where, measured_cycles=measured)
    early = batch.run(options.transient, measured).rms.mean()
    late = batch.run(options.long - options.transient - 2 * measured, measured).rms.mean()
    return {"late_by_early_N10": late / early}, None


def impedance(filling, options):
    """Impedance over acceleration and frequency, an array by number of grains."""
    seeds, cycles = max(1, options.seeds // 4), (min(60, options.transient), options.cycles)
    gravity, frequency = np.meshgrid(options.accelerations, options.frequencies, indexing="ij")
    size = gravity * GRAVITY / (2.0 * np.pi * frequency) ** 2
    scenes = frequency.ravel(), size.ravel()
    made = [driven(filling, seeds, cycles, count, *scenes) for count in options.grains]
    return [one.impedance.reshape(*size.shape, seeds).mean(axis=-1) for one in made]


#: Functions of filling and options that give values by key and what is drawn: published cases.
PUBLISHED = (masri, beam, open_boxes, equal_mass)
#: Likewise cases in which the automata are compared with spheres.
COMPARED = (swing, heap, plug, peaks)
_HEAP, _PLUG = "N = 30, 50 Hz", "no gravity, N = 40, 6 Hz"
_OPEN = {"mass": ("-2", -2.5, -1.5), "loss": ("-1", -1.25, -0.75)}
#: Words, source, what is published, and the ends of what is wanted, by key.
WANTED = {
    "masri_median_percent": ("one grain, RMS off [%], median", "Masri 1970", "0", 0, 1),
    "masri_worst_percent": ("one grain, RMS off [%], worst", "Masri 1970", "0", 0, 5),
    "capacity_percent": (
        "beam with 6 % of grains: greatest specific damping capacity [%]",
        *("Friend & Kinra 2000", "about 50", 40, 60),
    ),
    **{
        f"exponent_{name}_{n}": (
            f"open box, columns: {n}: exponent of the {name} over acceleration",
            *("Ferreyra et al. 2021", *ends),
        )
        for n in COLUMNS
        for name, ends in _OPEN.items()
    },
    "spread_percent": (
        "fillings of one mass, best clearance: spread of the peaks [%]",
        *("Sanchez et al. 2012", "no dependence", 0, 10),
    ),
    "late_by_early_N10": ("N = 10 near resonance: late RMS by early", "it lasts", "1", 0.97, 1.03),
}
#: Words, and the distance from spheres that is wanted, as a number or as a share of theirs, by key.
NEAR = {
    **{
        f"{key}_N{n}": (f"N = {n}, +-24 mm, 6 Hz: {words} of the mean height", off, 0.0)
        for n, swing_off, lag_off in ((40, 1.0, 8.0), (20, 1.0, 8.0), (5, 4.2, 5.0))
        for key, words, off in (("swing_mm", "swing [mm]", swing_off), ("lag_deg", "lag", lag_off))
    },
    "loss_2g": (f"{_HEAP}, 2 g: loss c / (N m w)", 0.0, 0.10),
    "mass_2g": (f"{_HEAP}, 2 g: apparent mass / (N m)", 0.0, 0.15),
    "loss_5g": (f"{_HEAP}, 5 g: loss c / (N m w)", 0.0, 0.15),
    "mass_5g": (f"{_HEAP}, 5 g: apparent mass / (N m)", 0.05, 0.0),
    "plug_jump_mm": (f"{_PLUG}: amplitude of the jump [mm]", 0.0, 0.1),
    "plug_energy_24mm": (f"{_PLUG}: energy a cycle / (N m A^2 w^2) at 24 mm", 0.0, 0.15),
    "plug_energy_30mm": (f"{_PLUG}: energy a cycle / (N m A^2 w^2) at 30 mm", 0.0, 0.15),
    **{f"peak_ratio_N{n}": (f"N = {n}: peak at f / f0", 0.003, 0.0) for n in (30, 50)},
    **{f"peak_rms_mm_N{n}": (f"N = {n}: RMS at the peak [mm]", 0.0, 0.03) for n in (30, 50)},
}
