"""The gallery as one HTML page that needs nothing else: pictures are inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from gallery_entries import Entry

from texvol.formats.pictures.page_pictures import data_url

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 0; color: #222; background: #f4f4f2 }
main { max-width: 1080px; margin: 0 auto; padding: 28px 20px 60px }
section { display: grid; grid-template-columns: 480px minmax(0, 1fr); gap: 28px; margin: 0 0 36px }
img { max-width: 100%; height: auto; display: block; border-radius: 4px; margin: 0 0 10px }
h1 { font-size: 1.7rem; margin: 0 0 6px } h2 { font-size: 1.15rem; margin: 0 0 6px }
p { margin: 0 0 12px } .dim { color: #666; font-size: .88rem }
pre { background: #fff; border: 1px solid #ddd; border-radius: 4px; padding: 10px 12px; font-size: .8rem;
      white-space: pre-wrap; overflow-wrap: anywhere; margin: 0 0 12px }
details pre { max-height: 320px; overflow: auto }
summary { cursor: pointer; color: #555; font-size: .88rem; margin: 0 0 8px }
@media (max-width: 820px) { section { grid-template-columns: minmax(0, 1fr) } }
"""
_ABOUT = (
    "Each picture is drawn at twice its size and averaged, as light. DATA is the folder of real volumes; transfer "
    "functions and built-in volumes that the commands name are beside this page. The error is the largest that is to "
    "be expected of any pixel of the linear picture before it is averaged, of X-ray and maximum projections as a share "
    "of the range that is shown. At the outline of an opaque surface a pixel is on it or off it."
)

Row = tuple[str, str, str, str]


def page(found: Sequence[tuple[Entry, str, Row]], pictures: Mapping[str, bytes]) -> str:
    """The page's text: entries with the command and the row of the table that belong to each, and PNG files by name."""
    sections = "\n".join(_section(entry, command, row, pictures) for entry, command, row in found)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>texvol: gallery</title>
<style>{_STYLE}</style></head>
<body><main>
<h1>Gallery</h1>
<p class="dim">{escape(_ABOUT)}</p>
{sections}
</main></body></html>
"""


def _section(entry: Entry, command: str, row: Row, pictures: Mapping[str, bytes]) -> str:
    import json

    images = [
        f'<img src="{data_url(pictures[name])}" alt="{escape(name)}">'
        for name in (entry.name, f"{entry.name}-depth")
        if name in pictures
    ]
    _, seconds, modelled, error = row
    transfer = ""
    if entry.transfer_function is not None:
        text = escape(json.dumps(entry.transfer_function, indent=1))
        transfer = f"<details><summary>{escape(entry.name)}.json</summary><pre>{text}</pre></details>"
    return f"""<section><div>{"".join(images)}</div>
<div><h2>{escape(entry.name)}</h2><p>{escape(entry.caption)}</p>
<pre>{escape(command)}</pre>{transfer}
<p class="dim">Modelled: {escape(modelled)}. {seconds} s. Estimated error {error}.</p></div></section>"""
