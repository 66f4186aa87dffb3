"""vispy's volume visual in its method `translucent`, headless by EGL, into a frame buffer of 32 bits.

It knows no length of a sample: the opacities of its colour map are those of one step, and are given anew for each. The
ray is cut into steps of about that length (rounded to a whole number of steps), and the samples lie at their near ends.
The ray ends at an opacity of 0.99, and no pixel of the box has an opacity below 0.001: vispy's constants.
"""

from __future__ import annotations

import numpy as np
import vispy
from numpy.typing import NDArray
from side_given import Array, Given, Medium, pixels_from_voxels, premultiplied, voxels_per_length

vispy.use("egl")

from vispy import gloo  # noqa: E402
from vispy.color.colormap import BaseColormap  # noqa: E402
from vispy.scene import SceneCanvas  # noqa: E402
from vispy.visuals import VolumeVisual  # noqa: E402
from vispy.visuals.transforms import MatrixTransform  # noqa: E402


class Table(BaseColormap):
    """A colour map of many 32-bit entries; vispy's own have 1024 of 8 bits."""

    colors = np.ones((2, 4))

    def __init__(self, entries: Array) -> None:
        count = len(entries)
        self.texture_map_data = entries.astype(np.float32).reshape(count, 1, 4)
        # From the middle of the first texel to that of the last.
        self.glsl_map = f"""
        uniform sampler2D texture2D_LUT;
        vec4 colormap(float t) {{
            return texture2D(texture2D_LUT, vec2(0.5, (clamp(t, 0.0, 1.0) * {count - 1}.0 + 0.5) / {count}.0));
        }}
        """
        super().__init__()

    def texture_lut(self) -> gloo.Texture2D:
        """Return the table as a texture."""
        return gloo.Texture2D(self.texture_map_data, interpolation="linear", internalformat="rgba32f")


class Program:
    """The visual and its frame buffer."""

    def __init__(self, given: Given) -> None:
        self._given, self._rate = given, 0.0
        self._density = voxels_per_length(given.rays[1], given.spacing)
        self._canvas = SceneCanvas(show=False, size=given.size)
        self._canvas.set_current()
        width, height = given.size
        color = gloo.Texture2D(np.zeros((height, width, 4), np.float32), internalformat="rgba32f")
        self._frame = gloo.FrameBuffer(color, gloo.RenderBuffer((height, width)))
        self._visual: VolumeVisual | None = None

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""
        self._medium, self._rate = medium, 0.0
        self._visual = VolumeVisual(
            self._given.values,
            clim=(medium.low, medium.high),
            method="translucent",
            interpolation="linear",
            texture_format="r32f",
        )
        self._visual.set_gl_state(blend=False, depth_test=False, cull_face=False)
        matrix = pixels_from_voxels(self._given.clip_from_box, self._given.spacing, self._given.size)
        self._visual.transform = MatrixTransform(matrix.T)
        self._visual.transforms.configure(
            viewport=(0, 0, *self._given.size), fbo_size=self._given.size, canvas=self._canvas
        )

    def draw(self, family: str, rate: float) -> NDArray[np.float32]:
        """Return the picture."""
        assert self._visual is not None
        if rate != self._rate:
            self._rate = rate
            opacities = self._medium.opacities(1 / rate)[:, np.newaxis]
            self._visual.cmap = Table(np.hstack([self._medium.colors, opacities]))
            self._visual.relative_step_size = self._density / rate
        width, height = self._given.size
        with self._frame:
            gloo.set_viewport(0, 0, width, height)
            gloo.clear((0, 0, 0, 0))
            self._visual.draw()
            return premultiplied(gloo.read_pixels((0, 0, width, height), out_type="float"))
