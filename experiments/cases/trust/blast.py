"""A block 3 m deep is blasted: how peak velocities fall, and how large its fragments are."""

import numpy as np

from cases.blast import BLOCK_STEP, FROM_RADII, HOLE_RADIUS, paper_effects
from cases.meshes import mirrored_copies, with_moved_nodes
from cases.trust import Number
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene, read_mesh, simulate
from taichi_dem.mesh.shapes import in_space_order
from taichi_dem.mesh.tetrahedra import all_faces, outer_rows

#: Copies of the paper's block, one behind the other; end of a run [s].
COPIES, UNTIL = 15, 1e-3
#: Largest shift of a node within the block, as a share of the shortest edge at it.
SHIFT = 0.15
#: Sizes of bodies below which fragments are those of the mesh; sieves, from a tenth of it.
OF_THE_MESH, SIEVES = 2.0, 48


def blast(effort):
    """Exponent of peak velocities, and those of both laws of fragment sizes."""
    peaks, sieved = zip(*map(blasted, effort.seeds))
    exponent = np.array([one.power_law(FROM_RADII)[0] for one in peaks])
    rosin, swebrec = np.array([[line[0] for line in laws(*curve)] for curve in sieved]).T
    field = "field blasts: AS 2187.2, range of Bureau of Mines Bulletin 656"
    rock = "rock, Cunningham (2005), 0.8 to 1.5"
    quarries = "quarries, Ouchterlony (2005), 1.5 to 3.5"
    falls = "blast_exponent", "exponent of peak velocity over distance", -1.6
    first = "blast_rosin_rammler", "exponent of Rosin and Rammler's law of sizes", 1.15
    other = "blast_swebrec", "exponent of the Swebrec law of sizes", 2.5
    whole = "1 ms after the blow most of the block is still one piece"
    numbers = (
        Number(*falls, exponent, -2.4, -1.1, source=field),
        Number(*first, rosin, 0.8, 1.5, source=rock),
        Number(*other, swebrec, 1.5, 3.5, source=quarries, miss=whole),
    )
    sieves, _, limit = sieved[0]
    (n, level), _ = laws(*sieved[0])
    law = sieves, -np.expm1(-np.exp(level) * sieves**n)
    return numbers, {"curves": [curve[:2] for curve in sieved], "law": law, "limit": limit}


def blasted(seed):
    """Peak velocities over distance, and what ``sieving`` makes of the fragments."""
    scene = Scene(block(seed), CONCRETE, paper_effects())
    looks = {"until": UNTIL, "samples": 200, "frames": 1, "progress": None}
    result = simulate(scene, method=ImplicitDashpots(BLOCK_STEP), **looks)
    return result.attenuation("hole", HOLE_RADIUS), sieving(result)


def block(seed):
    """The paper's block, copied to its full depth, with its inner nodes moved at random."""
    mesh = mirrored_copies(read_mesh(PAPER_BLOCK), COPIES)
    corners = mesh.points[mesh.tetrahedra]
    edges = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1)
    edges[edges == 0.0] = np.inf
    most = np.full(mesh.point_count, np.inf)
    np.minimum.at(most, mesh.tetrahedra, SHIFT * edges.min(axis=2))
    faces = all_faces(mesh.tetrahedra)
    most[faces[outer_rows(faces)]] = 0.0
    return in_space_order(with_moved_nodes(mesh, most[:, None], seed))


def sieving(result):
    """Sieves [m], shares of the mass that pass, the size below which sizes are the mesh's [m].

    The size of a fragment is the edge of a cube of its volume; the largest ends the sieves.
    """
    density = result.model.material.density
    mass = result.fragments()["mass_kg"].to_numpy()
    size = np.cbrt(mass / density)
    limit = OF_THE_MESH * np.cbrt(result.model.body_mass.mean() / density)
    sieves = np.geomspace(0.1 * limit, size.max(), SIEVES)
    passing = [mass[size <= sieve].sum() / mass.sum() for sieve in sieves[:-1]]
    return sieves, np.array([*passing, 1.0]), limit


def laws(sieves, passing, limit):
    """Lines (slope, level) of P = 1 - exp(-(x / x_c)^n), of 1 / P = 1 + (ln(x_max / x) / c)^b."""
    taken = (sieves >= limit) & (passing < 1.0)
    x, passing = sieves[taken], passing[taken]
    rosin = np.polyfit(np.log(x), np.log(-np.log1p(-passing)), 1)
    return rosin, np.polyfit(np.log(np.log(sieves[-1] / x)), np.log(1.0 / passing - 1.0), 1)
