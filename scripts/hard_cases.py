"""Draws every hard case and holds it against the oracle and its bound: a Markdown table, hard_cases.csv and .html."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.hard_cases.table import main

if __name__ == "__main__":
    sys.exit(main())
