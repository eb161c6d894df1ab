"""Numbers of an automaton that kernels read; in fields, so that another value compiles nothing."""

import taichi as ti


@ti.data_oriented
class Numbers:
    """width [m], mass of a particle [kg], gravity [m/s^2], restitution of particle and wall [-]."""

    def __init__(self, options):
        values = {
            "width": options.width,
            "mass": options.particle_mass,
            "gravity": options.gravity,
            "particle": options.restitution,
            "wall": options.wall_restitution,
        }
        for name, value in values.items():
            field = ti.field(ti.f64, shape=())
            field[None] = value
            setattr(self, name, field)
