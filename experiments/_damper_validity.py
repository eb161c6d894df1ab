"""Cases of damper_validity.py: what is measured in each, and the range that is wanted."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

import ca_damper as ca
from ca_damper.plot.boxes import Box
from ca_damper.plot.curves import FilmMeasures
from ca_damper.report.measures import first_harmonic, peak

#: Amplitudes between which the jump of the plug is sought [m].
JUMP = np.arange(17e-3, 27.1e-3, 1e-3)
#: Fillings by column of the table: spheres, rules of the first edition, of place; steps [s].
FILLINGS = {
    "dem": (ca.Spheres(), 2e-5),
    "paper": (ca.Automaton(rules="paper"), 1e-4),
    "place": (ca.Automaton(), 1e-4),
}
#: Swinging grains: amplitude [m], frequency [Hz], frames a cycle.
SWING, FRAMES = (24e-3, 6.0), 32
#: Numbers of grains that swing, with the gap, swing and lag that are wanted [mm, mm, degrees]: of
#: five grains the gap bounds the swing too.
SWINGS = {40: (2.5, 1.0, 8.0), 20: (2.5, 1.0, 8.0), 5: (3.0, 4.2, 5.0)}
MEASURED = {"gap_mm": "RMS gap", "swing_mm": "swing", "lag_deg": "lag"}
#: Share of the container's mass of the impact damper's grain, clearance in cells.
IMPACT_SHARE, IMPACT_CELLS = 0.1, 2
#: Grains and frequency [Hz] of the loss, gravity that accelerations are multiples of [m/s^2].
LOSS_GRAINS, LOSS_FREQUENCY, STANDARD_GRAVITY = 30, 50.0, 9.81
#: Ranges of loss and apparent mass by acceleration [g], as shares of those of spheres.
LOSS = {2.0: (0.10, 0.15), 5.0: (0.15, None)}
#: Grains without gravity, frequency [Hz], and further amplitudes [m].
PLUG_GRAINS, PLUG_FREQUENCY, BEYOND = 40, 6.0, (16e-3, 20e-3, 24e-3, 30e-3)
#: Frequencies f/f0 among which peaks are sought.
RATIOS = np.arange(0.93, 1.0001, 0.005)
OWN = ca.Oscillator()


class Effort(NamedTuple):
    """What is spent: seeds, cycles left out, cycles measured; batches and reports made so far."""

    seeds: int
    transient: int
    cycles: int
    made: list

    def batch(self, filling, dt, particles, frequency, amplitude, **options):
        """A batch of all seeds of each scene in turn, started."""
        scenes = np.broadcast_arrays(np.atleast_1d(particles), frequency, amplitude)
        count, frequency, amplitude = (np.repeat(one, self.seeds) for one in scenes)
        seed = np.tile(np.arange(self.seeds) + 1, len(scenes[0]))
        batch = ca.Batch(filling, ca.SceneTable(count, seed, dt, frequency, amplitude), **options)
        self.made.append(batch)
        batch.start()
        return batch

    def driven(self, filling, dt, particles, frequency, amplitude):
        """Cycles of containers that are moved with an amplitude [m] and frequency [Hz]."""
        scenes = filling, dt, particles, frequency, amplitude
        batch = self.batch(*scenes, mount="base", measured_cycles=self.cycles)
        return batch.run(self.transient, self.cycles)

    def by_scene(self, values):
        """Mean over the seeds."""
        return values.reshape(-1, self.seeds).mean(axis=1)


def row_of(key, words, unit, values, low, high):
    """A row of the table: values by spheres or exact, by both rules, and the range wanted."""
    names = "key words unit exact paper place low high".split()
    row = dict(zip(names, (key, words, unit, *map(float, values), low, high)))
    return {**row, "met": bool(low <= row["place"] <= high)}


def by_filling(measure, *names):
    """A measure of a filling and its step by names of fillings, all by default."""
    return [measure(*FILLINGS[name]) for name in names or FILLINGS]


def swing_rows(options, effort):
    """Mean height of the grains in a container that moves by +-24 mm at 6 Hz."""

    def height(filling, dt):
        """Phases, and mean height of the grains [mm]."""
        batch, shots = spent.batch(filling, dt, count, SWING[1], SWING[0], mount="base"), []
        batch.run(spent.transient, 0)
        steps = int(batch.steps_per_cycle[0])
        phase = np.arange(FRAMES) * (steps // FRAMES) / steps
        every = {"sample_every": steps, "frame_every": steps // FRAMES, "progress": None}
        for _ in range(options.filmed):
            shots += [cycle[:FRAMES] for cycle in ca.film(batch, steps, **every).frames]
        return phase, FilmMeasures.of(Box.of(filling), shots, phase).mean_height_mm

    for count in options.swings:
        # Five grains meet seldom, and their seeds differ most.
        seeds = (4 if count == 5 else 1) * effort.seeds
        spent, apart = effort._replace(seeds=seeds, transient=effort.transient // 5), []
        exact, *curves = by_filling(height)
        base = first_harmonic(*exact)
        for curve in curves:
            swing, lag = first_harmonic(*curve)
            gap = np.sqrt(((curve[1] - exact[1]) ** 2).mean())
            apart.append((gap, swing - base[0], (lag - base[1] + 180.0) % 360.0 - 180.0))
        for (key, words), most, *both in zip(MEASURED.items(), SWINGS[count], *apart):
            title = f"N = {count}, +-24 mm, 6 Hz: {words} of the mean height, less that of spheres"
            low = 0.0 if key == "gap_mm" else -most
            yield row_of(f"{key}_N{count}", title, key.split("_")[1], (0.0, *both), low, most)


def impact_rows(options, effort):
    """The impact damper, for which there is a closed form."""
    mass, where = IMPACT_SHARE * OWN.mass, (OWN.natural_frequency, OWN.base_amplitude)
    box = {"columns": 1, "rows": IMPACT_CELLS + 1, "gravity": 0.0, "particle_mass": mass}

    def impact(filling, dt):
        batch = effort._replace(seeds=1).batch(
            replace(filling, **box), dt, 1, *where, measured_cycles=50
        )
        return 1e3 * batch.run(400, 50).rms[0]

    own = FILLINGS["place"][0]
    case = ca.ImpactDamper(OWN, mass, own.wall_restitution, IMPACT_CELLS * own.width, where[0])
    values = 1e3 * case.rms(max(case.speeds)), *by_filling(impact, "paper", "place")
    title = "impact damper, 0.1 M, clearance 12 mm, no gravity, at f0: RMS"
    yield row_of("impact_rms_mm", title, "mm", values, 1.04, 1.10)


def loss_rows(options, effort):
    """Loss c / (N m w) and apparent mass / (N m) of a low heap that is shaken at 50 Hz."""
    spent, omega = effort._replace(cycles=3 * effort.cycles), 2.0 * np.pi * LOSS_FREQUENCY

    def loss_and_mass(filling, dt):
        """Medians over the seeds: a heap has several motions at 5 g."""
        size = gravity * STANDARD_GRAVITY / omega**2
        cycles = spent.driven(filling, dt, LOSS_GRAINS, LOSS_FREQUENCY, size)
        mass = LOSS_GRAINS * filling.particle_mass
        loss = cycles.apparent_damping / (mass * omega)
        return np.median(loss), np.median(cycles.apparent_mass / mass)

    for gravity, (share, mass_share) in LOSS.items():
        loss, mass = zip(*by_filling(loss_and_mass))
        key, title, off = f"{gravity:.0f}g", f"N = 30, 50 Hz, {gravity:.0f} g", share * loss[0]
        words = f"{title}: loss c / (N m w)"
        yield row_of(f"loss_{key}", words, "1", loss, loss[0] - off, loss[0] + off)
        off, words = mass_share * mass[0] if mass_share else 0.05, f"{title}: apparent mass / (N m)"
        yield row_of(f"mass_{key}", words, "1", mass, mass[0] - off, mass[0] + off)


def plug_rows(options, effort):
    """Energy of grains without gravity, which gather to a plug from some amplitude on."""
    seeds = max(2, effort.seeds // 2)
    spent, count = effort._replace(seeds=seeds, transient=30, cycles=10), len(options.jump)
    sizes = np.concatenate([options.jump, BEYOND])

    def energy(filling, dt):
        """Energy a cycle over N m A^2 w^2."""
        grains, omega = replace(filling, gravity=0.0), 2.0 * np.pi * PLUG_FREQUENCY
        cycles = spent.driven(grains, dt, PLUG_GRAINS, PLUG_FREQUENCY, sizes)
        taken = spent.by_scene(cycles.complex_power.real / PLUG_FREQUENCY)
        return taken / (PLUG_GRAINS * filling.particle_mass * omega**2 * sizes**2)

    found = by_filling(energy)
    jump, title = [jump_mm(options.jump, one[:count]) for one in found], "no gravity, N = 40, 6 Hz"
    words = f"{title}: amplitude of the jump"
    yield row_of("plug_jump_mm", words, "mm", jump, 0.9 * jump[0], 1.1 * jump[0])
    for k, size in enumerate(BEYOND, start=count):
        values, millimetres = [one[k] for one in found], round(1e3 * size)
        # Before the jump grains take little, and how little is not asked for.
        limits = (0.85 * values[0], 1.15 * values[0]) if size > 22e-3 else (0.0, 1.0)
        words = f"{title}: energy a cycle / (N m A^2 w^2) at {millimetres} mm"
        yield row_of(f"plug_energy_{millimetres}mm", words, "1", values, *map(float, limits))


def jump_mm(amplitude, energy):
    """Least amplitude [mm] at which the energy passes half of its largest; linear between."""
    level = 0.5 * energy.max()
    k = int(np.argmax(energy > level))
    return 1e3 * float(
        np.interp(level, energy[max(0, k - 1) : k + 1], amplitude[max(0, k - 1) : k + 1])
    )


def peak_rows(options, effort):
    """Peaks of the damped structure."""

    def peak_of(filling, dt):
        """Frequency ratio and RMS [mm] of the peak of the median over the seeds."""
        seeds = 1 if filling.label == "dem" else max(1, effort.seeds // 4)
        cycles = {"transient_cycles": effort.transient, "measured_cycles": effort.cycles}
        job = {"particles": [count], "ratios": RATIOS, "seeds": seeds, "dt": dt, "progress": None}
        response = ca.frequency_response(filling, **job, **cycles)
        effort.made.append(response.report)
        ratio, rms = peak(RATIOS, np.median(response.rms[0], axis=1))
        return ratio, 1e3 * rms

    for count in options.peaks:
        ratio, rms = zip(*by_filling(peak_of))
        words = f"N = {count}: peak at f / f0"
        yield row_of(f"peak_ratio_N{count}", words, "1", ratio, ratio[0] - 0.003, ratio[0] + 0.003)
        words = f"N = {count}: RMS at the peak"
        yield row_of(f"peak_rms_mm_N{count}", words, "mm", rms, 0.97 * rms[0], 1.03 * rms[0])


def lasting_rows(options, effort):
    """Whether a motion goes on: the response after a long time, over that after the transient."""
    spent, measured = effort._replace(seeds=min(4, effort.seeds)), max(1, options.long // 8)
    where = 0.985 * OWN.natural_frequency, OWN.base_amplitude

    def late_by_early(filling, dt):
        batch = spent.batch(filling, dt, 10, *where, measured_cycles=measured)
        early = batch.run(spent.transient, measured).rms.mean()
        late = batch.run(options.long - spent.transient - 2 * measured, measured).rms.mean()
        return late / early

    values = 1.0, *by_filling(late_by_early, "paper", "place")
    title = f"N = 10 near resonance: RMS after {options.long} cycles / that after {spent.transient}"
    yield row_of("late_by_early_N10", title, "1", values, 0.97, 1.03)


def trust_of(options, effort):
    """Share by which the impedance differs from that of spheres: arrays by grains and rules."""
    few = {"seeds": max(1, effort.seeds // 4), "transient": min(60, effort.transient)}
    spent, found = effort._replace(**few), {}
    gravity, frequency = np.meshgrid(options.accelerations, options.frequencies, indexing="ij")
    size = gravity * STANDARD_GRAVITY / (2.0 * np.pi * frequency) ** 2
    for count in options.grains:

        def impedance(filling, dt, count=count):
            cycles = spent.driven(filling, dt, count, frequency.ravel(), size.ravel())
            return spent.by_scene(cycles.impedance).reshape(size.shape)

        exact, *others = by_filling(impedance)
        for name, one in zip(("paper", "place"), others):
            found[count, name] = abs(one - exact) / abs(exact)
    return found


#: Functions of options and effort that yield rows of the table.
PARTS = (swing_rows, impact_rows, loss_rows, plug_rows, peak_rows, lasting_rows)
