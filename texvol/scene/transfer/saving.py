"""Transfer functions as files of texvol's own, of ParaView and of 3D Slicer."""

from __future__ import annotations

import json
import os
from typing import NamedTuple

from texvol.scene.lighting import Lighting
from texvol.scene.transfer.foreign import writing as foreign
from texvol.scene.transfer.function import TransferFunction
from texvol.util import writing
from texvol.util.errors import InputError

FORMS = ("texvol", "paraview", "slicer")
_JSON, _SLICER_TEXT, _SLICER = ".json", ".vp", ".vp.json"


class Form(NamedTuple):
    """Program that reads a file, the length that opacities in it belong to, and True if the file is a .vp."""

    program: str
    unit: float = 1.0
    is_text: bool = False

    @classmethod
    def of(cls, path: str, told: str | None, unit: float | None) -> Form:
        """Return the form of a file by its name, and by the program and the length that are told.

        Raises
        ------
        InputError
            If these do not fit, or ParaView's file or a .vp.json has no length.
        """
        name = path.lower()
        if not name.endswith((_JSON, _SLICER_TEXT)):
            raise InputError(f"{path}: the name must end with {_JSON}, {_SLICER} or {_SLICER_TEXT}")
        if told not in (None, *FORMS):
            raise InputError(f"to must be one of {', '.join(FORMS)}, got {told!r}")
        by_name = "slicer" if name.endswith((_SLICER_TEXT, _SLICER)) else None
        if by_name and told not in (None, by_name):
            raise InputError(f"{path}: --to {told} needs a name that ends with {_JSON}, got one of 3D Slicer")
        if told == "slicer" and not by_name:
            raise InputError(f"{path}: --to slicer needs a name that ends with {_SLICER} or {_SLICER_TEXT}")
        program, is_text = by_name or told or "texvol", name.endswith(_SLICER_TEXT)
        return cls(program, _unit(program, is_text, unit), is_text)

    def text(self, function: TransferFunction, name: str, lighting: Lighting | None) -> tuple[str, str]:
        """Return the text of the file, and a sentence about it."""
        if self.program == "texvol":
            text = json.dumps(function.as_json(), indent=1, allow_nan=False) + "\n"
            return text, f"transfer function of texvol, {function.values.size} points, in data and world units"
        if self.program == "paraview":
            text, nodes = foreign.paraview(function, self.unit, name)
            return text, f"colour map of ParaView, {nodes} nodes; set its Scalar Opacity Unit Distance to {self.unit:g}"
        if self.is_text:
            text, nodes = foreign.slicer_text(function, lighting)
            return text, f"volume property of 3D Slicer, {nodes} nodes, opacities per 1 world unit"
        text, nodes = foreign.slicer(function, self.unit, lighting)
        return text, f"volume property of 3D Slicer, {nodes} nodes, opacities per {self.unit:g}"


def _unit(program: str, is_text: bool, told: float | None) -> float:
    """Return the length that opacities of a file belong to."""
    if program == "texvol":
        if told is not None:
            raise InputError("--unit-distance is for ParaView and 3D Slicer: texvol's own files have extinctions")
        return 1.0
    if is_text:
        if told not in (None, 1.0):
            raise InputError(
                f"--unit-distance must be 1 for {_SLICER_TEXT}, which has none, got {told:g}; try {_SLICER}"
            )
        return 1.0
    if told is None:
        raise InputError(
            "--unit-distance L must be given: the world length that opacities belong to, such as the volume's spacing"
        )
    if not 0 < told < float("inf"):
        raise InputError(f"--unit-distance must be a finite length above 0, got {told:g}")
    return told


def save_transfer_function(
    function: TransferFunction,
    path: str | os.PathLike[str],
    to: str | None,
    unit_distance: float | None,
    name: str,
    lighting: Lighting | None,
) -> None:
    """Write a file, see `TransferFunction.save`."""
    form = Form.of(os.fspath(path), to, unit_distance)
    writing.check_writable(path)
    text, _ = form.text(function, name or function.name, lighting)
    writing.write_files({path: text.encode()})
