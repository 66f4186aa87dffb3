"""What explains a picture: box outline, axes, orientation letters, legend, scale bar and title, drawn into it.

Annotation is laid over the finished picture (the far edges of the box behind it), in the camera of its scene and in
linear light. It is no data: pictures that hold numbers to be compared stay without it. Where nothing is asked for,
nothing of this package is imported but the module `request`.
"""

from __future__ import annotations

from texvol.annotation.request import PARTS, Annotation, annotate, check, with_room

__all__ = ["PARTS", "Annotation", "annotate", "check", "with_room"]
