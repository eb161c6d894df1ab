"""Further entries of summary.json, such as the certificate of a run."""

import json
import os
from typing import Any

from taichi_dem.kit.files import write_text


def add_to_summary(folder: str, **entries: Any) -> None:
    """Add entries, which JSON can hold, by name to the summary.json that ``finish`` wrote."""
    path = os.path.join(folder, "summary.json")
    with open(path, encoding="utf-8") as file:
        content = json.load(file)
    write_text(path, json.dumps({**content, **entries}, indent=1))
