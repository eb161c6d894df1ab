"""Result of ``simulate``: tables, display in a notebook, files; pictures of meshes and scenes."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MethodType, SimpleNamespace
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import arrays_of, data_frame
from taichi_dem.kit.display import Pictured, counted, embedded, in_brief, titled, verbatim
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, remove_files, write_csv, write_text
from taichi_dem.kit.validation import FileName, direction, flag, fraction, positive, whole
from taichi_dem.kit.viewer import WebPage
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.observers import Received, peak_velocities, write_receivers
from taichi_dem.output.fracture import (
    apertures_of,
    cracks_of,
    fragment_of_body,
    fragments_of,
    passing_mass,
    rose_of,
)
from taichi_dem.output.hole_monitor import Attenuation, attenuation_of, watched_groups
from taichi_dem.output.record import Frame, remove_series, series_name, write_bonds, write_paraview
from taichi_dem.report.effects import Certificate
from taichi_dem.report.energy_balance import GIVEN, HELD, TERMS
from taichi_dem.report.report import Report
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model


@dataclass(frozen=True, eq=False)
class Result:
    """Result of a run.

    A notebook shows the block in the last frame, its history, and the report.

    Parameters
    ----------
    scene : Scene
        Scene that ran.
    method : Method
        Method that stepped.
    model : Model
        Arrays of the scene.
    series : dict of str to ndarray
        Columns of ``history`` by name, whose ends are their units, one row a sample.
    frames : tuple of Frame
        Snapshots.
    broken_time : ndarray
        Time at which each bond was released [s], shape (bond_count,); NaN while it holds.
    peak_speed : ndarray
        Largest speed of each body at the samples [m/s], shape (body_count,).
    report : Report
        Figures and cost of the run.
    diverged : str, default ""
        Error message of a run that diverged, whose data end before that; else ``""``.
    start : dict, optional
        Motion set before the run, arguments of ``State.set_motion``; None: the scene's.
    acting_since : dict, optional
        With effects="auto": when each effect began to act on each body [s], by name; NaN: never.
    receivers : mapping, optional
        Motion of the points of the ``Receivers`` among the observers, a ``Received`` each, by name.
    """

    scene: Scene
    method: Any
    model: Model
    series: dict[str, np.ndarray]
    frames: tuple[Frame, ...]
    broken_time: np.ndarray
    peak_speed: np.ndarray
    report: Report
    diverged: str = ""
    start: dict[str, np.ndarray] | None = None
    acting_since: dict[str, np.ndarray] = field(default_factory=dict)
    receivers: Mapping[str, Received] = field(default_factory=dict)

    def __repr__(self):
        samples = counted(len(self.series.get("time_s", ())), "sample")
        frames, early = counted(len(self.frames), "frame"), "diverged" if self.diverged else ""
        return in_brief(self, self.report.outcome, samples, frames, early)

    def _repr_html_(self):
        drawn = {}
        if self.frames:
            picture = self.plot.cracks if self.report.broken_faces else self.plot.block
            drawn["The block"] = picture()
        drawn["What happened over time"] = self.plot.history()
        title = f"Result: {counted(self.model.body_count, 'body')}, {self.report.outcome}"
        shown = [embedded(figure._repr_png_(), words) for words, figure in drawn.items()]
        return titled(title, *shown, verbatim(self.report.details()), warning=self.diverged)

    @property
    def certificate(self) -> Certificate | None:
        """What acted and what was left out, with effects="auto"; else None."""
        return self.report.certificate

    @cached_property
    def history(self) -> Any:
        """Time series as a pandas.DataFrame, a row a sample; units in ``attrs["units"]``."""
        return data_frame(self.series)

    @cached_property
    def effects(self) -> Any:
        """A DataFrame, a row per effect: what it did, since when, what was left out, advice."""
        return self.report.advice().table()

    @property
    def plot(self) -> Any:
        """Pictures of the run, a function of ``taichi_dem.plot`` each.

        ``result.plot.energy(path="energy.png")`` is ``plot_energy(result, path="energy.png")``.
        """
        # Imported here, so that matplotlib loads only where a picture is drawn.
        from taichi_dem import plot

        drawn = {name.removeprefix("plot_"): getattr(plot, name) for name in plot.__all__}
        return SimpleNamespace(
            **{name: MethodType(function, self) for name, function in drawn.items()}
        )

    def frame(self, number: int = -1) -> Frame:
        """Choose a frame.

        Parameters
        ----------
        number : int
            From 0 on, or from -1, the last, backwards.
        """
        count = len(self.frames)
        if not count:
            raise InputError(
                "a result must have frames for this: simulate(..., frames=1) keeps two"
            )
        return self.frames[whole("frame", number, -count, count - 1)]

    def fragments(self, frame: int = -1) -> Any:
        """Tabulate the bodies that unbroken bonds still join.

        Parameters
        ----------
        frame : int
            Number of the frame, the last by default.

        Returns
        -------
        pandas.DataFrame
            Masses, sizes, places, velocities, spins and energies, a row a fragment, heaviest first.
        """
        of_body = self.fragment_of_body(frame)
        return data_frame(fragments_of(self.model, self.frame(frame), of_body))

    def sieve_size(self, share: float = 0.8, frame: int = -1) -> float:
        """Opening of the sieve that a share of the mass passes [m]: P80, or P50 with 0.5.

        Parameters
        ----------
        share : float
            Share of the mass, from 0 to 1.
        frame : int
            Number of the frame, the last by default.

        Returns
        -------
        float
            The smallest ``sieve_m`` of the fragments that at least this share passes.
        """
        fraction("share", share)
        sizes, passing = passing_mass(arrays_of(self.fragments(frame)))
        return float(sizes[np.searchsorted(passing, share * (1.0 - 1e-12))])

    def peak_velocities(self, source: Sequence[float], charge: float = 1.0) -> Any:
        """Tabulate the largest velocities at the receivers of the run, as for a blast report.

        Parameters
        ----------
        source : sequence of float
            Place of the charge [m], (3,).
        charge : float
            Mass of explosive that fires together [kg].

        Returns
        -------
        pandas.DataFrame
            Name, distance, scaled distance (distance over the root of the charge), largest speed
            and components, a row a receiver, the nearest first.
        """
        if not self.receivers:
            raise InputError("a result must have receivers for this: observers=[Receivers(points)]")
        at = direction("source", source)
        return data_frame(peak_velocities(self.receivers, np.array(at), positive("charge", charge)))

    def fragment_of_body(self, frame: int = -1) -> np.ndarray:
        """Fragment of each body (body_count,), a row of ``fragments(frame)``.

        Parameters
        ----------
        frame : int
            Number of the frame, the last by default.
        """
        return fragment_of_body(self.model, self.broken_time <= self.frame(frame).time_s)

    def cracks(self, frame: int = -1) -> Any:
        """Tabulate broken faces in their order: time, area, aperture, place, normal, strike, dip.

        Parameters
        ----------
        frame : int
            Frame that ``aperture_m`` is of, the last by default; without frames it is NaN.
        """
        unknown = np.full(self.model.bond_count, np.nan)
        apertures = self.apertures(frame) if self.frames else unknown
        return cracks_of(self.model, self.broken_time, apertures)

    def apertures(self, frame: int = -1) -> np.ndarray:
        """Opening of every bond, broken, softened or whole, along the normal of its face.

        Parameters
        ----------
        frame : int
            Number of the frame, the last by default.

        Returns
        -------
        ndarray, shape (bond_count,)
            Mean of the three contact units [m]; negative where faces are pressed into each other.
        """
        return apertures_of(self.model, self.frame(frame))

    def crack_area(self) -> Any:
        """Tabulate the area of all cracks [m^2] at the times of the history."""
        cracks, times_s = arrays_of(self.cracks()), self.series["time_s"]
        area = np.concatenate([[0.0], cracks["crack_area_m2"]])
        upto = np.searchsorted(cracks["time_s"], times_s, side="right")
        return data_frame({"time_s": times_s, "crack_area_m2": area[upto]})

    def rose(self, axis: object = (0.0, 0.0, 1.0), sectors: int = 36) -> Any:
        """Tabulate crack area by the direction of the cracks in a plane.

        Parameters
        ----------
        axis : sequence of 3 floats
            Normal of the plane, towards the viewer.
        sectors : int
            Of a half turn, 2 to 360.
        """
        return rose_of(self.model, np.isfinite(self.broken_time), axis, sectors)

    def energy_shares(self) -> Any:
        """Tabulate every term of the energy balance as a share of the energy given, over time.

        Returns
        -------
        pandas.DataFrame
            ``time_s``; ``given_J``: work of loads and supports, energy injected at releases and
            held at the start; and a column ``NAME_share`` of each other term, ``residual_share`` of
            what is unexplained. Shares add up to 1; where nothing is given they are NaN.
        """
        history, time_s = self.series, self.series["time_s"]
        held = sum(history[f"{name}_J"][:1].sum() for name in HELD)
        given = sum((history[f"{name}_J"] for name in GIVEN), np.full(len(time_s), held))
        safe = np.where(given > 0.0, given, np.nan)
        terms = [n for n in TERMS if n not in GIVEN and f"{n}_J" in history]
        shares = {f"{name}_share": history[f"{name}_J"] / safe for name in terms}
        return data_frame({"time_s": time_s, "given_J": given, **shares})

    def attenuation(self, group: str | None = None, radius: float | None = None) -> Attenuation:
        """Peak velocity of every body over its distance from a hole.

        Parameters
        ----------
        group : str, optional
            Face group of the hole's wall; that under gas pressure, or "hole", by default.
        radius : float, optional
            Of the hole [m]; that of the points of its wall by default.
        """
        group = next(iter(watched_groups(self.scene)), None) if group is None else group
        if group is None:
            raise InputError(
                "group must name the wall of a hole, as this scene has no gas pressure"
            )
        return attenuation_of(self.model, self.peak_speed, group, radius)

    def write(self, folder: FileName, *, single: bool = False) -> None:
        """Write history.csv, bonds.csv, mesh.msh, report.json and a ParaView series to a folder.

        With receivers, receivers.csv too. The series, in paraview/ of that folder, has the folder's
        name. These files of an earlier run in the same folder are replaced.

        Parameters
        ----------
        folder : path
            Folder; a leading "~" is the user's home.
        single : bool, default False
            Of the ParaView series, see ``write_paraview``.
        """
        flag("single", single)
        folder = output_folder(folder)
        place, name = os.path.join(folder, "paraview"), series_name(folder)
        remove_series(place, name)
        write_csv(os.path.join(folder, "history.csv"), self.series)
        write_bonds(os.path.join(folder, "bonds.csv"), self.model, self.broken_time)
        write_mesh(os.path.join(folder, "mesh.msh"), self.scene.mesh)
        text = json.dumps({**self.report.as_dict(), "diverged": self.diverged}, indent=1)
        write_text(os.path.join(folder, "report.json"), text)
        remove_files(folder, r"receivers\.csv")
        if self.receivers:
            write_receivers(os.path.join(folder, "receivers.csv"), self.receivers)
        if self.frames:
            given = self.model, self.frames, name, self.acting_since
            write_paraview(place, *given, single=single)

    def show(self, path: FileName | None = None, *, open_browser: bool | None = None) -> WebPage:
        """Write one HTML page in which the block turns and its frames play, without a network.

        Parameters
        ----------
        path : file name, optional
            Of the page; by default ``view.html`` in a new folder for temporary files.
        open_browser : bool, optional
            By default only from a terminal of a desktop.

        Notes
        -----
        Displacements and rotations have 16 bits: an error of at most 1/65534 of the largest in
        their frame. 50 frames of the paper's block have 1.2 MB; beyond 30 MB frames are left out.
        """
        # Imported here, so that matplotlib loads only where something is shown.
        from taichi_dem.viewer.block import show_block

        self.frame()
        return show_block(self, path, open_browser)


def picture_of(thing: Mesh | Scene) -> bytes:
    """The mesh coloured by group, of a scene with what acts on each group, as PNG."""
    # Imported here, so that matplotlib loads only where a picture is shown.
    from taichi_dem.plot.view import picture_of_groups

    acting: dict[str, list[str]] = {}
    grouped = [effect for effect in getattr(thing, "effects", ()) if hasattr(effect, "group")]
    for effect in grouped:
        acting.setdefault(effect.group, []).append(effect.name.replace("_", " "))
    mesh = thing.mesh if isinstance(thing, Scene) else thing
    held = [effect.group for effect in grouped if effect.role == "support"]
    return picture_of_groups(mesh, acting, held)


Pictured.png = picture_of
