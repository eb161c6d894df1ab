"""What a parameter takes: values of the type in its docstring, and of its kind."""

import math
import numbers
import re
from collections.abc import Mapping

import numpy as np

from taichi_dem.kit.validation import finite


def _is_number(value):
    return finite(value)


def _is_array(value):
    try:
        found = np.asarray(value)
    except ValueError:
        return False
    return finite(value) or (found.dtype.kind in "iuf" and bool(np.isfinite(found).all()))


def _is_file_name(value):
    return isinstance(value, str) and bool(value) and "\0" not in value


#: Whether a value is of a type, by the first word of it in a docstring. Any other word is a class,
#: of which no value here is.
RIGHT = {
    "float": _is_number,
    "int": lambda value: isinstance(value, numbers.Integral) and not isinstance(value, bool),
    "bool": lambda value: isinstance(value, bool),
    "str": lambda value: isinstance(value, str),
    "auto": lambda value: isinstance(value, str),
    **dict.fromkeys(("path", "file"), _is_file_name),
    **dict.fromkeys(("callable", "function"), callable),
    **dict.fromkeys(("array_like", "ndarray"), _is_array),
    **dict.fromkeys(("mapping", "dict"), lambda value: isinstance(value, Mapping)),
    "None": lambda value: value is None,
}


def _heads(text):
    return [re.search(r"\w+", part)[0] for part in re.split(r" or |, (?!default)", text)]


def _is_list(value, text):
    """Whether it is a sequence of what a type says: numbers, text, or objects of a class."""
    if not isinstance(value, (list, tuple, str)):
        return " float" in text and _is_number(value)  # one instead of several
    of = "str" if " str" in text else "float"
    return all(RIGHT[of](one) for one in value)


def is_right(value, text):
    """Whether a value is of the type of a parameter, such as "float or sequence of float"."""
    if re.search(r", (optional|default None)", text) and value is None:
        return True
    if text == "Any" or (text.endswith('default ""') and value == ""):
        return True
    heads = _heads(text)
    lists = {"sequence", "list", "tuple", "iterable"} & {*heads}
    return (bool(lists) and _is_list(value, text)) or any(
        RIGHT[head](value) for head in heads if head in RIGHT
    )


#: Kind of each number and word by the name of the parameter; of a call alone as "Call.name".
KINDS = {
    "positive": """density young tensile_strength fracture_energy shear_energy exponent
        normal_stiffness shear_stiffness
        contact_stiffness dt0 dt distance tolerance refresh safety angle ahead peak rise fall
        decay_ratio skin stiffness_ratio p_speed s_speed max_speed scale width height length radius
        thickness element size particle_mass diameter reference_speed wall_young v_max mass
        stiffness atol interval duration until budget_s seconds frequency frequencies Every.time_s
        wall_s every_s every_wall_s slip_energy ratio ratios low high step ImpactDamper.clearance
        masses""",
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
    "whole": """body columns rows count cycles divisions done every_steps force_place frame_every
        frames heights level_jump macro_step measured_cycles modes neighbours_per_body
        pairs_per_body particles effects.BodyContact.parts place record_every
        recorded_samples s sample_every samples scatter scene scenes sectors seed seeds
        spheres_per_body steps substeps sweeps threads total transient_cycles""",
    "word": """accounting accumulator arch colour dashpot driver effects friction_law
        if_diverged kind measure mount neighbour of outer_faces pair_rule rules search
        start traversal way progress term Spheres.damping""",
    "any": """about acceleration axis base bend box by displacement factor force history hole notch
        normal phase phases points shapes start_velocity t time_s times times_s turned u v values
        value velocity x y spin sizes motion tetrahedra goal boxes filling excitation observers
        amplitude amplitudes effects.Pressure.peak report.measures.Cycles.base_amplitude
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


def kind_of(call, name):
    """Kind of a parameter; None where none is declared."""
    owner = call.rpartition(".")[0]
    named = (_KIND_OF.get(one) for one in (f"{call}.{name}", f"{owner}.{name}", name))
    return next(filter(None, named), None)


class _Stranger:
    def __repr__(self):
        return "a stranger"


#: Values of which no type allows all.
OF_ANY_TYPE = [
    *(None, True, 1, 1.5, math.nan, math.inf, -math.inf, 10**400, 1j, "nonsense\0", "1", b"x"),
    *(_Stranger(), np.array("x"), [_Stranger()], [math.nan], ["x"], [1j]),
    *([None], [[1.0], [2.0, 3.0]], {1: 2}, {_Stranger(): 1}, "", 2**70),
]


def wrong_values(call, name, text):
    """Values that a parameter of a type, in words, must refuse; None where its kind is unknown."""
    wrong = [value for value in OF_ANY_TYPE if not is_right(value, text)]
    if not {"float", "int", "str", "sequence", "tuple", "array_like", "ndarray"} & {*_heads(text)}:
        return wrong
    kind = kind_of(call, name)
    return None if kind is None else wrong + OUT_OF_RANGE[kind]
