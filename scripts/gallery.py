"""Draws the gallery, pictures that show what texvol models: index.html and a PNG for each, and a table in Markdown."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.gallery.drawing import main

if __name__ == "__main__":
    sys.exit(main())
