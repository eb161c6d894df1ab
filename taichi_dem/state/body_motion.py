"""Motion of a body, as passed to loads."""

import taichi as ti

from taichi_dem.kit.types import mat3, real, vec3


@ti.dataclass
class BodyMotion:
    """A body at the beginning of its step, in world axes.

    position: of the centre [m]. rotation: from the body frame to the world. velocity [m/s] and spin
    [rad/s]: those of the leapfrog, half a step before. time [s]; step: length of the step [s].
    since, until: times [s] from and up to which a load that varies acts by its mean; those of a
    body's steps follow each other without a gap.
    """

    position: vec3
    rotation: mat3
    velocity: vec3
    spin: vec3
    time: real
    step: real
    since: real
    until: real
