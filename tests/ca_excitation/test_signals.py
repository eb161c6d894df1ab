"""Signals on the host: splines, integrals, sweeps, spectra, files, and what is refused."""

import numpy as np
import pytest

from ca_damper import InputError, excitation
from ca_damper.excitation.signal import Signal, integral, spline
from taichi_dem.kit.elementary import sine_and_cosine, sines_and_cosines

OMEGA = 2.0 * np.pi * 3.0


def test_sines_of_arrays_have_the_bits_of_single_ones():
    angles = np.random.default_rng(1).uniform(-1e5, 1e5, 2000)
    single = np.array([sine_and_cosine(angle) for angle in angles.tolist()]).T
    assert np.array_equal(np.stack(sines_and_cosines(angles)), single)


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


def test_spline_is_exact_for_cubics_and_two_times_smooth():
    time = np.linspace(0.0, 2.0, 21)
    made, fine = spline(0.1, time**3 - time, "cubic"), np.linspace(0.0, 2.0, 301)
    assert made.at(fine)[0] == pytest.approx(fine**3 - fine, abs=1e-13)
    rough = spline(0.1, np.random.default_rng(2).normal(size=21), "rough")
    left, right = (rough.at(time[1:-1] + shift) for shift in (-1e-9, 1e-9))
    for before, after, scale in zip(left, right, (1.0, 10.0, 1000.0)):
        assert before == pytest.approx(after, abs=1e-5 * scale)


@pytest.mark.parametrize("count", [4, 5, 6])
def test_few_nodes_make_a_spline_too(count):
    time = np.arange(count) * 0.5
    assert spline(0.5, time**2, "few").bend == pytest.approx(2.0 * np.ones(count))


def test_an_acceleration_is_integrated_exactly_between_its_samples():
    time = np.linspace(0.0, 1.0, 11)
    made, fine = integral(0.1, 6.0 * time, "ramp"), np.linspace(0.0, 1.0, 99)
    value, slope, bend = made.at(fine)
    assert value == pytest.approx(fine**3, abs=1e-15)
    assert slope == pytest.approx(3.0 * fine**2, abs=1e-14)
    assert bend == pytest.approx(6.0 * fine, abs=1e-14)


def test_a_corrected_baseline_ends_at_rest_where_it_began():
    time = np.arange(0.0, 4.0, 0.01)
    pull = np.sin(OMEGA * time) + 0.05 + 0.02 * time
    raw = excitation.from_samples(time, pull, of="acceleration")
    made = excitation.from_samples(time, pull, of="acceleration", correct_baseline=True)
    assert abs(raw.value[-1]) > 0.3
    value, slope, _ = made.at(np.array([made.duration]))
    assert abs(value[0]) < 1e-12 and abs(slope[0]) < 1e-12
    # Taken away is a line.
    assert np.diff(raw.bend - made.bend, 2) == pytest.approx(0.0, abs=1e-12)


def test_amplitudes_of_an_acceleration():
    motion = excitation.sines([3.0, 5.0], [2.0, 1.0], 2.0, of="acceleration")
    time = np.linspace(0.3, 1.7, 400)
    wanted = 2.0 * np.sin(2 * np.pi * 3 * time) + np.sin(2 * np.pi * 5 * time)
    # The second derivative of a spline with h between nodes is off by (w h)^2 / 12.
    assert motion.at(time)[2] == pytest.approx(wanted, abs=3.0 * 0.0025)


@pytest.mark.parametrize("way", ["linear", "logarithmic"])
@pytest.mark.parametrize("ends", [(2.0, 20.0), (20.0, 2.0)])
def test_a_sweep_passes_each_frequency_at_its_time(way, ends):
    low, high = ends
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


def test_a_sweep_of_one_frequency_is_a_sine():
    made = excitation.sweep(5.0, 5.0, 1e-3, 1.0, way="logarithmic")
    assert made.value == pytest.approx(excitation.sines(5.0, 1e-3, 1.0).value, abs=1e-17)


def test_random_vibration_has_the_density_asked_for():
    """White between 5 and 40 Hz: the mean square is the integral, exactly over the period."""
    made = excitation.random_vibration([5.0, 40.0], [2e-6, 2e-6], 20.0, of="value", seed=4)
    lines = np.floor(40.0 * 20.0 + 1e-9) - np.ceil(5.0 * 20.0 - 1e-9) + 1
    assert (made.value[:-1] ** 2).mean() == pytest.approx(2e-6 * lines / 20.0, rel=1e-12)
    spectrum = np.abs(np.fft.rfft(made.value[:-1])) ** 2
    inside = np.flatnonzero(spectrum > 1e-9 * spectrum.max()) / 20.0
    assert inside.min() == pytest.approx(5.0) and inside.max() == pytest.approx(40.0)
    again = excitation.random_vibration([5.0, 40.0], [2e-6, 2e-6], 20.0, of="value", seed=5)
    assert not np.array_equal(made.value, again.value)


