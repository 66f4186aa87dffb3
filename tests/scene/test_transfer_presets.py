"""The preset of the source's table 5-1, and extinction of the spacing that its opacities are of."""

from __future__ import annotations

import json

import numpy as np
import pytest

from texvol.scene import transfer
from texvol.scene.volume import Volume
from texvol.util.color import srgb_from_linear


def test_table_5_1_is_that_of_the_source() -> None:
    """Its values, sRGB colours and opacities of the smallest spacing, 0.5; nothing elsewhere."""
    volume = Volume(np.arange(256, dtype=np.uint8).reshape(4, 8, 8), (2.0, 2.0, 0.5))
    table = transfer.preset("table-5-1", volume)
    rows = {(30, 90): ((255, 200, 20), 0.2), (190, 230): ((255, 80, 60), 0.8), (230, 256): ((255, 255, 255), 1.0)}
    for value in range(256):
        emission, extinction = (each[0] for each in table.classify([value]))
        looks = next((look for (first, behind), look in rows.items() if first <= value < behind), None)
        assert -np.expm1(-0.5 * extinction) == pytest.approx(looks[1] if looks else 0)
        if looks:
            straight = emission if np.isinf(extinction) else emission / extinction
            np.testing.assert_allclose(srgb_from_linear(straight) * 255, looks[0], atol=0.01)


def test_table_5_1_divides_other_ranges_into_255() -> None:
    volume = Volume(np.linspace(-1000, 1040, 64, dtype=np.float32).reshape(4, 4, 4))
    values = transfer.preset("table-5-1", volume).values
    np.testing.assert_allclose(values, -1000 + 8 * np.repeat([30, 90, 190, 230], 2), rtol=1e-6)


def test_extinction_may_be_of_the_smallest_spacing() -> None:
    volume = Volume(np.zeros((2, 2, 2)), (3.0, 0.25, 1.0))
    points = {"length": "spacing", "points": [{"value": 0, "color": [1, 1, 1], "extinction": 2}]}
    assert transfer.loads(json.dumps(points), "spacing.json", volume).extinctions == [8]
