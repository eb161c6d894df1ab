"""Scene: mesh, material and the effects that act in it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from taichi_dem.kit.data_table import locked
from taichi_dem.kit.display import Pictured, counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.validation import (
    between,
    direction,
    finite,
    flag,
    instance,
    positive,
    real_numbers,
    shown,
    told_apart,
    whole,
    word,
)
from taichi_dem.laws.base import Effect, check_one_material
from taichi_dem.laws.contracts import PARTS_OF_BOND
from taichi_dem.laws.roles import AUTO, LISTED, ChosenEffects, check_effect, chosen_effects
from taichi_dem.loads.traction import check_bonds, checked_stress, tensor_of, with_tractions
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import BodyMaterials, body_materials
from taichi_dem.materials.bond_strength import bond_strength, given_strength, strongest
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.mesh.topology import check_free, may_meet, parts_of
from taichi_dem.state.model import MANY, Model, names_of

#: Share of an opening at which a law begins, and of a mean speed, at which no body wakes others.
SLEEP = 1e-6


@dataclass(frozen=True, eq=False)
class Scene(Pictured):
    """A block of bonded bodies and the effects that act in it; its input is checked here.

    Parameters
    ----------
    mesh : Mesh
        Tetrahedra and face groups.
    material : Material
        Constants of bodies and bonds.
    effects : sequence of Effect or str, default ()
        A list: exactly these effects are computed. ``"auto"``: the laws of the material, contact
        by ``BodyContact`` and ``StickingFriction``, where and when they act. ``"all"``: everywhere.
    max_speed : float, default 10000.0
        Speed beyond which a run counts as diverged [m/s].
    loads : iterable of Effect, default ()
        With ``"auto"`` or ``"all"``: loads, supports, and laws in place of the usual ones.
    sleep : float, optional
        With ``"auto"``: share below which a body's neighbours sleep, of the opening at which a law
        of their bond begins, and of their part's mean speed. None: 1e-6; at most 0.01, 0: none.
    unbonded : iterable of str, default ()
        Names of groups of inner faces without bonds from the start, as a notch or an open joint.
    weaker : mapping, optional
        Share of the area of its faces that is bonded, above 0 and at most 1, by the name of a group
        of inner faces. Stiffness, damping, strength, cohesion and fracture energy per area of the
        face are that share of the material's; openings at the limits and the friction angle stay.
    materials : mapping, optional
        Material of the bodies of a group by the name of a body group; all other bodies have
        ``material``. ``body_materials.joined`` has the rule for bonds and contacts between two.
    velocity : array_like or mapping or function, optional
        Velocities of the bodies at the start [m/s]: a vector for all, a vector by body group
        (``Mesh.body_groups``; other bodies are at rest), a row for each body, (body_count, 3), or a
        function of their centres [m] that returns such rows. None: at rest.
    spin : array_like or mapping or function, optional
        Spins likewise [rad/s]. Bodies that share a vector, all or a group, turn together as a rigid
        body about the centre of their volume: the velocities of that turn are added to
        ``velocity``. Rows are spins of the bodies about their own centres. None: no spin.
    stress : sequence of float, optional
        Stress at the start, components xx, yy, zz, xy, yz and zx [Pa], compression negative: every
        bond begins with its traction. Supports hold it, and quiet boundaries, which get a
        ``Traction`` of it; any other face is free, as if just cut. None: no stress.
    strength : array_like or function, optional
        Strength of each bond over that of the material, (bond_count,), or a function of the middles
        of their faces [m], (bond_count, 3), that returns it; times ``strength_spread``. None: 1.
    seed : int, default 0
        Seed of ``Material.strength_spread``, 0 to 2147483647.

    Attributes
    ----------
    initial_motion : mapping
        Arrays "velocity" and "spin" at the start, (body_count, 3); empty for a scene at rest.

    Examples
    --------
    >>> gas = effects.GasPressure(group="hole", peak=575e6)
    >>> Scene(read_mesh(PAPER_BLOCK), CONCRETE, effects="auto", loads=[gas]).on_demand
    True
    """

    mesh: Mesh
    material: Material
    effects: Any = ()
    max_speed: float = 1e4
    loads: Iterable[Effect] = ()
    sleep: float | None = None
    unbonded: Iterable[str] = ()
    weaker: Mapping[str, float] = field(default_factory=dict)
    materials: Mapping[str, Material] = field(default_factory=dict)
    velocity: Any = None
    spin: Any = None
    stress: Any = None
    strength: Any = None
    seed: int = 0

    #: Not among the options: arguments of ``State.set_motion``, none for a scene at rest.
    initial_motion: ClassVar[Mapping[str, np.ndarray]] = {}
    #: Not among the options: the material of each body.
    body_materials: ClassVar[BodyMaterials]
    #: Strength of each bond over that of its material, (bond_count,); None where all have 1.
    bond_strength: ClassVar[np.ndarray | None]

    def __post_init__(self):
        instance("mesh", self.mesh, Mesh)
        instance("material", self.material, Material)
        object.__setattr__(self, "mesh", _bonded(self))
        laid = body_materials(self.mesh, self.material, self.materials)
        object.__setattr__(self, "body_materials", laid)
        object.__setattr__(self, "materials", dict(self.materials))
        object.__setattr__(self, "loads", _listed("loads", self.loads))
        object.__setattr__(self, "effects", _effects_of(self))
        _check_types(self)
        if self.stress is not None:
            object.__setattr__(self, "stress", checked_stress("stress", self.stress))
            more = with_tractions(self.effects, self.stress)
            object.__setattr__(self, "effects", ChosenEffects(more, self.effects.word))
        object.__setattr__(self, "sleep", _sleep_of(self))
        _check_roles(self.effects)
        whole("seed", self.seed, 0, 2**31 - 1)
        object.__setattr__(self, "bond_strength", bond_strength(laid, self.strength, self.seed))
        for material in strongest(laid.checked_pairs(), self.bond_strength):
            for effect in self.effects:
                effect.check_material(material)
        for effect in self.effects:
            check_one_material(effect, laid)
            if hasattr(effect, "group"):
                self.mesh.group_faces(effect.group)
                check_free(self.mesh, effect.group)
        object.__setattr__(self, "max_speed", positive("max_speed", self.max_speed))
        object.__setattr__(self, "initial_motion", _motion_of(self))
        if self.stress is not None:
            check_bonds(self.model())

    def __getstate__(self) -> dict[str, Any]:
        """All but functions, which no process can send to another: their rows instead."""
        state = dict(vars(self))
        if callable(self.velocity) or callable(self.spin):
            rest = {"velocity": None, "spin": None}
            state.update({**rest, **self.initial_motion})
        if callable(self.strength):
            state["strength"] = given_strength(self.mesh, self.strength)
        return state

    def __repr__(self):
        named = zip(names_of(self.effects), self.effects)
        effects = ", ".join(name or type(effect).__name__ for name, effect in named)
        words = f"effects {effects}" if effects else "no effects"
        return in_brief(self, counted(self.mesh.body_count, "body"), words)

    def model(self) -> Model:
        """Return the scene as arrays of bodies, bonds and effects."""
        stress = None if self.stress is None else tensor_of(self.stress)
        return Model(self.mesh, self.body_materials, self.effects, stress, self.bond_strength)

    @property
    def on_demand(self) -> bool:
        """Whether effects are evaluated only where they act: effects="auto"."""
        return self.effects.word == AUTO

    def effect(self, role: str) -> Any:
        """Effect of a role that takes one; None where none is listed.

        Parameters
        ----------
        role : str
            Role, such as ``"contact"``.
        """
        word("role", role)
        return next((effect for effect in self.effects if effect.role == role), None)

    def damped(self, touching: bool = True) -> bool:
        """Whether a dashpot acts.

        Parameters
        ----------
        touching : bool, default True
            Whether dashpots of contacts count.
        """
        flag("touching", touching)
        roles = {effect.role for effect in self.effects if effect.name}
        bonds = "dashpot" in roles and self.body_materials.has_bond_damping
        return bonds or (touching and "contact" in roles and any(_drags(self)))


def _effects_of(scene):
    """Effects as a ``ChosenEffects``, from a list, a word, or those of another scene."""
    given = scene.loads
    if isinstance(scene.effects, str):
        return chosen_effects(scene.effects, scene.mesh, scene.body_materials, given)
    word = getattr(scene.effects, "word", None)
    effects = _listed("effects", scene.effects)
    if given and word in (None, LISTED):
        raise InputError(
            "loads must be left out where effects is a list: put them into this list, "
            f"got {shown(scene.loads)}"
        )
    # A scene that was made from a word hands both on, as dataclasses.replace does.
    more = [load for load in given if not any(load is effect for effect in effects)]
    return ChosenEffects((*effects, *more), *([word] if word else []))


def _listed(name, effects):
    unordered = isinstance(effects, (str, set, frozenset))
    listed = hasattr(effects, "__iter__") and getattr(effects, "ndim", 1) != 0
    if unordered or not listed:
        raise InputError(f"{name} must be a list of effects, got {shown(effects)}")
    return tuple(effects)


def _bonded(scene):
    """The mesh with the bonds that its scene asks for; keeps both options for good."""
    names, weaker = scene.unbonded, scene.weaker
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InputError(f"unbonded must be a list of names of groups, got {shown(names)}")
    if not isinstance(weaker, Mapping):
        raise InputError(f"weaker must be a dict of group to share, got {shown(weaker)}")
    if not all(finite(share) and 0.0 < share <= 1.0 for share in weaker.values()):
        raise InputError(f"weaker must have shares above 0 and at most 1, got {shown(weaker)}")
    shares = {name: float(share) for name, share in weaker.items()}
    both = sorted(name for name in names if name in shares)
    if both:
        raise InputError(f"weaker must not have a group that is unbonded, got {both[0]} in both")
    object.__setattr__(scene, "unbonded", tuple(names))
    object.__setattr__(scene, "weaker", shares)
    return scene.mesh.bonded_by({**shares, **dict.fromkeys(names, 0.0)})


def _motion_of(scene):
    """Arrays of the motion at the start, which cannot be written to; keeps both options."""
    for name in ("velocity", "spin"):
        given = getattr(scene, name)
        if isinstance(given, np.ndarray):
            object.__setattr__(scene, name, locked(given.copy()))
    motion = initial_motion(scene.mesh, scene.velocity, scene.spin)
    fastest = length(motion["velocity"]).max() if motion else 0.0
    if fastest > scene.max_speed:
        got, most = told_apart(fastest, scene.max_speed, 6)
        raise InputError(f"velocity must be at most max_speed, {most} m/s, got {got} m/s")
    return {name: locked(rows) for name, rows in motion.items()}


def _sleep_of(scene):
    """Share below which a body wakes no neighbour."""
    if scene.sleep is None:
        return SLEEP if scene.on_demand else 0.0
    sleep = between("sleep", scene.sleep, 0.0, 0.01)
    if sleep and not scene.on_demand:
        raise InputError(f"sleep must be 0 unless effects is 'auto', got {sleep:g}")
    return sleep


def _check_types(scene):
    for effect in scene.effects:
        if not isinstance(effect, Effect):
            raise InputError(
                f"effects must be objects from taichi_dem.effects, got {shown(effect)}"
            )
        check_effect(effect)


def _check_roles(effects):
    single = [effect for effect in effects if effect.role not in MANY]
    for effect in single:
        others = [e.name for e in single if e.role == effect.role]
        if len(others) > 1:
            raise InputError(
                f"effects {' and '.join(others)} both take the role {effect.role}: list one"
            )
    roles = {effect.role for effect in single}
    parts = [e.name for e in single if e.role in PARTS_OF_BOND]
    if "bond" in roles and parts:
        whole = next(effect.name for effect in single if effect.role == "bond")
        raise InputError(
            f"effect {whole} is the whole law of bonds, opening and sliding: leave out "
            f"{' and '.join(parts)}"
        )
    if "friction" in roles and "contact" not in roles:
        raise InputError("effect friction acts in contacts: list BodyContact too")


def scene_warnings(scene: Any) -> tuple[str, ...]:
    """Warnings before a run: effects listed or left out in vain, strengths that were lowered."""
    weakened = scene.body_materials.weakened
    return (*outer_faces_warnings(scene), *_friction_warnings(scene), *weakened)


def _friction_warnings(scene):
    """Friction without springs is a drag up to its limit, so without a dashpot it is none."""
    friction = scene.effect("friction")
    if friction is None or friction.remembers or all(drags := _drags(scene, rough=True)):
        return ()
    never = "never acts on bodies of a material" if any(drags) else "never acts"
    return (
        f"{friction.name} {never}: it is at most the dashpot of the contact, and "
        f"{scene.effect('contact').undamped}; StickingFriction acts by springs instead",
    )


def _drags(scene, rough=False):
    """Whether contacts of each material, or of each with friction, have dashpots."""
    contact = scene.effect("contact")
    own = [row[k] for k, row in enumerate(scene.body_materials.pairs)]
    return [contact.is_damped(law) for law in own if law.friction or not rough]


def remedy(contact: object) -> str:
    """How bodies touch at their outer faces; contact: the effect of a scene, None without."""
    return f"{type(contact).__name__ if contact else 'BodyContact'}(outer_faces=True)"


def outer_faces_warnings(scene: Any) -> tuple[str, ...]:
    """Warnings before a run: parts of a scene that may meet and would not touch."""
    # A solid in one piece cannot meet itself until it breaks, which the run detects. Parts without
    # contact are not reported where they stay at rest, fall alike or are too far apart.
    contact = scene.effect("contact")
    if contact and contact.geometry.outer_faces:
        return ()
    part = parts_of(scene.mesh)
    count = part.max() + 1
    apart = count > 1 and (contact or may_meet(scene, part))
    cut = not contact and scene.mesh.has_open_faces
    if not (apart or cut or scene.mesh.keep_coincident):
        return ()
    lack = "contact leaves out their outer faces" if contact else "no contact is listed"
    if not apart:
        why = "coincident points of the mesh are kept apart, no bond joins the faces on them"
        if not scene.mesh.keep_coincident:
            why = "faces of the mesh are unbonded"
        return (
            f"{why}, and {lack}: bodies pass through each other there; {remedy(contact)} lets them "
            "touch",
        )
    return (
        f"the mesh has {count} parts that no bond joins, and {lack}: "
        f"where these parts meet they pass through each other; {remedy(contact)} lets them touch",
    )


def initial_motion(mesh: Mesh, velocity: object, spin: object) -> dict[str, np.ndarray]:
    """Velocity and spin of every body at the start, as options of ``State.set_motion``."""
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    moves, _ = _rows("velocity", velocity, mesh, centre)
    turns, shared = _rows("spin", spin, mesh, centre)
    for bodies, turn in shared:
        volume = volumes(mesh)[bodies]
        middle = (volume[:, None] * centre[bodies]).sum(axis=0) / volume.sum()
        moves[bodies] = moves[bodies] + np.cross(turn, centre[bodies] - middle)
    if not (moves.any() or turns.any()):
        return {}
    return {"velocity": moves, "spin": turns}


def _rows(name, given, mesh, centre) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    if given is None:
        return np.zeros_like(centre), []
    if isinstance(given, Mapping) and given:
        return _by_group(name, given, mesh)
    rows = given(centre.copy()) if callable(given) else given
    array = real_numbers(name, rows)
    single = array.shape == (3,) and not callable(given)
    if not (single or array.shape == centre.shape):
        raise InputError(
            f"{name} must be three numbers, for all bodies or by body group, or three for each of "
            f"{len(centre)} bodies, as an array or by a function of their centres, "
            f"got {shown(rows)}"
        )
    shared = [(np.arange(len(centre)), array)] if single else []
    return np.array(np.broadcast_to(array, centre.shape)), shared


def _by_group(name, given, mesh):
    """The same from vectors by body group; bodies in none are at rest."""
    rows, shared = np.zeros((mesh.body_count, 3)), []
    taken = np.zeros(mesh.body_count, dtype=bool)
    for group, value in given.items():
        try:
            bodies = mesh.group_bodies(group)
        except InputError as error:
            raise InputError(
                f"{name} must have names of body groups, got {shown(given)}: {error}"
            ) from None
        vector = np.array(direction(f"{name}[{group!r}]", value))
        if taken[bodies].any():
            raise InputError(
                f"{name} must have each body in one group at most, got body "
                f"{bodies[taken[bodies]][0]} in {group} and in another"
            )
        rows[bodies], taken[bodies] = vector, True
        shared.append((bodies, vector))
    return rows, shared
