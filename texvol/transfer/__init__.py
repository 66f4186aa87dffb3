"""Transfer functions: what they are (`function`), their files (`files`), presets and proposals (`presets`), labels."""

from __future__ import annotations

from texvol.transfer.files import load, loads
from texvol.transfer.function import Classified, TransferFunction
from texvol.transfer.labels import LabelLook, label_function, parse_labels
from texvol.transfer.presets import PRESETS, preset, proposed_beside, proposed_for

__all__ = [
    "PRESETS",
    "Classified",
    "LabelLook",
    "TransferFunction",
    "label_function",
    "load",
    "loads",
    "parse_labels",
    "preset",
    "proposed_beside",
    "proposed_for",
]
