"""Signals are what was asked for: order of splines, integrals, sweeps, spectra, files."""

import contextlib

import numpy as np
import pytest

from ca_damper import Batch, InputError, Oscillator, RigidMass, SceneTable, excitation
from ca_damper.excitation.signal import integral, spline

OMEGA = 2.0 * np.pi * 3.0


def test_spline_converges_with_the_orders_four_three_and_two():
    errors = []
    for count in (40, 80, 160):
        time = np.linspace(0.0, 1.0, count + 1)
        made, fine = spline(time[1], np.sin(OMEGA * time), "s"), np.linspace(0.2, 0.8, 997)
        exact = (
            np.sin(OMEGA * fine),
            OMEGA * np.cos(OMEGA * fine),
            -(OMEGA**2) * np.sin(OMEGA * fine),
        )
        errors.append([np.abs(a - b).max() for a, b in zip(made.at(fine), exact)])
    ratios = np.array(errors[:-1]) / errors[1:]
    for order, ratio in zip((4, 3, 2), ratios.T):
        assert ratio == pytest.approx(2.0**order, rel=0.12), order


def test_an_acceleration_is_integrated_exactly_between_its_samples():
    time = np.linspace(0.0, 1.0, 11)
    made, fine = integral(0.1, 6.0 * time, "ramp"), np.linspace(0.0, 1.0, 99)
    value, slope, bend = made.at(fine)
    assert value == pytest.approx(fine**3, abs=1e-15)
    assert slope == pytest.approx(3.0 * fine**2, abs=1e-14)
    assert bend == pytest.approx(6.0 * fine, abs=1e-14)


def test_a_corrected_baseline_ends_at_rest_where_it_began_and_is_told():
    time = np.arange(0.0, 4.0, 0.01)
    pull = np.sin(OMEGA * time) + 0.05 + 0.02 * time
    raw = excitation.from_samples(time, pull, of="acceleration")
    made = excitation.from_samples(time, pull, of="acceleration", correct_baseline=True)
    assert abs(raw.value[-1]) > 0.3
    value, slope, _ = made.at(np.array([made.duration]))
    assert abs(value[0]) < 1e-12 and abs(slope[0]) < 1e-12
    # Taken away is a line.
    assert np.diff(raw.bend - made.bend, 2) == pytest.approx(0.0, abs=1e-12)
    assert "without a base line correction" in raw.in_words("m")
    assert "less a base line of acceleration" in made.in_words("m")


@pytest.mark.parametrize("way", ["linear", "logarithmic"])
def test_a_sweep_passes_each_frequency_at_its_time(way):
    low, high = 20.0, 2.0
    motion, total = excitation.sweep(low, high, 1e-3, 20.0, way=way), 20.0
    for share in (0.1, 0.5, 0.9):
        wanted = low + share * (high - low) if way == "linear" else low * (high / low) ** share
        near = share * total + np.linspace(-2.0, 2.0, 20001) / wanted
        value = motion.at(near)[0]
        crossings = near[1:][(value[:-1] < 0.0) & (value[1:] >= 0.0)]
        middle = np.argmin(abs(crossings - share * total))
        cycle = np.diff(crossings)[min(middle, len(crossings) - 2)]
        assert 1.0 / cycle == pytest.approx(wanted, rel=0.12)
    assert np.abs(motion.value).max() == pytest.approx(1e-3, rel=1e-3)


def test_random_vibration_has_the_density_asked_for():
    """White between 5 and 40 Hz: the mean square is the integral, exactly over the period."""
    made = excitation.random_vibration([5.0, 40.0], [2e-6, 2e-6], 20.0, of="value", seed=4)
    lines = np.floor(40.0 * 20.0 + 1e-9) - np.ceil(5.0 * 20.0 - 1e-9) + 1
    assert (made.value[:-1] ** 2).mean() == pytest.approx(2e-6 * lines / 20.0, rel=1e-12)


GOOD = [(0.01 * k, np.sin(0.1 * k)) for k in range(200)]


def written(path, rows, head="time_s,displacement_mm\n"):
    path.write_text(head + "\n".join(",".join(map(str, row)) for row in rows) + "\n")
    return path


def test_a_file_is_read_by_the_units_of_its_columns(tmp_path):
    made = excitation.from_csv(written(tmp_path / "a.csv", GOOD))
    assert made.step == pytest.approx(0.01) and len(made.value) == 200
    assert made.value == pytest.approx([1e-3 * y for _, y in GOOD])
    head = "time_ms,displacement_m,acceleration_g\n"
    both = written(tmp_path / "b.csv", [(1e3 * t, y, y) for t, y in GOOD], head)
    pull = excitation.from_csv(both, "acceleration_g")
    time, wanted = np.array(GOOD).T
    # h^2 / 12 of the second derivative at nodes an eighth apart is added: (0.1 / 8)^2 / 12.
    assert pull.at(time)[2] == pytest.approx(9.80665 * wanted, rel=1e-4, abs=1e-6)
    with pytest.raises(InputError, match="column must say which"):
        excitation.from_csv(both)


