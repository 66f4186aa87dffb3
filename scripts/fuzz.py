"""Damaged files of every kind that texvol reads: each is read or refused, and anything else is a finding."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.fuzzing.campaign import main

if __name__ == "__main__":
    sys.exit(main())
