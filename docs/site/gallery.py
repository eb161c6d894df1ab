"""Page of the gallery: every experiment with its question, picture, command, and what to see."""

import html
from pathlib import Path

from docs.site.markdown import Heading, Page
from taichi_dem.kit.study.entries import ENTRIES, read_entries

#: Texts of the experiments, and the folder of their small pictures, from the root.
TEXTS, PICTURES = f"experiments/{ENTRIES}", "docs/pictures"


def gallery_page(root):
    """Page of all experiments of a repository at a root."""
    entries = read_entries(Path(root, TEXTS))
    parts = list(dict.fromkeys(entry.part for entry in entries))
    content = [
        "<h1>Gallery</h1>",
        "<p>Each experiment is one command. It writes its pictures, tables and "
        "<code>summary.json</code> to a folder of <code>results</code>; <code>make gallery</code> "
        "runs all of them. The small pictures here are from full runs.</p>",
    ]
    headings, files = [], []
    for part in parts:
        content.append(f"<h2>{html.escape(part)}</h2>")
        for entry in entries:
            if entry.part == part:
                picture = f"{PICTURES}/{entry.name}.png"
                shown = picture if Path(root, picture).is_file() else ""
                content.append(_entry(entry, shown))
                headings.append(Heading(2, entry.question, entry.name))
                files += [shown] if shown else []
    return Page("Gallery", "\n".join(content), tuple(headings), tuple(files))


def _entry(entry, picture):
    question = html.escape(entry.question)
    shown = f'<img src="files/{picture}" alt="{question}" loading="lazy">' if picture else ""
    return (
        f'<figure class="experiment"><h3 id="{entry.name}">{question}</h3>{shown}'
        f"<figcaption><p>{html.escape(entry.look)}</p>"
        f"<p><code>{html.escape(entry.command)}</code>, {html.escape(entry.time)}</p>"
        f"</figcaption></figure>"
    )
