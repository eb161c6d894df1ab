"""Excitation of the structure: motions of its base and forces on it, over time.

``Batch`` and ``shake`` take a Signal for the base [m], or an Excitation for base and force [N].
"""

from ca_damper.excitation.excitation import Excitation
from ca_damper.excitation.generators import random_vibration, sines, sweep
from ca_damper.excitation.records import from_at2, from_csv
from ca_damper.excitation.samples import from_samples
from ca_damper.excitation.signal import Signal

__all__ = [
    "Excitation",
    "Signal",
    "from_at2",
    "from_csv",
    "from_samples",
    "random_vibration",
    "sines",
    "sweep",
]
