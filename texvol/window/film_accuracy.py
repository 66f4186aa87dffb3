"""Accuracy of films, and about how long they take to be written.

All pictures of a film are drawn in slabs of the thickness that its first one needs for the wanted error. Compression
and motion hide an error of a few steps of 8 bits, so that films have a larger one than pictures at rest.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.rendering import forecast
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.quality import is_software


def accuracy(desk: Desk) -> dict[str, Any]:
    """Return the accuracy of films, as arguments of `Renderer.render`."""
    return {**desk.director.accuracy, "max_error": desk.moving.film_error}


def seconds(desk: Desk, document: Document, size: tuple[int, int], pictures: int) -> float | None:
    """Return about how long a film takes to be written; None if it is not known.

    The picture at rest tells the thickness for its error. The error falls with the square of the thickness. The
    forecast is of a driver that draws on the CPU.
    """
    shown = desk.director.shown
    if shown is None or shown.state != "rest" or not is_software(shown.metadata.get("renderer", "")):
        return None
    thickness = shown.metadata["thickness"] * np.sqrt(desk.moving.film_error / desk.director.max_error)
    scene = document.scene.classified_as(shown.metadata["classification"])
    each = forecast.of_picture(scene, size, {"slab_thickness": float(thickness)}, has_textures=True)
    return pictures * each or None
