"""Properties of the running device: the only module that distinguishes back ends."""

import math
from collections import Counter

import numpy as np
import taichi as ti
from taichi.lang import impl
from taichi.lang.snode import SNode
from taichi.lang.util import to_numpy_type

from taichi_dem.kit.errors import InputError

#: Back ends by name; "gpu" is the first of ``GPUS`` that is there.
GPUS = {"cuda": ti.cuda, "vulkan": ti.vulkan}
ARCHITECTURES = ("cpu", "gpu", *GPUS)
_WORDS = {"cuda": "CUDA device", "vulkan": "Vulkan driver"}
#: Threads and rounds of the loops that show what a driver does wrong.
_THREADS, _ROUNDS = 1024, 70_000
#: Threads a block with which drivers that mix threads up in loops with atomics keep them apart.
_SMALL_BLOCK = 8
#: Blocks that a loop may start on Vulkan.
_MOST_BLOCKS = 65_535
_I32, _F64 = (ti.types.ndarray(dtype=kind, ndim=1) for kind in (ti.i32, ti.f64))
_faults: dict[str, int] = {"block": 0, "rounds": 0}


def found(arch: str) -> str:
    """The back end that a name means here. Raises InputError where the machine lacks it."""
    if arch == "cpu":
        return arch
    wanted = tuple(GPUS) if arch == "gpu" else (arch,)
    for name in wanted:
        if is_present(name):
            return name
    lacking = " and no ".join(_WORDS[name] for name in wanted)
    raise InputError(f"arch {arch!r} was asked for, but no {lacking} answers here: use 'cpu'")


def is_present(name: str) -> bool:
    """Whether a device or driver of a back end answers on this machine."""
    # Taichi would say on stderr what it does not find; the caller says it in a sentence.
    ti.set_logging_level(ti.ERROR)
    return bool(getattr(ti._lib.core, f"with_{name}")())


def is_cpu() -> bool:
    """Whether kernels run on the CPU, where fields lie in the memory of this process."""
    return impl.current_cfg().arch not in GPUS.values()


def in_host_memory() -> bool:
    """Whether fields take memory of this machine: Vulkan's software driver does, CUDA does not."""
    return impl.current_cfg().arch != ti.cuda


def probe() -> None:
    """Find the faults of the device on which Taichi has just started."""
    # Mesa's lavapipe, a Vulkan driver on the CPU, ends every loop after 65,535 rounds, and the
    # threads of a block of more than 8 leave a loop with an atomic together.
    _faults.update(block=0, rounds=0)
    if is_cpu():
        return
    try:
        blocks = [block for block in (0, _SMALL_BLOCK) if _loops_end_alone(block)]
    except RuntimeError as error:
        words = str(error).strip().splitlines()[-1]
        raise InputError(f"the device has no double precision: use arch 'cpu' ({words})") from None
    if not blocks:
        raise InputError("the driver of the device ends loops too early: use arch 'cpu'")
    _faults.update(block=blocks[0], rounds=_rounds())
    if blocks[0]:
        impl.current_cfg().default_gpu_block_dim = blocks[0]


def most_bytes() -> float:
    """Bytes of one tree of fields: Vulkan keeps it in one buffer, with offsets of 32 bits."""
    return 2.0**32 if impl.current_cfg().arch == ti.vulkan else math.inf


def most_entries() -> float:
    """Entries of a field that a loop over it can visit: fewer where blocks of threads are small."""
    return _MOST_BLOCKS * _faults["block"] or math.inf


def most_rounds() -> int:
    """Rounds of all loops of one thread together, after which a driver ends them; 0 for no end."""
    return _faults["rounds"]


def cut_short(whose: str, advice: str) -> InputError:
    """Error for a launch in which the driver has ended a loop; advice: what to take instead."""
    return InputError(
        f"a loop {whose} needs more than the {most_rounds()} rounds after which the driver of this "
        f"device ends it: take {advice}, or arch 'cpu'"
    )


@ti.func
def loops_have_ended(rounds):
    """Whether the driver ends the loops of this thread; rounds: a number of at least 1."""
    # The loops make one round; no compiler can know that these statements do not make six.
    x, count = ti.min(rounds, 1), 0
    while x < 1000:
        x = 3 * x + 1
        count += 1
    return count < 6


def _loops_end_alone(block):
    """Whether each thread of a block makes the rounds of its own loop, beside an atomic."""
    total = ti.ndarray(ti.i32, shape=1)
    counts = ti.ndarray(ti.f64, shape=_THREADS)

    @ti.kernel
    def loop(total: _I32, counts: _F64):
        if ti.static(block):
            ti.loop_config(block_dim=block)
        for i in range(_THREADS):
            rounds = 0.0
            for _ in range(i % 11):
                ti.atomic_add(total[0], 1)
                rounds += 1.0
            counts[i] = rounds

    loop(total, counts)
    return bool((counts.to_numpy() == np.arange(_THREADS) % 11).all())


def _rounds():
    """Rounds after which loops end; 0 where they make all that they should."""
    counts = ti.ndarray(ti.i32, shape=1)

    @ti.kernel
    def loop(counts: _I32, rounds: ti.i32):
        for i in range(1):
            for _ in range(rounds):
                counts[i] = counts[i] + 1

    loop(counts, _ROUNDS)
    rounds_made = int(counts.to_numpy()[0])
    return rounds_made if rounds_made < _ROUNDS else 0


def declared_bytes(node: object) -> int:
    """Bytes of all fields placed below a node that is not allocated yet."""
    return sum(_bytes_of(node.get_ch(k)) for k in range(node.get_num_ch()))


def _bytes_of(node):
    if node.is_place():
        return to_numpy_type(node.data_type())().itemsize
    return math.prod(SNode(node).shape) * declared_bytes(node)


def align(root: object) -> None:
    """Declare fillers in a tree so that each field of 8 bytes lies at a multiple of 8."""
    # Taichi's layout for Vulkan packs fields without gaps: after one of an odd number of words, a
    # number of 8 bytes would overwrite half of its neighbour (taichi issue 8803).
    if impl.current_cfg().arch != ti.vulkan:
        return
    nodes = [root.get_ch(k) for k in range(root.get_num_ch())]
    for node in nodes:
        entry = declared_bytes(node)
        if entry % 8 and entry > 4:
            SNode(node).place(ti.field(ti.i32))
    sizes = Counter(map(_bytes_of, nodes))
    for size, count in sizes.items():
        if size % 8 and count % 2:
            ti.field(ti.i32, shape=size // 4)