#: Lines above the numbers: what separates cells, decimals, SI units in 1, and what has to be given.
HEADS = {
    "Time (s)\tAcc (g)": ("\t", ".", 9.80665, {}),
    "time [s];acceleration [m/s²]": (";", ",", 1.0, {}),
    "t;a (cm/s^2)": (";", ".", 1e-2, {}),
    "Time_s,acc_gal": (",", ".", 1e-2, {}),
    "t,ax": (",", ".", 9.80665, {"unit": "g"}),
    "t,ax ": (",", ".", 1e-3, {"column": "ax", "unit": "mm/s²"}),
    "time_s,acc_x_g": (",", ".", 9.80665, {}),
    "Time,Acceleration X (g)": (",", ".", 9.80665, {}),
    "Zeit [s];Beschleunigung [m/s²]": (";", ",", 1.0, {}),
    "# time_s,acceleration_g": (",", ".", 9.80665, {}),
    "Time,Acc Z\ns,m/s2": (",", ".", 1.0, {}),
    "Zeit\tKanal 1\n[s]\t[mg]": ("\t", ",", 9.80665e-3, {}),
    "Logger 7, made 3 May\n\nrate;100 Hz\nt;a_m_s2\n# checked; twice": (";", ".", 1.0, {}),
    "time_s,acc_m_s2": (",", ".", 9.80665, {"unit": "g"}),
    'time_s,"Acceleration, X (g)"': (",", ".", 9.80665, {}),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("head", HEADS)
def test_records_of_many_makes_are_one_acceleration(tmp_path, head, encoding):
    """The same bits as by samples. What is given counts in place of what the file says."""
    between, point, factor, given = HEADS[head]
    rows = [between.join(f"{x:.6f}".replace(".", point) for x in pair) for pair in GOOD]
    path = tmp_path / "record.txt"
    path.write_text("\n".join([head, *rows]), encoding=encoding)
    time, values = (np.array([float(f"{x:.6f}") for x in column]) for column in zip(*GOOD))
    wanted = excitation.from_samples(time, factor * values, of="acceleration")
    assert np.array_equal(excitation.from_csv(path, **given).value, wanted.value)


def test_a_time_without_a_name_is_the_first_column_which_is_told(tmp_path):
    named, other = (
        excitation.from_csv(written(tmp_path / "a.csv", GOOD, f"{head},acc_g\n"))
        for head in ("t", "Temps")
    )
    assert np.array_equal(named.value, other.value)
    assert "first column" in other.treated and "first column" not in named.treated


def test_a_unit_that_the_header_lacks_is_asked_for(tmp_path):
    path = written(tmp_path / "bare.csv", GOOD, "time,acc\n")
    with pytest.raises(InputError, match=r"unit must be one of .* for column acc of .* got None"):
        excitation.from_csv(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must be a file of columns"),
        ("time_s,acc_g\n", "must be a file of columns"),
        ("time_s,acc_g\n0.0,1.0\n0.1,\n", r"must hold a finite number in acc_g of row 2, got ''"),
        ("time_s,acc_g\n0.0,1.0\n0.1,one\n", "finite number in acc_g of row 2, got 'one'"),
        ("time_s,acc_g\n0.0,1.0\n0.1,1.0,2.0\n", "must be a file of columns"),
    ],
)
def test_a_file_without_numbers_is_refused_in_a_sentence(tmp_path, text, words):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        excitation.from_csv(tmp_path / "bad.csv")


def with_gaps(step=0.01, count=400):
    """A sine of 3 Hz at uneven times, without some of its samples."""
    kept = np.delete(np.arange(count), [*range(50, 54), *range(200, 202)])
    time = step * kept
    return time, np.sin(OMEGA * time)


def test_a_gap_is_bridged_by_a_cubic_and_each_is_named():
    """A cubic spline is off by 5/384 of (w h)^4 at most, h the longest step (Hall 1968)."""
    time, values = with_gaps()
    made = excitation.from_samples(time, values, resample=0.01)
    fine = made.step * np.arange(len(made.value))
    off = np.abs(made.value - np.sin(OMEGA * fine))
    assert made.step == pytest.approx(0.01) and made.gap == pytest.approx(0.05)
    assert off.max() < 5.0 / 384.0 * (0.05 * OMEGA) ** 4
    assert off[100:150].max() < 5.0 / 384.0 * (0.01 * OMEGA) ** 4
    assert all(one in made.treated for one in ("0.05 s after 0.49 s", "0.03 s after 1.99 s"))
    for wrong in (0.02, 0.0, 1e-12):
        with pytest.raises(InputError, match=r"^resample must be a number from .* to 0.01, got"):
            excitation.from_samples(time, values, resample=wrong)
    with pytest.raises(InputError, match=r"times must ascend, got 0.48 s after 0.49 s in"):
        excitation.from_samples(
            np.insert(time, 50, 0.48), np.insert(values, 50, 0.0), resample=0.01
        )


