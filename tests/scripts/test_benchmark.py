"""The benchmark's own checks, which stand beside it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
pytest.register_assert_rewrite("benchmark_checks")

from benchmark_checks import *  # noqa: E402, F403 (they are its tests)
