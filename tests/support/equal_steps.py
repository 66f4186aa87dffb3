"""A plain ray caster in equal steps, compiled and in threads: what a faster method has to beat."""

from __future__ import annotations

import numpy as np

from texvol.methods.grid_view import grid_view
from texvol.methods.method import classified
from texvol.ray_casting.common.compiling import compiled_and_cached
from texvol.ray_casting.common.rays import over_rows
from texvol.scene.scene import CompleteScene


class EqualSteps:
    """Trilinear samples of the classified medium, one per smallest spacing, until 1/1024 is let through."""

    def __init__(self, scene: CompleteScene) -> None:
        self.scene, self.media = scene, classified(scene)

    def picture(self, size: tuple[int, int]) -> np.ndarray:
        """Return the picture, (height, width, 4)."""
        volume = self.scene.volume
        view = grid_view(volume, self.scene.camera, size)
        picture = np.zeros((size[1], size[0], 4))
        rays = (view.start, view.across, view.down, view.step)
        reach, distance = volume.radius, volume.smallest_spacing
        over_rows(lambda rows: _march(self.media, rays, reach, distance, rows.start, picture[rows]), picture.shape)
        return picture


@compiled_and_cached
def _march(media, rays, reach, distance, first_row, picture):
    start, across, down, step = rays
    counts = media.shape[2], media.shape[1], media.shape[0]
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            begin = start + column * across + (first_row + row) * down
            low, high = -reach, reach
            for axis in range(3):
                if step[axis] == 0:
                    if not -0.5 <= begin[axis] < counts[axis] - 0.5:
                        high = low
                    continue
                a, b = (-0.5 - begin[axis]) / step[axis], (counts[axis] - 0.5 - begin[axis]) / step[axis]
                low, high = max(low, min(a, b)), min(high, max(a, b))
            steps = int(np.ceil((high - low) / distance)) if high > low else 0
            q0 = q1 = q2 = 0.0
            left = 1.0
            for n in range(steps):
                path = (high - low) / steps
                s = low + (n + 0.5) * path
                x = min(max(begin[0] + s * step[0], 0.0), counts[0] - 1.0)
                y = min(max(begin[1] + s * step[1], 0.0), counts[1] - 1.0)
                z = min(max(begin[2] + s * step[2], 0.0), counts[2] - 1.0)
                i, j, k = min(int(x), counts[0] - 2), min(int(y), counts[1] - 2), min(int(z), counts[2] - 2)
                m0 = m1 = m2 = tau = 0.0
                for corner in range(8):
                    a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
                    weight = (1 - abs(x - i - a)) * (1 - abs(y - j - b)) * (1 - abs(z - k - c))
                    m0 += weight * media[k + c, j + b, i + a, 0]
                    m1 += weight * media[k + c, j + b, i + a, 1]
                    m2 += weight * media[k + c, j + b, i + a, 2]
                    tau += weight * media[k + c, j + b, i + a, 3]
                opacity = -np.expm1(-tau * path)
                weight = left * (opacity / tau if tau > 0 else path)
                q0, q1, q2 = q0 + weight * m0, q1 + weight * m1, q2 + weight * m2
                left *= 1 - opacity
                if left <= 1 / 1024:
                    break
            picture[row, column] = q0, q1, q2, 1 - left
