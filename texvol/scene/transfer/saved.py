"""Content of transfer-function files, as a transfer function writes it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from texvol.scene.lighting import Lighting
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.pieces import Numbers
from texvol.util.late import late


class Saved:
    """Base of `TransferFunction`: what a file of it holds."""

    if TYPE_CHECKING:
        values: Numbers
        colors: Numbers
        extinctions: Numbers
        emissive: bool
        premultiplied: bool
        modulation: Numbers | None
        graded: tuple[Graded, ...]
        contours: tuple[Contour, ...]
        materials: tuple[str, ...]
        material_colors: tuple[tuple[float, float, float], ...]

        @property
        def glows(self) -> bool: ...

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        to: str | None = None,
        unit_distance: float | None = None,
        name: str = "",
        lighting: Lighting | None = None,
    ) -> None:
        """Write a file of texvol (.json) or 3D Slicer (.vp, .vp.json), or with `to="paraview"` one of ParaView (.json).

        Parameters
        ----------
        path : path
            File; its name says whose it is.
        to : "texvol", "paraview" or "slicer", optional
            Program that reads the file; by its name unless told.
        unit_distance : float, optional
            Length in world units that opacities of another program's file belong to, such as the volume's spacing.
        name : str, optional
            Name of ParaView's colour map; that of the transfer function unless told.
        lighting : Lighting, optional
            Light of 3D Slicer's volume property; unlit without it.

        Raises
        ------
        InputError
            If name, program and length do not fit, the other program cannot say what the medium does, or the file
            can't be written.
        """
        late("save_transfer_function", self, path, to, unit_distance, name, lighting)

    def as_json(self) -> dict[str, Any]:
        """Return the content of a transfer-function file, in data and world units; reading it gives the same again."""
        columns = self.values, self.colors, self.extinctions
        points = [self._point(*point) for point in zip(*columns, strict=True)]
        content: dict[str, Any] = {"points": points}
        if self.glows:
            content["emission"] = "emissive" if self.emissive else "premultiplied"
        if self.modulation is not None:
            content["gradient"] = self.modulation.tolist()
        if self.graded:
            content["graded"] = [
                {
                    "points": [
                        {"value": float(value), "emission": emission.tolist(), "extinction": float(extinction)}
                        for value, emission, extinction in zip(
                            graded.values, graded.emissions, graded.extinctions, strict=True
                        )
                    ],
                    "gradient": [float(graded.start), float(graded.full)],
                }
                for graded in self.graded
            ]
        if self.contours:
            content["contours"] = [
                {
                    "value": float(contour.value),
                    "world_thickness": float(contour.thickness),
                    "emission": list(contour.emission),
                    "extinction": float(contour.extinction),
                }
                for contour in self.contours
            ]
        if self.materials:
            content["material_names"] = list(self.materials)
        if self.material_colors:
            content["material_colors"] = [list(color) for color in self.material_colors]
        return content

    def _point(self, value: float, color: Numbers, extinction: float) -> dict[str, Any]:
        opaque = bool(np.isinf(extinction))  # which is written as opacity 1
        glows = self.emissive or (self.premultiplied and not opaque)
        point = {"value": float(value), "emission" if glows else "color": color.tolist()}
        return point | ({"opacity": 1.0} if opaque else {"extinction": float(extinction)})
