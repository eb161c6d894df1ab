"""Unit of a column, read off its name: the one place that knows."""

#: Unit by the ending of a name; of two endings that fit, the longer one counts.
ENDINGS = {
    "s": "s",
    "m": "m",
    "mm": "mm",
    "m2": "m^2",
    "m3": "m^3",
    "kg": "kg",
    "deg": "degree",
    "m_s": "m/s",
    "rad_s": "rad/s",
    "Hz": "Hz",
    "N": "N",
    "N_s_m": "N s/m",
    "J": "J",
}
#: Names without an ending: numbers, counts and shares, whose unit is 1.
PURE = (
    *("bodies", "body", "bond", "broken_faces", "cycle", "evaluations", "faces", "fragment"),
    *("damping_ratio", "loss", "loss_factor", "mass_share", "particles", "ratio", "seed"),
)
#: What all shares and components of unit vectors end in.
_PURE_ENDINGS = ("_share", "_normal")


def unit_of(name: str) -> str:
    """Read the unit off the name of a column.

    Parameters
    ----------
    name : str
        Such as ``"kinetic_J"`` or ``"broken_faces"``.

    Returns
    -------
    str
        Such as ``"J"``; ``"1"`` of pure numbers, ``""`` where the name does not say.

    Examples
    --------
    >>> unit_of("largest_speed_m_s"), unit_of("broken_faces"), unit_of("what")
    ('m/s', '1', '')
    """
    ending = _ending(name)
    if ending:
        return ENDINGS[ending]
    return "1" if name in PURE or name.endswith(_PURE_ENDINGS) else ""


def without_unit(name: str) -> str:
    """The name of a column without the unit at its end: "time_s" -> "time"."""
    ending = _ending(name)
    return name[: -len(ending) - 1] if ending else name


def _ending(name):
    """The longest of ENDINGS that a name has, or ""."""
    return max((e for e in ENDINGS if name.endswith(f"_{e}")), key=len, default="")