def test_a_density_of_acceleration_falls_as_a_straight_line_in_logarithms():
    made = excitation.random_vibration([10.0, 40.0], [1.0, 0.25], 50.0, seed=2)
    count = len(made.value) - 1
    spectrum = 2.0 / 50.0 * np.abs(np.fft.rfft(made.value[:-1]) * 50.0 / count) ** 2
    frequency = np.fft.rfftfreq(count, made.step)
    for wanted, at in ((1.0, 10.0), (0.5, 20.0), (0.25, 40.0)):
        k = np.argmin(abs(frequency - at))
        assert spectrum[k] * (2 * np.pi * frequency[k]) ** 4 == pytest.approx(wanted, rel=1e-6)


HEAD = "# a record\ntime_s,displacement_mm\n"
GOOD = [(0.01 * k, np.sin(0.1 * k)) for k in range(200)]


def written(path, rows, head=HEAD):
    path.write_text(head + "\n".join(",".join(map(str, row)) for row in rows) + "\n")
    return path


def test_a_file_is_read_by_the_units_of_its_columns(tmp_path):
    made = excitation.from_csv(written(tmp_path / "a.csv", GOOD))
    assert made.step == pytest.approx(0.01) and len(made.value) == 200
    assert made.value == pytest.approx([1e-3 * y for _, y in GOOD])
    head = "time_ms,displacement_m,acceleration_g\n"
    rows = [(1e3 * t, y, y) for t, y in GOOD]
    both = written(tmp_path / "b.csv", rows, head)
    pull = excitation.from_csv(both, "acceleration_g")
    assert pull.bend == pytest.approx([9.80665 * y for _, y in GOOD])
    with pytest.raises(InputError, match="column must say which"):
        excitation.from_csv(both)


def changed(k, row):
    return [*GOOD[:k], row, *GOOD[k + 1 :]]


NOISE = np.random.default_rng(3).normal(size=200)
BAD_FILES = [
    (changed(50, (0.5, "nan")), "finite number in column displacement_mm of line 53, got 'nan'"),
    (changed(50, (0.5, "")), "of line 53, got ''"),
    (changed(50, ("soon", 0.3)), "in column time_s of line 53, got 'soon'"),
    (changed(50, (0.485, 0.3)), "times must ascend, got 0.485 s after 0.49 s in sample 51"),
    (GOOD[:50] + GOOD[55:], "no gaps in steps of 0.01 s, got 0.55 s after 0.49 s in sample 51"),
    (changed(50, (0.5015, 0.3)), "even to 0.1 of their step of 0.01 s, got 0.5015 s"),
    ([(t, y) for (t, _), y in zip(GOOD, NOISE)], "step of the samples must be at most 0.00"),
    (GOOD[:3], "at least 4 samples, got 3"),
]


@pytest.mark.parametrize(("rows", "words"), BAD_FILES)
def test_a_file_that_cannot_be_a_motion_is_refused(tmp_path, rows, words):
    with pytest.raises(InputError, match=r"motion\.csv") as error:
        excitation.from_csv(written(tmp_path / "motion.csv", rows))
    assert words in str(error.value) and "\n" not in str(error.value)


HEADS = [
    ("time_s,displacement\n", "a column of displacement_m, displacement_mm"),
    ("displacement_m,x\n", "one column of time_s or time_ms"),
    ("", "a column of"),
]


@pytest.mark.parametrize(("head", "words"), HEADS)
def test_a_file_without_names_of_columns_is_refused(tmp_path, head, words):
    with pytest.raises(InputError, match=words):
        excitation.from_csv(written(tmp_path / "motion.csv", GOOD, head))


def test_a_file_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match="CSV file that can be read"):
        excitation.from_csv(tmp_path / "nowhere.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="CSV file that can be read"):
        excitation.from_csv(tmp_path / "b.csv")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: excitation.sines(5.0, 1.0, 1.0, step=0.06), "step must be at most 0.05 s"),
        (lambda: excitation.sines([5.0, 6.0], [1.0] * 3, 1.0), "one or as many"),
        (lambda: excitation.sines(-5.0, 1.0, 1.0), "frequencies must be"),
        (lambda: excitation.sines(5.0, np.nan, 1.0), "amplitudes must be"),
        (lambda: excitation.sines(5.0, 1.0, 1e9), "duration must be at most"),
        (lambda: excitation.sweep(1.0, 2.0, 1.0, 1.0, way="square"), "way must be one of"),
        (lambda: excitation.random_vibration([5.0], [1.0], 1.0), "frequencies must ascend"),
        (lambda: excitation.random_vibration([5.1, 5.2], [1, 1], 1.0), "duration must be at least"),
        (lambda: excitation.SineForce(1.0, 0.0), "frequency must be positive"),
        (lambda: excitation.SineForce("big", 1.0), "amplitude must be"),
        (lambda: excitation.Excitation(base=3.0), "base must be a Signal"),
        (lambda: excitation.Excitation(force=[3.0]), "force must hold Signals"),
        (lambda: Signal(0.1, np.zeros(5), np.zeros(6)), "as many nodes"),
        (lambda: Signal(0.1, [0, 1, np.inf, 0], np.zeros(4)), "got inf at node 2"),
        (lambda: excitation.from_samples([0, 1, 2, 3], [0, 1, 2]), "values must be"),
        (lambda: excitation.sines(5.0, 1.0, 1.0).scaled(np.nan), "factor must be"),
    ],
)
def test_excitations_that_mean_nothing_are_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
