"""Contracts between parts, written as Protocols, and checks that an object keeps one."""

import inspect
from typing import Any

from taichi_dem.kit.errors import InputError


def members_of(contract: Any) -> dict[str, str]:
    """Purpose of each member of a Protocol, in words, by name."""
    public = {name: member for name, member in vars(contract).items() if name[0] != "_"}
    declared = dict.fromkeys(vars(contract).get("__annotations__", ()), "")
    documented = {name: inspect.getdoc(member) or "" for name, member in public.items()}
    return {
        name: text.splitlines()[0].rstrip(".") if text else ""
        for name, text in {**declared, **documented}.items()
    }


def check_members(what: str, thing: Any, members: dict[str, str]) -> None:
    """InputError that names the first of the members that a thing does not have."""
    for name, purpose in members.items():
        if not hasattr(thing, name):
            words = f" ({purpose})" if purpose else ""
            # Its repr may use the member itself.
            kind = thing if isinstance(thing, type) else type(thing)
            raise InputError(f"{what} must have {name!r}{words}, got {kind.__name__} without it")