@pytest.mark.parametrize(("frequency", "holds"), [(4.9, True), (5.1, False)])
def test_a_gap_longer_than_a_quarter_of_the_period_is_refused(frequency, holds):
    """0.05 s are a quarter at 5 Hz."""
    motion = excitation.from_samples(*with_gaps(), resample=0.01)
    stiffness = Oscillator().mass * (2.0 * np.pi * frequency) ** 2
    table = SceneTable(0, 1, 1e-3, 1.0, 0.0, Oscillator().mass, stiffness)
    refused = pytest.raises(InputError, match=r"gaps of the base must be at most .* got 0.05\d* s")
    with contextlib.nullcontext() if holds else refused:
        Batch(RigidMass(), table, excitation=motion)


def test_a_high_pass_has_the_gain_of_butterworth_both_ways_and_keeps_phases():
    """1 / (1 + (tan(pi c h) / tan(pi f h))^4), c the given frequency, by the bilinear rule.

    Cosines that end on crests go on as themselves in the mirror, where the filter forgets three
    cycles of c away by exp(-sqrt(2) pi c t).
    """
    step, edge = 0.01, 0.5
    time, wanted, samples = step * np.arange(4001), 0.0, 3.0
    for hertz in (0.25, 2.0):
        wave = np.cos(2.0 * np.pi * hertz * time)
        ratio = np.tan(np.pi * edge * step) / np.tan(np.pi * hertz * step)
        wanted, samples = wanted + wave / (1.0 + ratio**4), samples + wave
    made = excitation.from_samples(time, samples, highpass=edge)
    assert made.value == pytest.approx(wanted, abs=4.0 * np.exp(-3.0 * np.sqrt(2.0) * np.pi))
    assert "high-pass" in made.in_words("m")
    for wrong in (0.02, 25.1, "low"):
        with pytest.raises(InputError, match=r"^highpass must be a number from 0.025 to 25, got"):
            excitation.from_samples(time, samples, highpass=wrong)


@pytest.mark.parametrize("head", ["NPTS=   200, DT=   .0100 SEC", "  200   .0100  NPTS, DT"])
def test_a_peer_record_is_an_acceleration_in_g(tmp_path, head):
    values = [f"{y:.7E}" for _, y in GOOD]
    lines = [" ".join(values[k : k + 5]) for k in range(0, 200, 5)]
    path = tmp_path / "RSN1.AT2"
    title = ["PEER NGA", "EVENT", "ACCELERATION TIME SERIES IN UNITS OF G"]
    path.write_text("\n".join([*title, head, *lines]))
    numbers = 9.80665 * np.array([float(one) for one in values])
    wanted = excitation.from_samples(0.01 * np.arange(200), numbers, of="acceleration")
    assert np.array_equal(excitation.from_at2(path).value, wanted.value)
    path.write_text("\n".join([*title, head, *lines[:-1]]))
    with pytest.raises(InputError, match="must hold 200 samples, as it says, got 195"):
        excitation.from_at2(path)


def test_a_velocity_is_integrated_with_the_order_of_its_spline():
    """v = cos w t: x = sin(w t) / w. Errors of order four count in the cells at the ends alone.

    Inside they cancel in the integral. So halving the step leaves a thirty-second.
    """
    errors = []
    for count in (80, 160):
        time = np.linspace(0.0, 1.0, count + 1)
        made = excitation.from_samples(time, np.cos(OMEGA * time), of="velocity")
        errors.append(np.abs(made.at(time)[0] - np.sin(OMEGA * time) / OMEGA).max())
    assert errors[0] / errors[1] == pytest.approx(32.0, rel=0.1)


def test_samples_that_are_too_few_or_uneven_are_refused():
    """Power at 20 Hz is too much for samples 20 ms apart."""
    time = np.arange(0.0, 4.0, 0.02)
    with pytest.raises(InputError, match=r"step of the samples must be at most .* got 0.02"):
        excitation.from_samples(time, np.sin(2.0 * np.pi * 20.0 * time), of="acceleration")
    uneven = time + 3e-3 * np.sin(7.0 * np.pi * time)
    with pytest.raises(InputError, match="times must ascend evenly"):
        excitation.from_samples(uneven, np.sin(OMEGA * uneven))
