"""Annotation drawn into a picture: box outlines, axes, orientation letters, legends, scale bar and title.

Annotation is composited over the finished picture, in linear light, with the camera of its scene; far edges of the box
are composited behind the medium. Pictures whose numbers are to be compared stay without annotation. Without annotation
only the modules `request` and `annotating` are imported.
"""

from __future__ import annotations

from texvol.annotation.annotating import annotate, check, with_room
from texvol.annotation.request import PARTS, Annotation

__all__ = ["PARTS", "Annotation", "annotate", "check", "with_room"]
