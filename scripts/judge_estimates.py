"""Judge the estimate, `--check 256` and `--check all` on random scenes; prints a table in Markdown. See --help."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.judged_estimates.campaign import main

if __name__ == "__main__":
    sys.exit(main())
