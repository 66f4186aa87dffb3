"""Transfer function: from a value to straight linear colour and extinction per world unit, piecewise linear.

Between control points both are linear in the value. Outside they are those of the nearest point. Two points at one
value make a step, whose right side holds at the value itself. The emission of the points is one of three kinds:

- *associated* (default): emission is colour times extinction, so a dense medium shows its own colour.
- *emissive*: emission is a number of its own, and a medium may emit without absorbing (Wilson et al. 1994).
- *premultiplied*: the points hold colour times extinction, which is linear between them, so that mixtures of materials
  are exact (Drebin, Carpenter, Hanrahan 1988). Light falls on it as on associated points.

The medium may depend on the gradient magnitude |∇f|, too: by a factor of the points, and by `graded` and `contours`.

An extinction may be infinite (opacity 1 per unit length). The medium is opaque there at any thickness, and so it is at
every value strictly between that point and the next.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.transfer import pieces
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.pieces import LARGEST_VALUE, ROUNDING, Flags, Numbers
from texvol.scene.transfer.saved import Saved
from texvol.scene.volume import Volume
from texvol.util import text_files
from texvol.util.color import linear_colors
from texvol.util.errors import InputError, check_type
from texvol.util.kept_arrays import KeepsArrays, read_only
from texvol.util.late import ShownInNotebooks, late

__all__ = ["LARGEST_VALUE", "Classified", "TransferFunction"]


class Classified(NamedTuple):
    """Emission and extinction of some values."""

    emission: Numbers  # q, per world unit, shape (…, 3); the visible colour where extinction is infinite
    extinction: Numbers  # τ, per world unit, shape (…)


@dataclass(frozen=True, eq=False, repr=False)
class TransferFunction(KeepsArrays, Saved, ShownInNotebooks):
    """Control points (value, colour or emission, extinction), in data and world units.

    Parameters
    ----------
    values : array of shape (n,)
        Ascending; two equal values make a step.
    colors : array of shape (n, 3), or sequence of (r, g, b), names and #RRGGBB
        Linear and straight. Associated: in [0, 1]. Emissive and premultiplied: emission per world unit, not negative.
    extinctions : array of shape (n,)
        Per world unit; from 0 to infinity.
    emissive : bool
        True if `colors` is an emission that does not depend on the extinction.
    premultiplied : bool
        True if `colors` is colour times extinction. At a point of infinite extinction it is the straight colour; put a
        step between such a point and a finite one, or a mixture of both shows.
    modulation : array of shape (m, 2), optional
        Pairs of gradient magnitude (data units per world unit, ascending) and factor of emission and extinction;
        linear in between, clamped at the ends.
    graded, contours : sequences of Graded and Contour
        Parts of the medium that depend on the gradient.
    materials : sequence of str
        Names of the materials that the function was made of.
    material_colors : sequence of (r, g, b)
        Straight colours of the materials, in [0, 1]; none, or one for each name.
    by_look : bool
        True if a look chose it, and not whoever draws: then the slabs of a picture are chosen as well.

    Raises
    ------
    InputError
        If there are no points, or points or modulation are unsorted, not finite, negative or out of range.
    """

    values: Numbers
    colors: Numbers
    extinctions: Numbers
    emissive: bool = False
    name: str = "transfer function"
    premultiplied: bool = False
    modulation: Numbers | None = None
    graded: tuple[Graded, ...] = ()
    contours: tuple[Contour, ...] = ()
    materials: tuple[str, ...] = ()
    material_colors: tuple[tuple[float, float, float], ...] = ()
    by_look: bool = field(default=False, kw_only=True)

    if TYPE_CHECKING:  # what may be given, beside what is kept

        def __init__(
            self, values: ArrayLike, colors: Sequence[Sequence[float] | str] | NDArray[Any], extinctions: ArrayLike,
            emissive: bool = False, name: str = "transfer function", premultiplied: bool = False,
            modulation: Sequence[Sequence[float]] | NDArray[Any] | None = None, graded: Sequence[Graded] = (),
            contours: Sequence[Contour] = (), materials: Sequence[str] = (),
            material_colors: Sequence[Sequence[float] | str] = (), *, by_look: bool = False,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        for name in ("colors", "material_colors"):
            object.__setattr__(self, name, linear_colors(getattr(self, name), f"{self.name}: {name}"))
        for name in ("values", "colors", "extinctions"):
            object.__setattr__(self, name, read_only(np.array(getattr(self, name), dtype=np.float64)))
        for name in ("graded", "contours", "materials", "material_colors"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        count = self.values.shape[0] if self.values.ndim == 1 else 0
        if count == 0:
            raise InputError(f"{self.name}: a transfer function must have at least one point, got none")
        if self.colors.shape != (count, 3) or self.extinctions.shape != (count,):
            raise InputError(
                f"{self.name}: {count} values need colors of shape ({count}, 3) and extinctions of shape ({count},), "
                f"got {self.colors.shape} and {self.extinctions.shape}"
            )
        self._check_numbers()
        if self.material_colors and len(self.material_colors) != len(self.materials):
            raise InputError(
                f"{self.name}: {len(self.materials)} materials need as many colours, got {len(self.material_colors)}"
            )
        if self.modulation is not None:
            object.__setattr__(self, "modulation", read_only(pieces.modulation(self.modulation, self.name)))

    def _check_numbers(self) -> None:
        if not np.isfinite(self.values).all():
            raise InputError(f"{self.name}: values must be finite")
        if np.abs(self.values).max() > LARGEST_VALUE:  # so that their differences are finite
            raise InputError(f"{self.name}: values must be at most {LARGEST_VALUE:g} in size")
        pieces.check_ascending(self.values, f"{self.name}: values", steps=True)
        if not (self.extinctions >= 0).all():  # NaN fails this too
            raise InputError(f"{self.name}: extinction must not be negative or NaN")
        if not np.isfinite(self.colors).all() or (self.colors < 0).any():
            raise InputError(f"{self.name}: colours must be finite and not negative")
        if self.emissive and self.premultiplied:
            raise InputError(f"{self.name}: points must be either emissive or premultiplied, got both")
        if not self.glows and (self.colors > 1).any():
            raise InputError(f"{self.name}: colours must be from 0 to 1, got {self.colors.max():g}")

    def __repr__(self) -> str:
        low, high, count = self.values[0], self.values[-1], len(self.values)
        return f"TransferFunction({self.name!r}, {count} point{'s' * (count > 1)} from {low:.6g} to {high:.6g})"

    @classmethod
    def preset(cls, name: str, volume: Volume, materials: Sequence[str] | None = None) -> TransferFunction:
        """Return a preset in the units of a volume; InputError if there is none of that name."""
        check_type("volume", volume, Volume)
        found: TransferFunction = late("preset", name, volume, materials)
        return found

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], volume: Volume | None = None, materials: Sequence[str] | None = None,
        unit_distance: float | None = None,
    ) -> TransferFunction:  # fmt: skip
        """Read a JSON or TOML file, or that of another program.

        Parameters
        ----------
        volume : Volume, optional
            Needed if the file speaks of percentiles, range, matter, box, voxels or relative gradients.
        materials : sequence of str, optional
            Names of the materials to show. The others are left out, but for contours and boundaries that refer to them.
        unit_distance : float, optional
            Length that opacities of another program's file belong to, in world units; by default the file's own, or
            that program's.

        Raises
        ------
        InputError
            If the file cannot be read, is not such a JSON object, has unknown keys or numbers out of range, or does
            not have those materials; see `texvol.scene.transfer.files` for the format.
        """
        from texvol.scene.transfer import files

        return cls.from_content(files.read_content(path, unit_distance), os.fspath(path), volume, materials)

    @classmethod
    def loads(
        cls, text: str, name: str = "transfer function", volume: Volume | None = None,
        materials: Sequence[str] | None = None,
    ) -> TransferFunction:  # fmt: skip
        """Read a JSON text; see `load`."""
        return cls.from_content(text_files.parsed_json(text, name), name, volume, materials)

    @classmethod
    def from_content(
        cls, content: Any, name: str, volume: Volume | None = None, materials: Sequence[str] | None = None
    ) -> TransferFunction:
        """Return the transfer function that a parsed JSON text describes; see `load`."""
        from texvol.scene.transfer import files

        try:
            return files.from_content(content, name, volume, materials, cls)
        except InputError as error:
            message = str(error)
            raise InputError(message if message.startswith(f"{name}:") else f"{name}: {message}") from None

    @property
    def needs_gradient(self) -> bool:
        """True if the medium depends on the gradient."""
        return self.modulation is not None or bool(self.graded) or bool(self.contours)

    @property
    def _by_gradient(self) -> list[Graded | Contour]:
        return [*self.graded, *self.contours]

    @property
    def glows(self) -> bool:
        """True if `colors` holds the emission, not a colour to be multiplied with the extinction."""
        return self.emissive or self.premultiplied

    @property
    def excess_emission(self) -> float:
        """Largest e with emission ≤ extinction + e, per world unit; 0 if no colour is above 1.

        A ray of length L through such a medium collects at most 1 + e L.
        """
        most = 0.0
        if self.glows:
            factor = 1.0 if self.modulation is None else float(self.modulation[:, 1].max())
            most = factor * float((self.colors.max(axis=1) - self.extinctions).max())
        most = max(most, 0.0)
        for graded in self.graded:
            most += max(float((graded.emissions.max(axis=1) - graded.extinctions).max()), 0.0)
        for contour in self.contours:
            most += max(max(contour.emission) - contour.extinction, 0.0)
        return most

    def classify(self, values: ArrayLike, magnitudes: ArrayLike | None = None) -> Classified:
        """Return emission and extinction of each value; both are 0 where the value is NaN.

        Parameters
        ----------
        values : array
        magnitudes : array, optional
            Gradient magnitude of each value, in data units per world unit; NaN counts as 0. Required if
            `needs_gradient`, ignored otherwise.

        Raises
        ------
        InputError
            If `needs_gradient` and magnitudes are missing.
        """
        if self.needs_gradient and magnitudes is None:
            raise InputError(f"{self.name}: magnitudes must be given, since the medium depends on the gradient")
        numbers = self.at(values)
        colors, extinction = numbers[..., :3], numbers[..., 3]
        if self.emissive:
            # ∫ q T vanishes where T does at once.
            medium = Classified(np.where(np.isinf(extinction)[..., np.newaxis], 0.0, colors), extinction)
        elif self.premultiplied:
            medium = Classified(colors, extinction)
        else:
            # An infinite extinction shows its straight colour.
            weight = np.where(np.isinf(extinction), 1.0, extinction)
            medium = Classified(colors * weight[..., np.newaxis], extinction)
        return self._with_gradient(medium, values, magnitudes) if self.needs_gradient else medium

    def _with_gradient(self, points: Classified, values: ArrayLike, magnitudes: ArrayLike | None) -> Classified:
        """Apply the modulation to the points, and add the parts that depend on the gradient."""
        values, magnitudes = np.broadcast_arrays(np.asarray(values, np.float64), np.asarray(magnitudes, np.float64))
        magnitudes = np.where(np.isnan(magnitudes), 0.0, magnitudes)
        emission = np.broadcast_to(points.emission, (*values.shape, 3)).copy()
        extinction = np.broadcast_to(points.extinction, values.shape).copy()
        opaque = np.isinf(extinction)
        if self.modulation is not None:
            factor = np.interp(magnitudes, self.modulation[:, 0], self.modulation[:, 1])
            opaque &= factor > 0
            extinction = np.where(opaque, np.inf, np.where(np.isinf(extinction), 0.0, extinction) * factor)
            # An opaque medium stays as it is, or vanishes.
            emission *= np.where(opaque, 1.0, factor)[..., np.newaxis]
        for further in self._by_gradient:
            more_emission, more_extinction = further.at(values, magnitudes)
            emission += np.where(opaque[..., np.newaxis], 0.0, more_emission)
            extinction += more_extinction
        return Classified(emission, extinction)

    def at(self, values: ArrayLike) -> Numbers:
        """Return colour (or emission) and extinction of each value, shape (…, 4); all are 0 where the value is NaN."""
        values = np.asarray(values, dtype=np.float64)
        absent = np.isnan(values)
        segment = np.searchsorted(self.values, values, side="right")  # number of points at or below the value
        start, base, slope, opaque = self._lines
        # Beyond the outer points nothing changes; clipped, infinite values are finite.
        offset = np.clip(values, self.values[0], self.values[-1]) - start.take(segment)
        # take is ten times as fast as an index; a fused update in place saves as much again.
        numbers = slope.take(segment, axis=0)
        numbers *= offset[..., np.newaxis]
        numbers += base.take(segment, axis=0)
        np.maximum(numbers, 0.0, out=numbers)  # rounding may leave -1e-17 where a point of 0 is reached
        if opaque.any():
            # An infinite point holds from itself on, and above the point before it.
            hidden = opaque[segment, 0] | (opaque[segment, 1] & (offset > 0))
            numbers[..., 3] = np.where(hidden, np.inf, numbers[..., 3])
        if absent.any():
            numbers[absent] = 0.0
        return numbers

    def shows_between(self, lowest: ArrayLike, highest: ArrayLike, largest_magnitude: ArrayLike = np.inf) -> Flags:
        """Return True where any value from `lowest` to `highest` may show; False where either is NaN.

        Gradient magnitudes are from 0 to `largest_magnitude`, in data units per world unit. Near a step both ends are
        widened by the rounding of a value.
        """
        lowest, highest = np.asarray(lowest, np.float64), np.asarray(highest, np.float64)
        is_more = self.extinctions > 0
        if self.glows:
            is_more = is_more | (self.colors > 0).any(axis=1)
        shows = pieces.shows_between(self.values, is_more, np.isinf(self.extinctions), lowest, highest)
        if self.modulation is not None:
            shows = shows & self._may_modulate(largest_magnitude)
        for further in self._by_gradient:
            shows = shows | further.shows_between(lowest, highest, largest_magnitude)
        return shows

    def _may_modulate(self, largest_magnitude: ArrayLike) -> Flags:
        """Return True where any gradient magnitude from 0 to the largest has a factor above 0."""
        assert self.modulation is not None
        first = np.flatnonzero(self.modulation[:, 1] > 0)
        largest = np.asarray(largest_magnitude, np.float64) * (1 + ROUNDING)
        if not first.size:
            return np.zeros(largest.shape, np.bool_)
        # The factor rises from the last magnitude of factor 0.
        return np.asarray(largest > self.modulation[first[0] - 1, 0] if first[0] else largest >= 0)

    @cached_property
    def numbers(self) -> Numbers:
        """Colour and extinction of each point, shape (n, 4); an infinite extinction is 0 here."""
        return np.column_stack([self.colors, np.where(np.isinf(self.extinctions), 0.0, self.extinctions)])

    @cached_property
    def segment_ends(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Flags]:
        """Points at the left and the right of each segment, and True where they are opaque, shape (n + 1, 2).

        Segment s has s points at or below it; the first and the last segment have the outer point at both ends.
        """
        segments = np.arange(self.values.size + 1)
        left, right = np.maximum(segments - 1, 0), np.minimum(segments, self.values.size - 1)
        infinite = np.isinf(self.extinctions)
        return left, right, np.column_stack([infinite[left], infinite[right]])

    @cached_property
    def _lines(self) -> tuple[Numbers, Numbers, Numbers, Flags]:
        """Segments as lines: start, numbers there, numbers per unit of value, and True at opaque ends."""
        left, _, opaque = self.segment_ends
        level = np.zeros((1, 4))  # the two outer segments
        slope = np.vstack([level, pieces.slopes(self.values, self.numbers), level])
        return self.values[left], self.numbers[left], slope, opaque


# Transfer function of pictures of the values themselves, in which nothing is classified.
NO_MEDIUM = TransferFunction(np.zeros(1), np.zeros((1, 3)), np.zeros(1))
