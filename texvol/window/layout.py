"""Layout of the picture area: the 3D view alone, or beside axial, coronal and sagittal slices.

The four views are of one size (2 x 2), or one of them is large and the others stand in a column at its right. All
slices go through one point of the world, the crosshair; they have one zoom, and one point in the middle.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.probe import Found, holds
from texvol.window.slice_views import SliceView
from texvol.window.slices import NAMES, Slice, slices_of, typical_window
from texvol.window.steering import Viewport

PICTURE = "3D"
VIEWS = ("axial", PICTURE, "coronal", "sagittal")  # 2 x 2, row by row
MODES = (PICTURE, "2x2", *NAMES)  # words of the command; a name makes that slice the large one
_GAP = 2.0  # window coordinates at scale 1
_COLUMN = 0.3  # width of the column beside the large view, of the area's width
_WIDEST = 1.3  # width of a view in the column, of its height
_ZOOMS = 0.25, 64.0
# What the slices of one document show.
_OF_DOCUMENT = ("volume", "slices", "index", "window", "zoom", "middle")


@dataclass
class Layout:
    """State of the layout, and what all slices have in common.

    Attributes
    ----------
    shown : bool
        True if slices are shown beside the 3D view.
    large : str
        Name of the large view, of VIEWS; "" if all are of one size.
    area : Viewport
        Rectangle of all views in the window.
    rectangles : dict
        Rectangle of each shown view, by name.
    planes, pictures : bool
        True if the 3D view shows the outlines of the slices; and the slices themselves.
    opacity : float
        Opacity of further volumes over the first one, from 0 to 1.
    volume : Volume, optional
        Volume that is sliced, the first of the scene; the next three belong to it.
    slices : dict
        Orientation of each slice, by name.
    index : array of shape (3)
        Crosshair, in grid indices of the volume.
    window : (centre, width)
        Values from black to white.
    zoom : float
        Magnification; at 1 all of the volume fits in a view.
    middle : array of shape (3), optional
        World point in the middle of all slices; by default the middle of the volume.
    hovered : Found, optional
        Values under the mouse on a slice, if the probe is on.
    views : dict
        Views of the slices of the last frame, by name, for positions in the window.
    """

    shown: bool = False
    large: str = ""
    area: Viewport = field(default_factory=lambda: Viewport(0, 0, 1, 1))
    rectangles: dict[str, Viewport] = field(default_factory=dict)
    planes: bool = True
    pictures: bool = False
    opacity: float = 0.5
    volume: Volume | None = None
    slices: dict[str, Slice] = field(default_factory=dict)
    index: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    window: tuple[float, float] = (0.5, 1.0)
    zoom: float = 1.0
    middle: NDArray[np.float64] | None = None
    hovered: Found | None = None
    views: dict[str, SliceView] = field(default_factory=dict)
    _looks: WeakKeyDictionary[Any, dict[str, Any]] = field(default_factory=WeakKeyDictionary)
    _windows: WeakKeyDictionary[Volume, tuple[float, float]] = field(default_factory=WeakKeyDictionary)

    def arrange(self, area: Viewport, scale: float, has_scene: bool, foot: float = 0.0) -> Viewport:
        """Divide the area among the views; return the rectangle of the 3D view.

        A foot of that height below all views is left free for the time bar, which would hide annotation.
        """
        area = Viewport(area.x, area.y, area.width, max(area.height - round(foot), 1))
        self.area = area
        shown = self.shown and has_scene
        self.rectangles = rectangles(area, self.large, _GAP * scale) if shown else {PICTURE: area}
        return self.rectangles[PICTURE]

    def become(self, mode: str) -> None:
        """Change the layout: to one of MODES; "" switches slices on or off."""
        if mode in ("", PICTURE):
            self.shown = not self.shown and not mode
        else:
            self.shown, self.large = True, mode if mode in NAMES else ""

    def swap(self, name: str) -> None:
        """Make a view the large one; if it is, make all views of one size."""
        self.large = "" if self.large == name else name

    def alone(self, pixels: tuple[int, int]) -> tuple[int, int]:
        """Return the pixels that the 3D view has without slices beside it, if it has `pixels` now."""
        now = self.rectangles.get(PICTURE, self.area)
        right, down = pixels[0] * self.area.width / now.width, pixels[1] * self.area.height / now.height
        return max(round(right), 1), max(round(down), 1)

    def turn_to(self, document: Any, before: Any) -> None:
        """Remember what slices show of the document before; show what they showed of `document`, if it was shown.

        Otherwise slices begin anew.
        """
        if before is not None:
            self._looks[before] = {name: getattr(self, name) for name in _OF_DOCUMENT}
            self.volume = None
        for name, part in self._looks.get(document, {}).items():
            setattr(self, name, part)

    def follow(self, scene: Scene) -> None:
        """Take over the scene's first volume.

        The crosshair stays on its sample if the samples are the same, and at its point of the world if the volume has
        one there; otherwise it begins in the middle. Each volume keeps its window of values.
        """
        before, volume = self.volume, scene.volume
        if volume is before:
            return
        point = None if before is None else self.crosshair
        self.volume, self.slices = volume, slices_of(volume)
        if before is not None:
            if before.values is volume.values:
                return
            self._windows[before] = self.window
        self.window = self._windows.get(volume) or typical_window(volume)
        if point is not None and holds(volume, point):
            self.move_to(point)
        else:
            self.index = (np.array(volume.dimensions) - 1) / 2
            self.reset()

    def reset(self) -> None:
        """Show all of each slice again."""
        self.zoom, self.middle = 1.0, None

    def number(self, name: str) -> int:
        """Return the number of the sample layer in which a slice lies."""
        return round(float(self.index[self.slices[name].axis]))

    @property
    def crosshair(self) -> NDArray[np.float64]:
        """Crosshair in the world."""
        assert self.volume is not None
        return np.asarray(self.volume.origin + self.volume.world_from_index @ self.index)

    def move_to(self, point: NDArray[np.float64], keep: int | None = None) -> None:
        """Move the crosshair to a world point, or to the nearest one in the volume.

        Parameters
        ----------
        keep : int, optional
            Grid axis along which the crosshair does not move.
        """
        assert self.volume is not None
        index = self.volume.index_from_world @ (point - self.volume.origin)
        index = np.clip(index, 0, np.array(self.volume.dimensions) - 1.0)
        if keep is not None:
            index[keep] = self.index[keep]
        self.index = index

    def step(self, name: str, by: float) -> None:
        """Move a slice by sample layers."""
        assert self.volume is not None
        axis = self.slices[name].axis
        index = self.index.copy()
        index[axis] = np.clip(self.number(name) + by, 0, self.volume.dimensions[axis] - 1)
        self.index = index

    def magnify(self, factor: float, about: NDArray[np.float64], middle: NDArray[np.float64]) -> None:
        """Change the zoom; the world point `about` stays where it is. `middle` is the point in the middle now."""
        zoom = float(np.clip(self.zoom * factor, *_ZOOMS))
        self.middle = about + (middle - about) * (self.zoom / zoom)
        self.zoom = zoom


def rectangles(area: Viewport, large: str, gap: float) -> dict[str, Viewport]:
    """Return the rectangle of each view in an area; sides are whole numbers, at least 1."""
    if not large:
        right, down = round((area.width - gap) / 2), round((area.height - gap) / 2)
        across = (area.x, right), (area.x + right + round(gap), area.width - right - round(gap))
        along = (area.y, down), (area.y + down + round(gap), area.height - down - round(gap))
        places = [(column, row) for row in along for column in across]
        return {name: _rectangle(*place) for name, place in zip(VIEWS, places, strict=True)}
    others = [PICTURE, *NAMES]
    others.remove(large)
    tall = (area.height - 2 * round(gap)) / 3
    wide = round(min(_COLUMN * area.width, _WIDEST * tall))
    left = area.width - wide - round(gap)
    found = {large: _rectangle((area.x, left), (area.y, area.height))}
    ends = [round(position * (tall + round(gap))) for position in range(4)]
    for name, start, end in zip(others, ends, ends[1:], strict=False):
        found[name] = _rectangle((area.x + area.width - wide, wide), (area.y + start, end - start - round(gap)))
    return found


def _rectangle(across: tuple[float, float], along: tuple[float, float]) -> Viewport:
    return Viewport(across[0], along[0], max(across[1], 1), max(along[1], 1))
