"""Picture: an array of a drawn scene that knows what it shows and how far it may be off."""

from __future__ import annotations

import os
import sys
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.scene.display import Window, found_window, shown
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.util import writing
from texvol.util.color import srgb_from_linear
from texvol.util.errors import InputError
from texvol.util.kept_arrays import checksum_of_all
from texvol.util.upward import upward

_DRAWS_IMAGES = "matplotlib.image"
_CALLS_BETWEEN = 4  # from there to `view`: set_data, safe_masked_invalid, masked_where


class Draws(Protocol):
    """Renderer, as a picture needs it."""

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last picture."""

    @property
    def last(self) -> Drawn | None:
        """Scene and settings of the last picture, while they can be asked about."""


@dataclass(eq=False)
class Drawn:
    """Scene and settings that a picture was drawn from.

    Parameters
    ----------
    scene : Scene
        With its camera, transfer function and classification.
    settings : dict
        Arguments of `Renderer.render` that draw it again.
    attributes : mapping
        Further entries of a file's header.
    error : float, optional
        Estimated error, if it was found while drawing.
    again : callable
        Draws the scene again, and returns the report.
    """

    scene: Scene
    settings: dict[str, Any]
    attributes: Mapping[str, str]
    error: float | None
    again: Callable[[], dict[str, Any]]
    renderer: weakref.ReferenceType[Draws] | None = None
    known: dict[str, Any] = field(default_factory=dict)
    numbers: tuple[tuple[int, ...], int] | None = None  # shape and checksum of the picture as it was drawn

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"renderer": None}  # a context stays in its process

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the drawing; see `Picture.stats`."""
        if not self.known:
            renderer = self.renderer() if self.renderer is not None else None
            self.known = renderer.stats if renderer is not None and renderer.last is self else self.again()
        return self.known


