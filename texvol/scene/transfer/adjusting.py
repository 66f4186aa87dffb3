"""Transfer functions shifted and scaled along the values, or made denser, whatever they are made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from texvol.scene.transfer.function import TransferFunction
from texvol.scene.transfer.pieces import Numbers


def ends(medium: TransferFunction) -> tuple[float, float]:
    """Return the first and the last value between which the medium changes."""
    parts = [medium.values, *(each.values for each in medium.graded), *(np.array([c.value]) for c in medium.contours)]
    if medium.graded or medium.contours:  # points without extinction have no values of their own
        parts = [each for each, shows in zip(parts, _shown(medium, len(parts)), strict=True) if shows]
    return min(float(each.min()) for each in parts), max(float(each.max()) for each in parts)


def placed(values: Numbers, before: tuple[float, float], after: tuple[float, float]) -> Numbers:
    """Return ascending values moved as `between` does: those at the ends `before` come to the ends `after`."""
    first, last = before
    width = last - first
    if not width > 0:
        return values - first + after[0] / 2 + after[1] / 2
    fractions = (values - first) / width
    return np.asarray(np.maximum.accumulate(after[0] * (1 - fractions) + after[1] * fractions))


def between(medium: TransferFunction, low: float, high: float) -> TransferFunction:
    """Return the medium with its values moved so that the first one becomes `low` and the last one `high`.

    Values of parts that depend on the gradient move with them; gradient magnitudes stay.
    """
    before = ends(medium)

    def moved(values: Numbers) -> Numbers:
        return placed(values, before, (low, high))

    return replace(
        medium,
        values=moved(medium.values),
        graded=tuple(replace(each, values=moved(each.values)) for each in medium.graded),
        contours=tuple(replace(each, value=float(moved(np.array([each.value]))[0])) for each in medium.contours),
    )


def denser(medium: TransferFunction, factor: float) -> TransferFunction:
    """Return the medium with `factor` times as much matter: emission and extinction are as many times as large.

    An infinite extinction stays infinite, unless the factor is 0.
    """
    opaque = np.isinf(medium.extinctions)
    extinctions = np.where(opaque & (factor > 0), np.inf, np.where(opaque, 0.0, medium.extinctions) * factor)
    colors = medium.colors
    if medium.glows:
        colors = colors * np.where(opaque & (not medium.emissive), 1.0, factor)[:, np.newaxis]
    graded = tuple(
        replace(each, emissions=each.emissions * factor, extinctions=each.extinctions * factor)
        for each in medium.graded
    )
    contours = tuple(
        replace(
            each,
            emission=(factor * each.emission[0], factor * each.emission[1], factor * each.emission[2]),
            extinction=each.extinction * factor,
        )
        for each in medium.contours
    )
    return replace(medium, extinctions=extinctions, colors=colors, graded=graded, contours=contours)


def _shown(medium: TransferFunction, count: int) -> list[bool]:
    """Return which of the parts show anything: the points may be clear, the others never are."""
    return [bool((medium.extinctions > 0).any() or (medium.glows and medium.colors.any())), *([True] * (count - 1))]
