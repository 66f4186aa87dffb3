"""Random scenes, each as odd as it gets, held against the oracle: was the error what the renderer said it was?"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.odd_scenes.outcomes import main

if __name__ == "__main__":
    sys.exit(main())
