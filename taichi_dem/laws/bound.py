"""Effects bound to the tables of an engine, with null objects where a scene lists none."""

from collections.abc import Iterable
from typing import Any

from taichi_dem.laws.base import ABSENT, PARTS_OF_BOND, Effect, bound
from taichi_dem.laws.bond import Separable
from taichi_dem.state.model import ROLES
from taichi_dem.state.tables import Tables


def bound_by_role(effects: Iterable[Effect], tables: Tables) -> tuple[dict[str, list[Any]], Any]:
    """Bound copies of effects by role, null objects where none is listed; the law of bonds."""
    listed = {role: [e for e in effects if e.role == role] for role in ROLES}
    for role, absent in ABSENT.items():
        if not listed[role] and not (listed["bond"] and role in PARTS_OF_BOND):
            listed[role] = [absent()]
    by_role = {role: [bound(effect, tables) for effect in listed[role]] for role in ROLES}
    if by_role["bond"]:
        return by_role, by_role["bond"][0]
    return by_role, Separable(by_role["tension"][0], by_role["shear"][0])
