"""Parameters that hold each value of each axis, and each pair that interacts, in place of the full product."""

from __future__ import annotations

import pytest

from texvol.scene.scene import CLASSIFICATIONS

# A projection decides which ray a pixel has, a classification what is done along it; test_closed_forms_drawn and
# test_render draw all eight pairs of the two.
PROJECTIONS = ("orthographic", "perspective", "perspective", "orthographic")
IN_A_PROJECTION = list(zip(CLASSIFICATIONS, PROJECTIONS, strict=True))
each_classification_in_a_projection = pytest.mark.parametrize("classification, projection", IN_A_PROJECTION)
