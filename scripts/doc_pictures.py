"""Draws the pictures of the documentation into texvol/docs/pictures, from computed volumes only.

    python scripts/doc_pictures.py [--only PAGE,PAGE]

A picture of a page is the output of the command below it: all commands of the page run, in order, in a folder with the
example volumes (`example_volumes.py`). JPEG and PNG are reduced to at most WIDTH pixels; films stay as they are. The
thumbnails of the presets, the figures of slabs, layers and methods and the picture of the window are drawn by functions
here.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from doc_figures import draw_layers, draw_slabs, draw_slicing, draw_thumbnails, draw_window
from doc_methods import draw_methods
from doc_surface_figure import draw_ambiguous
from example_volumes import SPACING, write_volumes
from PIL import Image

from texvol.__main__ import main as texvol_main

DOCS = Path(__file__).resolve().parents[1] / "texvol" / "docs"
PICTURES = DOCS / "pictures"
WIDTH = 400
QUALITY = 88
_FENCE = re.compile(r"(?:<!-- (?P<mark>[^>]*?) -->\n)?```(?P<language>\w*)\n(?P<text>.*?)```", re.DOTALL)
_DRAWN_HERE = {
    "thumbnails": draw_thumbnails, "slabs": draw_slabs, "slicing": draw_slicing, "layers": draw_layers,
    "walks": draw_methods, "screenshot": draw_window, "ambiguous": draw_ambiguous,
}  # fmt: skip


@contextlib.contextmanager
def working_folder() -> Iterator[Path]:
    """A folder with the example volumes, current while it is there."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        write_volumes(Path(name), SPACING)
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)


def run_page(text: str) -> None:
    """Write the files that a page shows, and run its commands and Python blocks."""
    names: dict[str, object] = {}
    for found in _FENCE.finditer(text):
        mark = found["mark"] or ""
        if mark.startswith("file: "):
            Path(mark.removeprefix("file: ")).write_text(found["text"], encoding="utf-8")
        elif found["language"] == "python":
            exec(found["text"], names)
        elif found["language"] == "sh" and not mark.startswith("not run"):
            for command in found["text"].replace("\\\n", "").splitlines():
                words = shlex.split(command, comments=True)
                if words[:1] == ["texvol"]:
                    print(" ", shlex.join(words))
                    if texvol_main(words[1:]) == 2:
                        raise SystemExit(f"failed: {command}")


def keep(page: str, folder: Path) -> None:
    """Reduce and store the pictures that the page names and its commands have drawn."""
    for name in re.findall(r"\]\((?:texvol/docs/)?pictures/([\w.-]+)\)", page):
        target = PICTURES / name
        if target.suffix == ".gif" and (folder / name).exists():
            shutil.copy(folder / name, target)
        drawn = folder / f"{target.stem}.png"
        if target.suffix != ".gif" and drawn.exists():
            store(Image.open(drawn), target)


def store(picture: Image.Image, target: Path, width: int = WIDTH) -> None:
    """Store a picture, at most `width` pixels wide; larger ones are averaged."""
    if picture.width > width * 1.3:
        picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    if target.suffix == ".jpg":
        picture.convert("RGB").save(target, quality=QUALITY, optimize=True)
    else:
        picture.save(target, optimize=True)
    print(f"  {target.name}: {target.stat().st_size / 1000:.0f} kB")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--only",
        metavar="PAGE,PAGE",
        help="pages by name, thumbnails, slabs, slicing, layers, walks, ambiguous, screenshot; all unless told",
    )
    only = parser.parse_args().only
    pages = {path.stem: path for path in [DOCS.parents[1] / "README.md", *sorted(DOCS.glob("*.md"))]}
    chosen = [*pages, *_DRAWN_HERE] if only is None else only.split(",")
    PICTURES.mkdir(exist_ok=True)
    for name in chosen:
        print(name)
        if name in pages:
            text = pages[name].read_text(encoding="utf-8")
            if "pictures/" not in text:
                continue
            with working_folder() as folder:
                run_page(text)
                keep(text, folder)
        else:
            with working_folder() as folder:
                for stem, picture in _DRAWN_HERE[name](folder):
                    store(picture, PICTURES / stem, width=picture.width)
    return 0


if __name__ == "__main__":
    sys.exit(main())
