"""Transfer functions: what they are (`function`), their files (`files`), presets and proposals (`presets`), labels."""

from __future__ import annotations

from texvol.scene.transfer.function import NO_MEDIUM, Classified, TransferFunction
from texvol.scene.transfer.labels import LabelLook, label_function, parse_labels
from texvol.scene.transfer.presets import PRESETS, is_named, preset, proposed_beside, proposed_for

load, loads = TransferFunction.load, TransferFunction.loads

__all__ = [
    "NO_MEDIUM",
    "PRESETS",
    "Classified",
    "LabelLook",
    "TransferFunction",
    "is_named",
    "label_function",
    "load",
    "loads",
    "parse_labels",
    "preset",
    "proposed_beside",
    "proposed_for",
]
