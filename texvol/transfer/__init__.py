"""Transfer functions: what they are (`function`), their files (`files`), presets and proposals (`presets`)."""

from __future__ import annotations

from texvol.transfer.files import load, loads
from texvol.transfer.function import Classified, TransferFunction
from texvol.transfer.presets import PRESETS, preset, proposed_for

__all__ = ["PRESETS", "Classified", "TransferFunction", "load", "loads", "preset", "proposed_for"]
