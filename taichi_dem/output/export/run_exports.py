"""Files of a finished run for other programs."""

import numpy as np

from taichi_dem.kit.validation import FileName
from taichi_dem.output.body_values import shares_of_scale
from taichi_dem.output.export.gltf import write_gltf
from taichi_dem.output.export.particles import write_particles
from taichi_dem.output.export.vtkhdf import write_vtkhdf
from taichi_dem.output.run_tables import RunTables


class RunExports(RunTables):
    """Files that a result writes for other programs; the base of ``Result``."""

    acting_since: dict[str, np.ndarray]

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
        write_vtkhdf(path, self.model, self.frames, self.acting_since)

    def write_xyz(self, path: FileName, of: str = "bodies") -> None:
        """Write all frames as an extended XYZ file for OVITO.

        Parameters
        ----------
        path : str or path
            Such as ``"run.xyz"``.
        of : {"bodies", "fragments"}
            What a particle is (``taichi_dem.output.export.particles``).

        Raises
        ------
        InputError
            Where there are no frames, or the file cannot be written.
        """
        self.frame()
        write_particles(path, self.model, self.frames, self.broken_time, of)

    def write_gltf(self, path: FileName, colour: str = "peak_speed", seconds: float = 10.0) -> None:
        """Write an animation for browsers and Blender; every fragment moves as a rigid piece.

        Parameters
        ----------
        path : str or path
            Such as ``"run.glb"``.
        colour : str
            One of ``taichi_dem.output.body_values.COLOURS``, in the last frame: violet is 0, yellow
            the value that 2 % of the bodies exceed.
        seconds : float
            How long the animation lasts [s].

        Raises
        ------
        InputError
            Where there are no frames, or the file cannot be written.
        """
        shares = shares_of_scale(self.bodies(-1), colour)
        write_gltf(path, self.model, self.frames, self.broken_time, shares, seconds)
