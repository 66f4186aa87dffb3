"""What a Renderer says of its last picture, without the pictures that it draws to estimate the picture's error."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from texvol import Renderer


def quick_stats(renderer: Renderer, samples: bool = False) -> dict[str, Any]:
    """`renderer.stats` without estimated error, and without numbers of samples unless they are asked for.

    An estimate is two pictures, the one of thinner slabs, and counting takes a program of its own: many times the
    picture that a test looks at.
    """
    assert renderer._last is not None
    left_out: dict[str, Any] = {"_estimated_error": None}
    if not samples:
        left_out["_samples"] = (None, None)
    with patch.multiple(renderer, **{name: lambda *_, value=value: value for name, value in left_out.items()}):
        return renderer._metadata(*renderer._last)
