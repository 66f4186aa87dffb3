"""Mistakes in other methods, other surfaces and other kinds of volumes."""

from __future__ import annotations

from planted_mistake_shaders import changed
from planted_mistake_sources import Mistake

OF_KINDS = (
    Mistake(
        *("methods", "splatting:_composite"),
        *("left = 1 - picture[row, column, 3]", "left = 1.0"),
        "sheets of splats are added up and not composited",
        "test_object_order.py -k 'splatting'",
    ),
    Mistake(
        *("rendering", "classification:ClassificationChooser._measured"),
        *("if of_slab <= GOOD_ENOUGH:", "if of_slab <= 1.0:"),
        "slab is always good enough for auto",
        "test_classification_auto.py -k 'both_choices'",
    ),
    Mistake(
        *("scene", "volume:Volume.nearest"),
        *("return self.labels or self.blocks", "return self.labels"),
        "blocks are interpolated",
        "test_blocks.py -k 'many_samples'",
    ),
    Mistake(
        *("formats", "magnitude:magnitudes"),
        *("np.hypot(length, component, out=length)", "np.add(length, component, out=length)"),
        "the length of a vector is the sum of its components",
        "test_readers_magnitude.py -k 'lengths'",
    ),
    Mistake(
        *("rendering", "checking:march_pixels"),
        *("np.maximum(np.maximum(first, eye), enters)", "np.maximum(np.maximum(first, eye), -volume.radius)"),
        "a marched ray steps across the faces of the box",
        "test_checking.py -k 'faces_of_the_box'",
    ),
    changed(
        "isosurfaces.glsl",
        "seen.color += (1.0 - seen.color.a) * behind;",
        "seen.color += behind;",
        "isosurfaces are added up and not composited",
        "test_isosurfaces.py -k 'closed_form'",
    ),
)
