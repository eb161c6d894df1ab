"""Least work of steps and of visits of a blast, see ``taichi_dem.kit.study.floors``."""

from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study.floors import CACHE, Work

#: The visit of a bond, in f64 and without regard to how things are stored. It reads two numbers of
#: bodies (8 bytes), the symmetric 6x6 block (21 numbers), the branch (3), the twist of the last
#: visit (6), and of both bodies twist (6), symmetric inverse inertia (6) and inverse mass (1). It
#: writes the twist of the visit (6) and those of both bodies (12): 74 numbers. Operations: the
#: twist of a bond is 6 differences, a cross product (9) and its difference (3), before and after
#: (36); less the last one (6), times the block (66), its square (5); the moment at the other body
#: (12), two products of 3x3 matrices with vectors (30), two with masses (6), and 12 sums: 173.
VISIT = Work(bytes=8 + 8 * 74, flops=173)


def bytes_a_step(engine):
    """Bytes that a step of all bodies must move at least: the model read, the state written too."""
    kept = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    read, written = (sum(array.nbytes for array in part.read().values()) for part in kept)
    return read + 2 * written


def counts_of(simulation):
    """Numbers of evaluated bonds, and of visits of bonds in sweeps, since the start."""
    counts = simulation.values(simulation.schedule.evaluations).tolist()
    # Those of the third count are both.
    return counts[5], counts[2] - counts[5]


def work_since(simulation, before=(0, 0), store=CACHE):
    """Least work of a run since it had some ``counts_of``; store: floor that holds for its bytes.

    A bond that is evaluated stands for its share of a step of all bodies, and each visit of a sweep
    comes to that. Contacts, searches and changes of lists are left out.
    """
    evaluated, visits = (now - then for now, then in zip(counts_of(simulation), before))
    share = bytes_a_step(simulation.engine) / simulation.model.bond_count
    return Work(share * evaluated, store=store) + VISIT * visits
