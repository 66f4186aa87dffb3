"""Ask for errors on random scenes and hold what comes against the oracle; prints a table in Markdown. See --help."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.error_control import main

if __name__ == "__main__":
    sys.exit(main())
