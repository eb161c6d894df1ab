"""What a finished run gives: tables, and files for other programs."""

from typing import Any

import numpy as np

from taichi_dem.kit.data_table import arrays_of, data_frame
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, whole
from taichi_dem.output.cracks import cracks_of, rose_of
from taichi_dem.output.export import write_gltf, write_particles, write_vtkhdf
from taichi_dem.output.fragments import fragment_of_body, fragments_of
from taichi_dem.output.hole_monitor import Attenuation, attenuation_of, watched_groups
from taichi_dem.output.record import Frame
from taichi_dem.report.energy_balance import GIVEN, HELD, TERMS
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model


class RunTables:
    """What can be read out of a result; the base of ``Result``, which says what its members are."""

    scene: Scene
    model: Model
    series: dict[str, np.ndarray]
    frames: tuple[Frame, ...]
    broken_time: np.ndarray
    peak_speed: np.ndarray
    acting_since: dict[str, np.ndarray]

    def frame(self, number: int = -1) -> Frame:
        """Choose a frame.

        Parameters
        ----------
        number : int
            From 0 on, or from -1, the last, backwards.

        Returns
        -------
        Frame

        Raises
        ------
        InputError
            Where there is none of this number.
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
            Masses, sizes, places, velocities, spins and energies, a row a fragment, the heaviest
            first (``taichi_dem.output.fragments.fragments_of``).

        Raises
        ------
        InputError
            Where there is no such frame.

        Examples
        --------
        ::

            pieces = result.fragments()
            print(pieces)
            print(pieces["sieve_m"][pieces["mass_kg"] > 0.1])
        """
        of_body = self.fragment_of_body(frame)
        return data_frame(fragments_of(self.model, self.frame(frame), of_body))

    def fragment_of_body(self, frame: int = -1) -> np.ndarray:
        """Fragment of each body, a row of ``fragments(frame)``.

        Parameters
        ----------
        frame : int
            Number of the frame, the last by default.

        Returns
        -------
        ndarray of int, shape (body_count,)
        """
        return fragment_of_body(self.model, self.broken_time <= self.frame(frame).time_s)

    def cracks(self) -> Any:
        """Tabulate broken faces in their order: time, area, place, normal, strike, dip.

        Returns
        -------
        pandas.DataFrame
        """
        return cracks_of(self.model, self.broken_time)

    def crack_area(self) -> Any:
        """Tabulate the area of all cracks [m^2] at the times of the history.

        Returns
        -------
        pandas.DataFrame
            ``time_s`` and ``crack_area_m2``; one side of a crack counts.
        """
        made, times_s = arrays_of(self.cracks()), self.series["time_s"]
        area = np.concatenate([[0.0], made["crack_area_m2"]])
        upto = np.searchsorted(made["time_s"], times_s, side="right")
        return data_frame({"time_s": times_s, "crack_area_m2": area[upto]})

    def rose(self, axis: Any = (0.0, 0.0, 1.0), sectors: int = 36) -> Any:
        """Tabulate crack area by the direction of the cracks in a plane.

        Parameters
        ----------
        axis : sequence of 3 floats
            Normal of the plane, towards the viewer.
        sectors : int
            Of a half turn, 2 to 360.

        Returns
        -------
        pandas.DataFrame
            Area and number of faces by sector (``taichi_dem.output.cracks.rose_of``).
        """
        return rose_of(self.model, np.isfinite(self.broken_time), axis, sectors)

    def energy_shares(self) -> Any:
        """Tabulate every term of the energy balance as a share of the energy given, over time.

        Returns
        -------
        pandas.DataFrame
            ``time_s``; ``given_J``: work of loads and supports, energy injected at releases and
            held at the start; and a column ``NAME_share`` of each other term, ``residual_share`` of
            what is unexplained. Shares add up to 1 by the balance; where nothing is given they are
            NaN.
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

        Returns
        -------
        Attenuation
            ``.table``, and ``.power_law(nearest)`` for the fit.

        Raises
        ------
        InputError
            Where the mesh has no such group.
        """
        group = next(iter(watched_groups(self.scene)), None) if group is None else group
        if group is None:
            raise InputError(
                "group must name the wall of a hole, as this scene has no gas pressure"
            )
        return attenuation_of(self.model, self.peak_speed, group, radius)

    def write_vtkhdf(self, path: FileName) -> None:
        """Write all frames as one VTKHDF file for ParaView, with the data of the PVD series.

        Parameters
        ----------
        path : str or path
            Such as ``"run.vtkhdf"``.

        Raises
        ------
        InputError
            Where there are no frames, h5py is not installed, or the file cannot be written.
        """
        self.frame()
        write_vtkhdf(path, self)

    def write_xyz(self, path: FileName, of: str = "bodies") -> None:
        """Write all frames as an extended XYZ file for OVITO.

        Parameters
        ----------
        path : str or path
            Such as ``"run.xyz"``.
        of : {"bodies", "fragments"}
            What a particle is (``taichi_dem.output.export``).

        Raises
        ------
        InputError
            Where there are no frames, or the file cannot be written.
        """
        self.frame()
        write_particles(path, self, of)

    def write_gltf(self, path: FileName, colour: str = "peak_speed", seconds: float = 10.0) -> None:
        """Write an animation for browsers and Blender; every fragment moves as a rigid piece.

        Parameters
        ----------
        path : str or path
            Such as ``"run.glb"``.
        colour : str
            One of ``taichi_dem.output.fragments.COLOURS``, in the last frame: violet is 0, yellow
            the value that 2 % of the bodies exceed.
        seconds : float
            How long the animation lasts [s].

        Raises
        ------
        InputError
            Where there are no frames, or the file cannot be written.
        """
        self.frame()
        write_gltf(path, self, colour, seconds)
