"""Pictures of other libraries: figures of matplotlib, images of Pillow."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError

# Modes of Pillow whose numbers are light or sRGB as they are, and modes that become one of them without loss.
_PLAIN = ("L", "LA", "RGB", "RGBA", "I;16", "F")
_CONVERTED = {"1": "L", "PA": "RGBA", "La": "LA", "RGBa": "RGBA", "RGBX": "RGB"}


def array_of(thing: Any) -> tuple[NDArray[Any], str | None] | None:
    """Return the array of a figure or image, and the name of the program that drew it; None for other types.

    The libraries are not imported: an object of theirs exists only if they are.

    Raises
    ------
    InputError
        If the image has a mode that is neither grey nor RGB.
    """
    figure, image = _class("matplotlib.figure", "Figure"), _class("PIL.Image", "Image")
    if figure is not None and isinstance(thing, figure):
        return _drawn(thing), f"matplotlib {sys.modules['matplotlib'].__version__}"
    if image is not None and isinstance(thing, image):
        return _of_pillow(thing), None
    return None


def _class(module: str, name: str) -> type | None:
    return getattr(sys.modules.get(module), name, None)


def _drawn(figure: Any) -> NDArray[np.uint8]:
    """Return the figure as matplotlib's Agg draws it at the figure's size; the figure keeps its own canvas."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    own = figure.canvas
    try:
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        return np.array(canvas.buffer_rgba())
    finally:
        figure.set_canvas(own)


def _of_pillow(image: Any) -> NDArray[Any]:
    mode = image.mode
    if mode == "P" or "transparency" in image.info:
        # The colours of a palette, and the colour that counts as transparent.
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    elif mode in _CONVERTED:
        image = image.convert(_CONVERTED[mode])
    elif mode not in _PLAIN:
        modes = ", ".join((*_PLAIN, "P", *_CONVERTED))
        raise InputError(f"picture must be a Pillow image of mode {modes}, got mode {mode}; use image.convert('RGB')")
    return np.asarray(image)
