"""What a Renderer says of its last picture, without the pictures that it draws to estimate the picture's error."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from texvol import Renderer
from texvol.rendering.stats import sampled_slabs


def quick_stats(renderer: Renderer, samples: bool = False) -> dict[str, Any]:
    """`renderer.stats` without estimated error, and without numbers of samples unless they are asked for.

    An estimate is two pictures, the one of thinner slabs, and counting takes a program of its own: many times the
    picture that a test looks at.
    """
    assert renderer._last is not None
    count = sampled_slabs if samples else lambda *_: {"samples": None, "samples_total": None}
    with (
        patch("texvol.rendering.renderer.estimates", lambda *given: given[-2]),
        patch("texvol.rendering.renderer.sampled_slabs", count),
    ):
        return renderer._metadata(*renderer._last)