def drawn_again(
    make: Callable[[], Any], scene: Scene, size: tuple[int, int], settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Draw a scene by a renderer that `make` returns, and return the report."""
    with make() as renderer:
        renderer.render(scene, size, **settings)
        report: dict[str, Any] = renderer.stats
        return report


class Picture(np.ndarray[tuple[int, int, int], np.dtype[np.float32]]):
    """Picture of a scene, an array of shape (height, width, 4): linear light, premultiplied, top row first.

    It knows its scene, settings, report and error as long as its numbers are those that were drawn, however they were
    changed: a checksum of all is compared whenever they are asked for. Computing with it gives plain arrays; a copy
    knows as much as the picture itself, also in another process. It keeps its scene in memory.
    `plt.imshow(picture)` shows it in sRGB over its background, as a file of it does; and a part of it, such as
    `picture[10:20]`, as well, which knows nothing else.

    Attributes
    ----------
    transparent : bool
        True if files and what else shows it keep the opacity unless told otherwise.
    """

    _made_from: Drawn | None
    transparent: bool

    @classmethod
    def of(cls, array: NDArray[np.floating], drawn: Drawn) -> Picture:
        """Return the array as the picture of what was drawn."""
        picture = array.view(cls)
        drawn.numbers, picture._made_from = _identified(picture), drawn
        return picture

    @classmethod
    def restored(cls, array: NDArray[np.floating], drawn: Drawn | None, transparent: bool = False) -> Picture:
        """Return a picture that was pickled, or a part of one."""
        picture = array.view(cls)
        picture._made_from, picture.transparent = drawn, transparent
        return picture

    def __array_finalize__(self, other: Any) -> None:
        self._made_from = getattr(other, "_made_from", None)
        self.transparent = getattr(other, "transparent", False)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = (), **named: Any) -> Any:
        """Compute with plain arrays."""
        if out:
            named["out"] = tuple(_plain(each) for each in out)
        found = getattr(ufunc, method)(*(_plain(each) for each in inputs), **named)
        return out[0] if len(out) == 1 else found

    def __getitem__(self, key: Any) -> Any:
        found = _plain(self)[key]
        is_part = isinstance(found, np.ndarray) and found.ndim == 3 and found.shape[2] == 4
        is_colored = self._is_picture and not self._holds_numbers
        return Picture.restored(found, None, self.transparent) if is_part and is_colored else found

    def __reduce__(self) -> Any:
        drawn = self._made_from if self._holds_numbers else self.drawn
        return Picture.restored, (_plain(self), drawn, self.transparent)

    def __deepcopy__(self, memo: dict[int, Any] | None) -> Picture:
        return self.copy()

    def view(self, *how: Any, **named: Any) -> Any:
        """Return a view, as of any array.

        matplotlib takes images for straight sRGB colours and has no way to be told otherwise, but asks every array for
        a masked view, which is answered with such colours.
        """
        if how and getattr(how[0], "__name__", "") == "MaskedArray" and _is_asked_by_matplotlib():
            return _shown_by_matplotlib(self).view(*how, **named)
        return super().view(*how, **named)

    @property
    def drawn(self) -> Drawn | None:
        """Scene and settings that the picture was drawn from; None if its numbers are others than were drawn."""
        drawn = self._made_from
        return drawn if drawn is not None and drawn.numbers == _identified(self) else None

    @property
    def scene(self) -> Scene | None:
        """Scene of the picture, with its camera, transfer function and classification; None once it was changed."""
        drawn = self.drawn
        return None if drawn is None else drawn.scene

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments of `Renderer.render` that draw the picture again."""
        drawn = self.drawn
        return {} if drawn is None else dict(drawn.settings)

    @property
    def stats(self) -> dict[str, Any]:
        """Report in JSON types, as `Renderer.stats`, found when first asked for.

        If the renderer has drawn another picture or was closed meanwhile, the picture is drawn once more for it, and
        the seconds are those of that.
        """
        drawn = self.drawn
        return {} if drawn is None else drawn.stats

    @property
    def error(self) -> float | None:
        """Estimated maximum absolute error against the integral of the picture's classification; None if unknown."""
        drawn = self.drawn
        if drawn is None or drawn.error is not None:
            return None if drawn is None else drawn.error
        found: float | None = drawn.stats.get("estimated_error")
        return found

    def to_srgb(self, *, transparent: bool | None = None, window: Window | None = None) -> NDArray[np.uint8]:
        """Return the picture in sRGB, shape (height, width, 3), or (height, width, 4) with straight colour.

        Parameters
        ----------
        transparent : bool, optional
            True to keep the opacity, where the scene's background is black; that of the picture by default.
        window : (centre, width), optional
            Numbers that are black to white, of the modes xray, mip, minip and average; found by default.
        """
        return image.eight_bits(self._colors(window), self.transparent if transparent is None else transparent)

    def save(
        self, path: str | os.PathLike[str], *, transparent: bool | None = None, window: Window | None = None
    ) -> None:
        """Write an EXR (the numbers as they are), PNG or JPEG; the header has the scene, if it is known.

        Raises
        ------
        InputError
            If the name ends otherwise, or the file can't be written.
        """
        image.check_writable(path)
        is_exact = Path(path).suffix.lower() == ".exr"
        if self._holds_numbers and not is_exact and window is None:
            window = found_window(_plain(self), self._scene)
        pixels = _plain(self) if is_exact and self._is_picture else self._colors(window)
        drawn, metadata = self.drawn, {}
        if drawn is not None:
            display = {"window": window} if self._holds_numbers and window is not None else {}
            name, how = drawn.scene.volume.name, {"settings": drawn.settings, "display": display}
            metadata = dict(drawn.attributes) | scene_metadata(name, drawn.scene, **how, checksum=is_exact)
        kept = self.transparent if transparent is None else transparent
        writing.write_files({path: image.encoded(path, pixels, metadata, transparent=kept)})

    def _repr_png_(self) -> bytes | None:
        """Return the picture as a notebook shows it; None if it was made into an array of another shape."""
        if not self._is_picture:
            return None
        return image.encoded("picture.png", self._colors(None), transparent=self.transparent, quick=True)

    def __repr__(self) -> str:
        drawn = self.drawn
        if drawn is None:
            return np.ndarray.__repr__(_plain(self))
        error = "not estimated yet" if drawn.error is None else upward(drawn.error)
        return f"<Picture {self.shape[1]}x{self.shape[0]} of {drawn.scene.volume.name}, error {error}>"

    __str__ = __repr__

    @property
    def _is_picture(self) -> bool:
        return self.ndim == 3 and self.shape[2] == 4 and self.size > 0

    @property
    def _scene(self) -> Scene:
        assert self._made_from is not None
        return self._made_from.scene

    @property
    def _holds_numbers(self) -> bool:
        """True if its colours are made of numbers, also if they were changed."""
        return self._is_picture and self._made_from is not None and self._scene.mode in NUMBER_MODES

    def _colors(self, window: Window | None) -> NDArray[np.float32]:
        """Return linear premultiplied colours."""
        if not self._is_picture:
            raise InputError(f"a picture must have shape (height, width, 4), got {self.shape}")
        if self._holds_numbers:
            return shown(_plain(self), self._scene, window=window)
        return np.asarray(_plain(self), np.float32)


def _identified(picture: Picture) -> tuple[tuple[int, ...], int] | None:
    """Return shape and checksum of the numbers; None if no float32 has them."""
    plain = _plain(picture)
    if plain.dtype.kind not in "fiub":
        return None
    with np.errstate(over="ignore"):
        numbers = np.ascontiguousarray(plain, np.float32)
    if plain.dtype != np.float32 and not np.array_equal(numbers, plain, equal_nan=True):
        return None
    return plain.shape, checksum_of_all(numbers)


def _plain(thing: Any) -> Any:
    """Return a picture as a plain array, and anything else as it is."""
    return thing.view(np.ndarray) if isinstance(thing, Picture) else thing


def _is_asked_by_matplotlib() -> bool:
    """True if a function of matplotlib's images is among the last callers."""
    if _DRAWS_IMAGES not in sys.modules:
        return False
    frame = sys._getframe(2)
    for _ in range(_CALLS_BETWEEN):
        if frame.f_globals.get("__name__") == _DRAWS_IMAGES:
            return True
        if frame.f_back is None:
            return False
        frame = frame.f_back
    return False


def _shown_by_matplotlib(picture: Picture) -> NDArray[np.float32]:
    """Return the picture in sRGB from 0 to 1, over its background, or with its opacity."""
    if picture.transparent:
        return np.divide(picture.to_srgb(), 255, dtype=np.float32)
    return srgb_from_linear(picture._colors(None)[..., :3]).astype(np.float32)
