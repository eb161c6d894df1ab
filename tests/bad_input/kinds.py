"""What a parameter takes: values of the type in its docstring, and of its kind."""

import math
import re

import numpy as np

#: Words of types that take the same values.
SAME = {"auto": "str", "file": "path", "function": "callable", "ndarray": "array_like"}
SAME |= {"dict": "mapping", **dict.fromkeys(("list", "tuple"), "sequence")}


def words_of(text):
    """Words of a type in a docstring, such as "float or sequence of float"; others are classes."""
    parts = re.split(r" or |, (?!default)", text)
    heads = {SAME.get(head, head) for head in (re.search(r"\w+", part)[0] for part in parts)}
    if heads & {"sequence", "iterable"}:
        heads |= {"texts"} if " str" in text else {"list"}
        heads |= {"numbers"} if " float" in text else set()
    if re.search(r", (optional|default None)", text):
        heads.add("None")
    return heads | ({"empty"} if text.endswith('default ""') else set())


#: Kind by the name of a parameter, or "Call.name" of a call alone. Any other number is positive, a
#: whole one may be zero, and text is one of some words.
KINDS = {
    "zero or positive": """cohesion normal_damping shear_damping friction contact_damping ramp
        damping_ratio wall_friction gravity static_threshold base_amplitude damping rtol added_mass
        weld_tolerance effects.GasPressure.start nearest dashpot_floor clearance clearances gap
        effects.PrescribedMotion.frequency SceneTable.frequency SceneTable.change.frequency
        SceneTable.drive.frequency Oscillator.right_hand_side.frequency added_masses damping_ratios
        effects.Pressure.rise needed_effects.tolerance
        damper_map.amplitudes collect_and_collide.amplitude""",
    "share": """restitution wall_restitution sleep share theta confidence solve.tolerance
        solve_response.tolerance best_damper.tolerance""",
    "limited": "friction_angle poisson wall_poisson",
    "index": "bodies frame number",
    "whole": "particles seed",
    "any": """about acceleration axis base bend box by displacement factor force history hole notch
        normal phase phases points shapes start_velocity stress t time_s times times_s turned u v
        values value velocity x y spin sizes motion tetrahedra goal boxes filling excitation
        observers amplitude amplitudes effects.Pressure.peak report.measures.Cycles.base_amplitude
        report.measures.Cycles.stiffness report.measures.Cycles.damping
        report.measures.Cycles.mass Oscillator.added_mass Oscillator.frequency
        Oscillator.gravity ModalStructure.frequency""",
    "text": """column group index label name names notes path role source title treated unit
        unread""",
}
#: Values of the right type that a kind does not allow.
OUT_OF_RANGE = {
    "positive": [0.0, -1.0, 1e61, 1e-300],
    "zero or positive": [-1.0, -1e-300, 1e61],
    "share": [-1e-9, 1.0 + 1e-9],
    "limited": [-91.0, 91.0],
    "index": [2**70],
    "whole": [-1, 2**70],
    "word": ["nonsense"],
    "any": [],
    "text": [],
}
_KIND_OF = {name: kind for kind, names in KINDS.items() for name in names.split()}


def kind_of(call, name, text=""):
    """Kind of a parameter of a type, in words."""
    owner = call.rpartition(".")[0]
    named = (_KIND_OF.get(one) for one in (f"{call}.{name}", f"{owner}.{name}", name))
    by_type = "whole" if text.startswith("int") else "word" if "str" in text else "positive"
    return next(filter(None, named), by_type)


class _Stranger:
    def __repr__(self):
        return "a stranger"


_NUMBER = "float numbers array_like"
#: Values of which no type allows all, each with the words of types that allow it.
OF_ANY_TYPE = [
    *((None, "None"), (True, "bool"), (1, f"int {_NUMBER}"), (2**70, f"int {_NUMBER}")),
    (10**400, "int"),
    *((1.5, _NUMBER), ("1", "str path texts"), ("nonsense\0", "str texts")),
    *(("", "str empty texts list"), (["x"], "texts"), ({1: 2}, "mapping")),
    ({_Stranger(): 1}, "mapping"),
    *((one, "") for one in (math.nan, math.inf, -math.inf, 1j, b"x", _Stranger())),
    *((one, "") for one in (np.array("x"), [_Stranger()], [math.nan], [1j], [None])),
    ([[1.0], [2.0, 3.0]], ""),
]


def wrong_values(call, name, text):
    """Values that a parameter of a type, in words, must refuse."""
    heads = words_of(text)
    is_any = text == "Any"
    wrong = [value for value, fits in OF_ANY_TYPE if not (is_any or heads & {*fits.split()})]
    has_kind = heads & {"float", "int", "str", "sequence", "array_like"}
    return wrong + OUT_OF_RANGE[kind_of(call, name, text)] if has_kind else wrong
