"""Random scenes, drawn by polygons and by the compute shader: how far apart are the pictures?"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.pipelines import main

if __name__ == "__main__":
    sys.exit(main())
