"""Display of objects: a line or two at a prompt, HTML in a notebook."""

import base64
import html
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import fields
from inspect import signature
from typing import Any, ClassVar

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_bytes
from taichi_dem.kit.validation import FileName, path_name, shown

#: Lines of a report of which not all is asked for.
BRIEF = 15
#: Letters of a representation at a prompt.
_LONGEST = 400
#: Longest sequence of numbers that is listed; longer ones are shown by their ends.
_LISTED = 6
_PICTURE = "max-width:100%"


def in_brief(thing: object, *parts: str) -> str:
    """``<Class: part, part>``, the representation of an object; empty parts are left out."""
    text = ", ".join(part for part in parts if part)
    if len(text) > _LONGEST:
        text = f"{text[: _LONGEST - 3]}..."
    return f"<{type(thing).__name__}: {text}>"


def by_fields(thing: Any) -> str:
    """Representation of a dataclass that names its fields, arrays by their shape."""
    values = (f"{field.name}={_short(getattr(thing, field.name))}" for field in fields(thing))
    return f"{type(thing).__name__}({', '.join(values)})"


def _short(value):
    if isinstance(value, np.ndarray):
        return f"array {value.shape}"
    if isinstance(value, (dict, list, tuple)) and len(value):
        return f"{type(value).__name__} of {len(value)}"
    return f"{value:.6g}" if isinstance(value, float) else shown(value)


def by_arguments(thing: object, *parts: object) -> str:
    """Representation of an object as the call that made it, from its attributes and its parts'."""
    names, values = signature(type(thing)).parameters, {}
    for part in (*parts, thing):
        values.update(vars(part))
    kept = {name: values.get(f"_{name}", values.get(name)) for name in names}
    texts = {name: _argument(value) for name, value in kept.items()}
    arguments = ", ".join(f"{name}={text}" for name, text in texts.items() if text)
    return f"{type(thing).__name__}({arguments})"


def _argument(value):
    """A plain value or a short vector as text; "" for anything else, such as a field."""
    if isinstance(value, np.ndarray):
        value = tuple(value.tolist())
    return shown(value) if isinstance(value, (str, bool, int, float, tuple)) else ""


def counted(count: int, what: str) -> str:
    """A number with its noun: "1 frame", "2,898 bodies"."""
    plural = f"{what[:-1]}ies" if what.endswith("y") else f"{what}s"
    return f"{count:,} {what if count == 1 else plural}"


def scale(largest: float, unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which a value has one to three digits before the point."""
    thousands = math.log10(largest) / 3.0 if 0.0 < largest < math.inf else 0.0
    power = min(4, max(-4, math.floor(thousands + 1e-9)))
    return 1e3**-power, f"{('p', 'n', 'µ', 'm', '', 'k', 'M', 'G', 'T')[power + 4]}{unit}"


def prefixed(value: float, unit: str) -> str:
    """A number with its unit, from pico to tera: "20 ms", "3.2 M evaluations/s"."""
    factor, name = scale(value, f" {unit}" if len(unit) > 3 else unit)
    return f"{value * factor:.3g} {name.lstrip()}"


def listed(values: Collection[float]) -> str:
    """Numbers in words: "10, 20, 30", or "10 to 400 (40 values)" where they are many."""
    if len(values) <= _LISTED:
        return ", ".join(f"{value:g}" for value in values)
    return f"{min(values):g} to {max(values):g} ({len(values)} values)"


def in_lines(rows: Mapping[str, str], warnings: Sequence[str] = (), most: int | None = None) -> str:
    """Rows of text by name, then a line a warning; rows without text are left out."""
    lines = [
        f"{'' if k else name:18s} {text}"
        for name, texts in rows.items()
        for k, text in enumerate(texts.splitlines())
    ]
    lines += [f"warning: {words}" for words in warnings]
    if most is not None and len(lines) > most:
        lines[most - 1 :] = [f"and {len(lines) - most + 1} more lines: report.details()"]
    return "\n".join(lines)


def table(rows: Iterable[Iterable[object]], head: Sequence[str]) -> str:
    """HTML table of rows of text, escaped; head: names of the columns."""
    # Half a second that nothing else shall wait for.
    import pandas

    return pandas.DataFrame(list(rows), columns=list(head)).to_html(index=False, border=0)


def embedded(png: bytes, alt: str) -> str:
    """HTML of a PNG image with its data embedded; alt: description in words."""
    data = base64.b64encode(png).decode("ascii")
    source = f"data:image/png;base64,{data}"
    return f'<img style="{_PICTURE}" alt="{html.escape(alt)}" src="{source}">'


def titled(title: str, *sections: str, warning: str = "") -> str:
    """HTML of a title, a warning in red where there is one, and sections of HTML below them."""
    lines = [f"<p><b>{html.escape(title)}</b></p>"]
    if warning:
        lines.append(f'<p style="color:#B00020">{html.escape(warning)}</p>')
    return f"<div>{''.join([*lines, *sections])}</div>"


def verbatim(text: str) -> str:
    """HTML of text as it stands."""
    return f"<pre>{html.escape(text)}</pre>"


class Worded:
    """Base of what a notebook shows in words: all of ``details()`` where there are any."""

    def _repr_html_(self) -> str:
        details = getattr(self, "details", self.__str__)
        return titled(type(self).__name__, verbatim(details()))


class Pictured:
    """Base of what layers above draw, which set ``png``: the picture of such an object."""

    png: ClassVar[Callable[[Any], bytes]]

    def picture(self, path: FileName) -> None:
        """Write a PNG picture of the outer faces, coloured by group, with axes in m.

        Of a scene it shows what acts on each group.

        Parameters
        ----------
        path : path
            File; its name ends in .png.
        """
        name = path_name("path", path)
        if not name.lower().endswith(".png"):
            raise InputError(f"path must end in .png, got {name}")
        write_bytes(name, Pictured.png(self))

    def _repr_html_(self) -> str:
        return titled(repr(self), embedded(Pictured.png(self), "The mesh, coloured by group"))
