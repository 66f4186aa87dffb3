"""HTML of a page that is dragged to turn: one file without requests."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from texvol.output.turn_page import views
from texvol.output.turn_page.samples import slice_data
from texvol.scene import orbit
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util import writing
from texvol.util.color import srgb_from_linear
from texvol.util.errors import InputError
from texvol.util.upward import upward
from texvol.util.version import __version__

ROOM = 10_000_000  # bytes of the file
MOST_VIEWS = 10_000
MOST_SIDE = 4096  # pixels
_FRAME = 40_000  # bytes of the file beside views and slices
_FORMATS = (".html", ".htm")


def is_page(path: str | os.PathLike[str]) -> bool:
    """True if the name is that of a page."""
    return Path(path).suffix.lower() in _FORMATS


def last_name(path: str) -> str:
    """Return the name of a file or a folder without the folders above it, which a page that is sent does not tell."""
    return Path(path).name or path


def check(path: str | os.PathLike[str], count: int, size: tuple[int, int]) -> None:
    """Raise InputError if a page of so many views can't be made, or written to `path`."""
    if count > MOST_VIEWS:
        raise InputError(f"--orbit of a page must be at most {MOST_VIEWS} views, got {count}")
    if max(size) > MOST_SIDE:
        raise InputError(
            f"--size of a page must be at most {MOST_SIDE} pixels along each side, got {size[0]}x{size[1]}"
        )
    writing.check_writable(path)


@dataclass
class Collection:
    """Views of a page while they are drawn, and what is said of them.

    Attributes
    ----------
    first : Scene
        Scene whose camera chooses the view that is shown first.
    rows : int
    title : str
    slices : Volume, optional
        Volume whose slices are on the page.
    about : mapping
        Names and texts of the details.
    """

    first: Scene
    rows: int
    title: str
    slices: Volume | None = None
    about: Mapping[str, str] = field(default_factory=dict)
    files: list[bytes] = field(default_factory=list)

    def add(self, picture: Any) -> None:
        """Add the next view."""
        self.files.append(views.first_encoded(np.asarray(picture)))
        self.size = (picture.shape[1], picture.shape[0])

    def html(self, tell: Callable[[int], None] = lambda number: None) -> tuple[str, str]:
        """Return the page, and a sentence about its quality; for `tell` see `views.fitted`.

        Raises
        ------
        InputError
            If the views do not fit in the room of a page.
        """
        slices = None if self.slices is None else slice_data(self.slices)
        # The first view is there twice: once for readers without scripts.
        taken = _FRAME + 4 * max(map(len, self.files)) // 3 + (len(slices["samples"]) if slices else 0)
        # Base64 makes four characters of three bytes, and pads; a view has quotes and a comma besides.
        fitted = views.fitted(self.files, (ROOM - taken) * 3 // 4 - 8 * len(self.files), tell)
        columns = len(self.files) // self.rows
        data = {
            **{"columns": columns, "rows": self.rows, "start": self._start(columns), "kind": views.KIND},
            **{"title": self.title, "size": self.size, "slices": slices},
            "views": [base64.b64encode(each).decode() for each in fitted.files],
        }
        about = {"views": f"{columns} around, {self.rows} elevations" if self.rows > 1 else f"{columns} around"}
        return _page(self.title, data, self._background(), {**self.about, **about}), self._said(fitted)

    def _said(self, fitted: views.Fitted) -> str:
        """Return a sentence on the quality."""
        said = f"{len(fitted.files)} views as WebP of quality {fitted.quality}"
        if fitted.scale < 1:
            width, height = (max(round(fitted.scale * each), 1) for each in self.size)
            said += f" and {width}x{height} pixels"
        return said + (f", lowered to fit in {ROOM / 1e6:.0f} MB" if fitted.is_reduced else "")

    def _start(self, columns: int) -> list[int]:
        """Return column and row of the view that is shown first, the one nearest to the scene's own."""
        camera = self.first.camera
        if self.rows == 1 or camera is None:
            return [0, 0]
        axis = np.array(camera.up) / np.linalg.norm(camera.up)
        elevation = orbit.elevation_of(camera, axis)
        return [0, int(np.abs(np.subtract(orbit.elevations(self.rows), elevation)).argmin())]

    def _background(self) -> str:
        color = np.rint(255 * srgb_from_linear(np.clip(self.first.background, 0, 1))).astype(int)
        return "#" + "".join(f"{each:02x}" for each in color)


def _page(title: str, data: Mapping[str, Any], background: str, about: Mapping[str, str]) -> str:
    levels = [int(background[start : start + 2], 16) for start in (1, 3, 5)]
    is_dark = float(np.dot(levels, (0.299, 0.587, 0.114))) < 128
    numbers = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    how = {"title": title, "slices": data["slices"], "about": about, "background": background}
    first = data["start"][1] * data["columns"] + data["start"][0]
    picture = f"data:{data['kind']};base64,{data['views'][first]}"
    return str(
        _template().render(**how, data=numbers, ink="#eee" if is_dark else "#111", size=data["size"], first=picture)
    )


@cache
def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    loader = PackageLoader("texvol.output.turn_page", "pages")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals["source"] = lambda name: Markup(loader.get_source(environment, name)[0])
    return environment.get_template("turn.html")


def details(scene: Scene, names: Sequence[str] = (), error: float | None = None) -> dict[str, str]:
    """Return names and texts of the details of a page: the volume, the look, the estimated error."""
    volume = scene.volume
    nx, ny, nz = volume.dimensions
    unit = f" {volume.unit}" if volume.unit else ""
    spacing = " x ".join(f"{each:.4g}" for each in volume.spacing)
    medium = scene.looked.transfer_function
    said = (
        "not estimated"
        if error is None
        else f"{upward(error)} of the linear picture of the first view, before compression"
    )
    return {
        "volume": ", ".join(map(last_name, names)) or last_name(volume.name),
        "samples": f"{nx} x {ny} x {nz}, spacing {spacing}{unit}",
        "mode": scene.mode if medium is None else f"{scene.mode}, transfer function {medium.name}",
        "estimated error": said,
        "drawn by": f"texvol {__version__}",
    }
