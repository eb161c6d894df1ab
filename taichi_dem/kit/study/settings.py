"""Settings of a study as one table: value of the full job, of the quick job, option, help."""

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from taichi_dem.kit.files import output_folder

#: Name -> (full, quick), or (full, quick, type, help) for a setting that is an option too.
Settings = Mapping[str, tuple]


def add_settings(made: ArgumentParser, settings: Settings, **defaults: Any) -> ArgumentParser:
    """Add an option for each setting that has a type; returns the parser.

    defaults: of options that the parser already has.
    """
    for name, (_, _, *option) in settings.items():
        if option:
            kind, words = option
            made.add_argument(
                f"--{name.replace('_', '-')}", type=kind, help=words.replace("%", "%%")
            )
    made.set_defaults(**defaults)
    return made


def take_settings(options: Namespace, settings: Settings) -> None:
    """Give each setting that no option has set its value in the full or in the quick job."""
    for name, (full, quick, *_) in settings.items():
        if getattr(options, name, None) is None:
            setattr(options, name, quick if options.quick else full)


def begin(options: Namespace, settings: Settings = MappingProxyType({})) -> Path:
    """Take settings that ``main`` does not know; make the folder for the output."""
    take_settings(options, settings)
    return Path(output_folder(options.out))
