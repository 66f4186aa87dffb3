"""Pictures, and differences planted in them, for the tests of what kind of difference there is."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy import ndimage

Picture = np.ndarray
Plant = Callable[[Picture], Picture]


@cache
def smooth_field(seed: int, size: tuple[int, int], sigma: float) -> np.ndarray:
    """Noise without waves shorter than some `sigma` pixels, between 0 and 1, shape (height, width); read-only."""
    width, height = size
    field = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((height, width)), sigma, mode="wrap")
    field = (field - field.min()) / np.ptp(field)
    field.flags.writeable = False
    return field


def picture_of(color: np.ndarray, opacity: np.ndarray) -> Picture:
    """Straight colour (h, w, 3) and opacity (h, w) as a premultiplied picture."""
    return np.dstack([color * opacity[..., None], opacity]).astype(np.float32)


def cloud(size: tuple[int, int] = (160, 120), seed: int = 0) -> Picture:
    """Thin and thick matter of several colours, smooth, with a black border."""
    width, height = size
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    window = np.clip(1.2 - 1.4 * np.maximum(np.abs(x), np.abs(y)), 0, 1)
    opacity = np.clip(1.1 * smooth_field(seed, size, 0.06 * width) * window, 0, 0.98)
    color = np.dstack([smooth_field(seed + i, size, 0.05 * width) for i in (1, 2, 3)])
    return picture_of(0.1 + 0.85 * color, opacity)


def detail(size: tuple[int, int] = (150, 130)) -> Picture:
    """Matter with fine detail everywhere, up to the border."""
    opacity = 0.15 + 0.7 * smooth_field(10, size, 1.6)
    return picture_of(np.dstack([smooth_field(i, size, 2.2) for i in (11, 12, 13)]), opacity)


def disks(size: tuple[int, int] = (140, 140)) -> Picture:
    """Disks with hard outlines, some translucent, on nothing."""
    width, height = size
    y, x = np.mgrid[:height, :width]
    picture = np.zeros((height, width, 4))
    random = np.random.default_rng(7)
    for _ in range(14):
        centre, radius = random.uniform(20, min(size) - 20, 2), random.uniform(5, 18)
        inside = np.hypot(x - centre[0], y - centre[1]) < radius
        opacity = random.uniform(0.3, 1)
        front = np.append(opacity * random.uniform(0.05, 0.95, 3), opacity) * inside[..., None]
        picture = front + (1 - front[..., 3:]) * picture
    shade = 0.7 + 0.3 * smooth_field(20, size, 12)
    picture[..., :3] *= shade[..., None]
    return picture.astype(np.float32)


PICTURES: dict[str, Callable[[], Picture]] = {each.__name__: each for each in (cloud, detail, disks)}


def encoded(c: np.ndarray) -> np.ndarray:
    """sRGB (IEC 61966-2-1), written once more so that a mistake in one shows."""
    return np.where(c > 0.0031308, 1.055 * np.power(np.maximum(c, 1e-9), 1 / 2.4) - 0.055, 12.92 * c)


def decoded(c: np.ndarray) -> np.ndarray:
    """Linear light of sRGB."""
    return np.where(c > 0.04045, np.power((np.maximum(c, 0) + 0.055) / 1.055, 2.4), c / 12.92)


def on_color(change: Callable[[np.ndarray], np.ndarray]) -> Plant:
    """The picture with its premultiplied colour changed."""
    return lambda p: np.dstack([change(p[..., :3]), p[..., 3]]).astype(np.float32)


def straight(p: Picture) -> np.ndarray:
    """Straight colour, 0 where there is no opacity."""
    return np.divide(p[..., :3], p[..., 3:], out=np.zeros_like(p[..., :3]), where=p[..., 3:] > 0)


def on_straight(change: Callable[[np.ndarray], np.ndarray]) -> Plant:
    """The picture with its straight colour changed."""
    return lambda p: np.dstack([change(straight(p)) * p[..., 3:], p[..., 3]]).astype(np.float32)


def moved(dx: float, dy: float, order: int = 3) -> Plant:
    """The picture moved to the right and down by splines, black coming in at the borders."""
    return lambda p: ndimage.shift(p.astype(float), (dy, dx, 0), order=order, mode="constant").astype(np.float32)


def thicker(ratio: float) -> Plant:
    """The same matter over another length."""

    def apply(p: Picture) -> Picture:
        return picture_of(straight(p).astype(float), 1 - (1 - p[..., 3].astype(float)) ** ratio)

    return apply


def quantised(steps: int, *, srgb: bool = False, is_straight: bool = False) -> Plant:
    """The picture as a file of few levels holds it."""

    def apply(p: Picture) -> Picture:
        color = np.clip(straight(p) if is_straight else p[..., :3], 0, 1)
        color = np.rint((encoded(color) if srgb else color) * steps) / steps
        opacity = np.rint(p[..., 3] * steps) / steps
        color = decoded(color) if srgb else color
        return np.dstack([color * opacity[..., None] if is_straight else color, opacity]).astype(np.float32)

    return apply


def noisy(rms: float, seed: int = 1) -> Plant:
    """Gaussian noise in all channels."""
    return lambda p: (p + np.random.default_rng(seed).normal(0, rms, p.shape)).astype(np.float32)


def speckled(p: Picture) -> Picture:
    """One pixel in a hundred is off, up or down."""
    random = np.random.default_rng(2)
    chosen = random.random(p.shape[:2]) < 0.01
    changed = p.copy()
    changed[chosen, :3] += random.choice([-0.3, 0.3], (int(chosen.sum()), 1)).astype(np.float32)
    return changed


def one_wrong(by: float, column: int = 60, row: int = 41, channel: int = 1) -> Plant:
    """One pixel is off in one channel."""

    def apply(p: Picture) -> Picture:
        changed = p.copy()
        changed[row, column, channel] += by
        return changed

    return apply


def before_light(light: tuple[float, float, float]) -> Plant:
    """The same matter in front of a background."""
    return lambda p: (p + (1 - p[..., 3:]) * np.array([*light, 0])).astype(np.float32)


def swapped(p: Picture) -> tuple[Picture, Picture]:
    """Two layers of the picture's opacity composited in one order and in the other."""
    fraction = 0.2 + 0.6 * smooth_field(30, (p.shape[1], p.shape[0]), 8)
    opacity = p[..., 3].astype(float)
    layers = [
        picture_of(color, 1 - (1 - opacity) ** part).astype(float)
        for color, part in ((straight(p), fraction), (np.roll(straight(p), 17, axis=1)[::-1], 1 - fraction))
    ]
    orders = [front + (1 - front[..., 3:]) * back for front, back in (layers, layers[::-1])]
    return orders[0].astype(np.float32), orders[1].astype(np.float32)


def off_at_edges(p: Picture) -> Picture:
    """What lies on the steepest edges is off by up to a half, as coverage makes it."""
    steep = ndimage.gaussian_gradient_magnitude(p.sum(axis=2).astype(float), 0.7)
    edge = steep > np.quantile(steep, 0.93)
    by = ndimage.gaussian_filter(np.random.default_rng(4).standard_normal(p.shape[:2]), 2)
    changed = p.copy()
    changed[edge] *= (1 + np.clip(2 * by[edge], -0.5, 0.5))[:, None].astype(np.float32)
    return changed
