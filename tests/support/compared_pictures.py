"""Pictures, and pairs of them, for the tests of comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from support import planted_differences as planted
from texvol.comparison.kinds import Kind
from texvol.comparison.outcome import examine
from texvol.comparison.pictures import Picture

if TYPE_CHECKING:
    from texvol.comparison.outcome import Outcome


def blob(width: int, height: int, shift: float = 0.0, *, is_opaque: bool = True) -> NDArray[np.float32]:
    """A smooth coloured shape on nothing, moved to the right by `shift` pixels."""
    y, x = np.mgrid[:height, :width].astype(float)
    x, y = 2 * (x - shift - width / 2) / min(width, height), 2 * (y - height / 2) / min(width, height)
    opacity = np.clip(3 * (0.8 - np.hypot(x, y)), 0, 1)
    color = np.stack([0.5 + 0.5 * np.sin(5 * x), 0.5 + 0.5 * np.cos(4 * y + x), 0.5 + 0.5 * np.sin(7 * x * y)], axis=2)
    alpha = np.ones_like(opacity) if is_opaque else opacity
    return np.dstack([color * opacity[..., np.newaxis], alpha]).astype(np.float32)


def filled(width: int, height: int, *color: float) -> NDArray[np.float32]:
    return np.broadcast_to(np.float32([*color, 1.0]), (height, width, 4)).copy()


def outcome_of(
    candidate: NDArray, reference: NDArray, name: str = "picture", *, explain: bool = True, **metadata: str
) -> Outcome:
    """Outcome of comparing two arrays; `metadata` are attributes of both."""
    from texvol.comparison.outcome import examine
    from texvol.comparison.pictures import Picture

    pair = (Picture.of_array(each, f"{role}.exr", metadata) for each, role in ((candidate, "new"), (reference, "old")))
    return examine(*pair, name=name, explain=explain)


def smooth(size: tuple[int, int] = (64, 48), seed: int = 0) -> NDArray[np.float32]:
    """A soft picture with opacity, premultiplied."""
    noise = np.random.default_rng(seed).random((size[1], size[0], 4))
    blurred = gaussian_filter(noise, (3, 3, 0), mode="wrap")
    blurred = (blurred - blurred.min()) / np.ptp(blurred)
    blurred[..., :3] *= blurred[..., 3:]
    return blurred.astype(np.float32)


def eight_bits(pixels: np.ndarray) -> np.ndarray:
    """Return premultiplied linear pixels as a PNG holds them."""
    color = planted.encoded(np.clip(planted.straight(pixels), 0, 1))
    return np.rint(255 * np.dstack([color, np.clip(pixels[..., 3], 0, 1)])).astype(np.uint8)


def opaque(pixels: np.ndarray) -> np.ndarray:
    """The picture over grey, three channels."""
    return np.asarray(pixels[..., :3] + 0.2 * (1 - pixels[..., 3:]), np.float32)


def held(candidate: np.ndarray, reference: np.ndarray) -> tuple[Kind, ...]:
    """Kinds of difference between two pictures."""
    return examine(Picture.of_array(candidate), Picture.of_array(reference)).kinds
