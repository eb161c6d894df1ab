"""Result of ``simulate``: its display in a notebook, and the files that it writes."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MethodType, SimpleNamespace
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.display import counted, embedded, in_brief, titled, verbatim
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, remove_files, write_csv, write_text
from taichi_dem.kit.validation import FileName
from taichi_dem.kit.viewer import WebPage
from taichi_dem.mesh.files import write_mesh
from taichi_dem.observers import Received, write_receivers
from taichi_dem.output.record import (
    Frame,
    remove_series,
    series_name,
    write_bonds,
    write_paraview,
)
from taichi_dem.output.run_tables import RunTables
from taichi_dem.report.effects import Certificate
from taichi_dem.report.report import Report
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model


@dataclass(frozen=True, eq=False)
class Result(RunTables):
    """Result of a run.

    As the last line of a notebook's cell it shows a picture and the report.

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
        Error sentence of a run that left its bounds, whose data end before that; else ``""``.
    start : dict, optional
        Motion that was set before the run, arguments of ``State.set_motion``; None for a run that
        began as its scene says.
    acting_since : dict, optional
        With effects="auto": time from which each effect acted on each body [s], by name; NaN for
        never.
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
        # Imported here, so that matplotlib loads only where a picture is shown.
        from taichi_dem.plot.summary import picture_of_run

        words = "The block, its energy and what happened in it over time"
        title = f"Result: {counted(self.model.body_count, 'body')}, {self.report.outcome}"
        shown = embedded(picture_of_run(self), words), verbatim(str(self.report))
        return titled(title, *shown, warning=self.diverged)

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
        """A DataFrame, a row an effect: what it did, since when, what was left out, advice."""
        return self.report.advice().table()

    @property
    def plot(self) -> Any:
        """Pictures of the run, a function of ``taichi_dem.plot`` each.

        ``result.plot.energy(path="energy.png")`` is ``plot_energy(result, path="energy.png")``.
        """
        # Imported here, so that matplotlib loads only where a picture is drawn.
        from taichi_dem import plot

        drawn = {name.removeprefix("plot_"): getattr(plot, name) for name in plot.__all__}
        return SimpleNamespace(**{name: MethodType(one, self) for name, one in drawn.items()})

    def write(self, folder: FileName) -> None:
        """Write history.csv, bonds.csv, mesh.msh, report.json and a ParaView series to a folder.

        With receivers, receivers.csv too. The series, in paraview/ of that folder, has the folder's
        name. These files of an earlier run in the same folder are replaced, its series removed even
        where this run has no frames.

        Parameters
        ----------
        folder : path
            Folder; a leading "~" is the user's home.

        Raises
        ------
        InputError
            The folder cannot be written to.
        """
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
            write_paraview(place, self.model, self.frames, name, self.acting_since)

    def show(self, path: FileName | None = None, *, open_browser: bool | None = None) -> WebPage:
        """Write one HTML page in which the block turns and its frames play, without a network.

        Parameters
        ----------
        path : file name, optional
            Of the page; by default ``view.html`` in a new folder for temporary files.
        open_browser : bool, optional
            By default it opens where a person sits at a terminal of a desktop: not in a pipe, a
            test, a notebook or on a build server.

        Returns
        -------
        WebPage
            Path of the page. As the last line of a notebook's cell it shows the page there.

        Raises
        ------
        InputError
            Without frames, for a scene of which two exceed 30 MB, and when the file cannot be
            written.

        Notes
        -----
        Displacement and turn of a body have 16 bits: an error of at most 1/65534 of the largest of
        their frame. A page of the paper's block with 50 frames has 1.2 MB. Beyond 30 MB frames
        are left out evenly, and the page says so.

        Examples
        --------
        >>> method = ImplicitDashpots()
        >>> result = simulate(scene, method=method, until=1e-4, frames=20)  # doctest: +SKIP
        >>> result.show("blast.html")  # doctest: +SKIP
        """
        # Imported here, so that matplotlib loads only where something is shown.
        from taichi_dem.viewer.block import show_block

        if not self.frames:
            raise InputError("frames must be at least 1 to show a run: simulate(..., frames=20)")
        return show_block(self, path, open_browser)
