"""Where most of an error comes from, in words."""

import numpy as np

from ca_damper.accuracy.goal_estimate import Estimate, size_of

#: Source of most of a bar, and what narrows it, by its key.
ADVICE = {
    "step": ("of the time step", "a larger budget_s shortens it"),
    "no order": (
        "of the time step, by which the value changes in no order",
        "no step of this model has it to more",
    ),
    "chance": ("from seed to seed", "more seeds narrow it"),
    "cycles": ("of the mean over cycles", "a larger budget_s lengthens the runs"),
    "grid": ("of the frequencies around the peak", "a larger budget_s takes more of them"),
}


def largest_source(found: Estimate) -> str:
    """Where most of a bar comes from, a key of ADVICE."""
    cycles = np.sqrt(np.maximum(found.parts.sampling**2 - found.grid**2, 0.0))
    sources = {
        "step": found.parts.step,
        "chance": found.parts.chance,
        "cycles": cycles,
        "grid": found.grid,
    }
    return max(sources, key=lambda name: float(np.max(sources[name])))


#: Why one seed of a filling that draws is no answer.
ONE_SEED = (
    "the spread from seed to seed was not measured and is not in the bar: two seeds or more show it"
)


def shortfall(found: Estimate, tolerance: float, ended: str) -> str:
    """Why a bar is wider than asked, and what would help; "" if it is not.

    ended: in words, what ended the runs.
    """
    size, total = size_of(found.value), size_of(found.parts.total)
    if total <= found.allowed(tolerance):
        return ""
    reached = f"{100.0 * total / size:.2g} %" if size > 0.0 else "wider than the value"
    name = largest_source(found)
    has_order = found.step.is_regular or name != "step"
    source, advice = ADVICE[name if has_order else "no order"]
    return (
        f"{100.0 * tolerance:g} % was not reached {ended}: the bar is {reached}, most of it "
        f"{source}; {advice}"
    )
