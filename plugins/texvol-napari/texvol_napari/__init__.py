"""Plugin of napari: a picture of the layers by texvol, with its error.

    translation    layers and camera → scenes of texvol
    placing        layers' grids and napari's camera in texvol's world
    drawing        scenes → one picture, blended as napari blends layers
    widget         dock widget *Render exactly*

Only `widget` needs napari and Qt.
"""

from __future__ import annotations

__version__ = "0.5.0"
