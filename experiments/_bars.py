"""Waves in bars: motion of slices, diagrams over place and time, film of a bar that breaks."""

import matplotlib
import numpy as np

from _films import moving_picture
from taichi_dem.kit.plot_style import BLACK, GREEN, ORANGE, RED

#: Below zero, at zero, above: pressed, at rest, pulled.
_COLOURS = "RdBu_r"


class Profile:
    """Observer that keeps the mean motion of slices of bodies, and the joints between them.

    when: of its looks. slices: numbers of the bodies of every slice, (..., slices, bodies each),
    along one bar or several. axis: of the motion, 0 for x.

    Afterwards: time (looks,) [s]; displacement [m] and velocity [m/s] along the axis, (looks, ...,
    slices); joints: whether all bonds between a slice and the next have broken, (looks, ...,
    slices - 1), not so where no bond is.
    """

    def __init__(self, when, slices, axis=0):
        self.when, self.axis, self.slices = when, axis, np.asarray(slices)
        self._rows = []

    def observe(self, view):
        """Keep all slices as they are now."""
        motion = view.motion()
        moved = (motion["position"] - view.model.centre, motion["velocity"])
        means = (vectors[self.slices, self.axis].mean(axis=-1) for vectors in moved)
        self._rows.append((view.time_s, *means, self._broken(view)))

    def __getattr__(self, name):
        names = ("time", "displacement", "velocity", "joints")
        if name not in names:
            raise AttributeError(f"Profile has no {name}")
        return np.array([row[names.index(name)] for row in self._rows])

    def stress(self, modulus, distance):
        """Stress between a slice and the next [Pa], (looks, ..., slices - 1), tension positive.

        modulus [Pa] of the bar; distance [m] from slice to slice. Zero where the joint is broken.
        """
        strain = np.diff(self.displacement, axis=-1) / distance
        return np.where(self.joints, 0.0, modulus * strain)

    def _broken(self, view):
        shape, topology = self.slices.shape[:-1], view.model.topology
        count = int(np.prod(shape))
        owner = np.full(view.model.body_count, -1)
        owner[self.slices.reshape(count, -1)] = np.arange(count)[:, None]
        ends = np.sort(owner[np.stack([topology.master, topology.slave])], axis=0)
        between = (ends[0] >= 0) & (ends[1] - ends[0] == 1)
        bonds = np.bincount(ends[0, between], minlength=count)
        broken = np.bincount(ends[0, between & view.broken], minlength=count)
        return ((bonds > 0) & (broken == bonds)).reshape(shape)[..., :-1]


def travel_time(time_s, first, second, step):
    """Time that a pulse takes from one record to another [s]: where they agree best.

    time_s: of both records, ascending from zero [s]. step: resolution of the result [s].
    """
    fine = np.arange(0.0, time_s[-1], step)
    early, late = (np.interp(fine, time_s, record) for record in (first, second))
    return float(np.correlate(late, early, mode="full")[len(fine) - 1 :].argmax() * step)


def draw_space_time(axes, place, time_s, values, top):
    """Draw values over place and time: red above zero, blue below; returns the ``QuadMesh``.

    place: (places,) [m]. time_s: (times,) [s]. values: (times, places). top: end of the scale.
    """
    look = {"cmap": _COLOURS, "vmin": -top, "vmax": top, "shading": "auto", "rasterized": True}
    drawn = axes.pcolormesh(place, 1e3 * np.asarray(time_s), values, **look)
    axes.set(xlabel="place [m]", ylabel="time [ms]")
    return drawn


def draw_breaks(axes, place, time_s, joints):
    """Mark where and when joints broke; place: of the joints [m], joints: (times, joints)."""
    when, where = np.nonzero(np.diff(joints.astype(int), axis=0, prepend=0) > 0)
    axes.plot(place[where], 1e3 * time_s[when], "x", color=BLACK, ms=6, label="breaks")


def film_bar(path, profile, stress_pa, bar, length, strength_pa, count=40, magnify=150.0):
    """Write a GIF of a bar: velocity and stress along it, and itself, broken joints as gaps.

    profile: a ``Profile`` of several bars of slices of one length. stress_pa: between them, as
    ``Profile.stress`` gives it. bar: which one. length: of the bar [m]. strength_pa: drawn beside
    the stress. count: of pictures. magnify: of the displacement.
    """
    speed, moved, joints = (
        values[:, bar] for values in (profile.velocity, profile.displacement, profile.joints)
    )
    cell, stress = length / speed.shape[1], 1e-6 * stress_pa[:, bar]
    place, joint = cell * (np.arange(speed.shape[1]) + 0.5), cell * np.arange(1, speed.shape[1])
    with moving_picture(path, (4.0, 3.8), 110) as (figure, shoot):
        fast, tight, whole = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.0, 0.55))
        (moving,) = fast.plot(place, speed[0], color=GREEN)
        fast.set(ylabel="velocity [m/s]", ylim=(1.1 * speed.min(), 1.1 * speed.max()))
        (loaded,) = tight.plot(joint, stress[0], color=BLACK)
        tight.axhline(1e-6 * strength_pa, color=RED, ls="--", label="strength")
        (breaks,) = tight.plot([], [], "x", color=ORANGE, ms=6, mew=1.6, label="broken face")
        tight.set(ylabel="stress [MPa]", ylim=(1.1 * stress.min(), 1.1 * stress.max()))
        tight.legend(loc="lower left")
        boxes = whole.bar(place, 1.0, cell, linewidth=0.0)
        whole.set(xlim=(-0.05 * length, 1.16 * length), ylim=(0.0, 1.0), yticks=[])
        whole.set(xlabel=f"place [m]; displacement × {magnify:g}, red: tension, blue: pressure")
        whole.grid(False)
        lefts, shades = place - 0.5 * cell + magnify * (moved - moved[:, :1]), _shades(stress)
        for row in np.linspace(0, len(profile.time) - 1, count).round().astype(int):
            moving.set_ydata(speed[row])
            loaded.set_ydata(stress[row])
            breaks.set_data(joint[joints[row]], np.zeros(joints[row].sum()))
            for box, left, shade in zip(boxes, lefts[row], shades[row]):
                box.set(x=left, facecolor=shade)
            fast.set_title(f"t = {1e3 * profile.time[row]:.2f} ms")
            shoot()


def _shades(stress):
    """Colours of cells; each has the mean stress of its two joints, ends are free."""
    own = 0.5 * (np.pad(stress, ((0, 0), (0, 1))) + np.pad(stress, ((0, 0), (1, 0))))
    return matplotlib.colormaps[_COLOURS](0.5 + 0.5 * own / np.abs(stress).max())
