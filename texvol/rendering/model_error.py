"""Model error: how far the medium that is drawn is from that of `post`, which is classified after interpolation.

Thinner slabs take a picture of `slab` or `extinction` to the integral of their own medium, and no nearer to that of
`post`. A finer grid of texels does (scene/refinement.py). The error is estimated by two pictures of thin slabs, one
of each medium, whose own errors nearly vanish.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

from texvol.rendering.error_control import DrawScene, Size, largest_difference
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.refinement import REFINEMENTS, beyond_refinement, refined_scene
from texvol.scene.scene import Classification, CompleteScene
from texvol.textures.refinement import chosen_refinement
from texvol.util.errors import AccuracyWarning, InputError, NoRoomError
from texvol.util.upward import upward

_FINER = 4.0  # slabs per smallest spacing of the pictures that are compared
_OF_BUDGET = 1 / 4  # for a refined texture that nobody asked for
_VALUE_BYTES, _BYTES = 4, 20  # of a refined value; and with its texel, at most
PRECLASSIFIED = ("slab", "extinction")


def has_model(scene: CompleteScene) -> bool:
    """True if the scene can be drawn by `post` as well, which its own medium then stands for."""
    plain = not scene.added and not scene.volume.nearest and scene.volume.colors is None
    return scene.mode == "composite" and plain


def model_error(
    scene: CompleteScene, unrefined: CompleteScene, size: Size, settings: Settings, draw_exactly: DrawScene
) -> float | None:
    """Estimate the largest difference of the integrals of the medium that is drawn and that of `post`.

    None if the scene has no such medium; 0 for `post` and `integrated`.
    """
    if not has_model(scene):
        return None
    if scene.classification not in PRECLASSIFIED:
        return 0.0
    fine = replace(settings, slab_thickness=thickness_of_media(unrefined))
    drawn = draw_exactly(replace(scene, classification="extinction"), size, fine)
    return largest_difference(drawn, draw_exactly(replace(unrefined, classification="post"), size, fine))


def thickness_of_media(unrefined: CompleteScene) -> float:
    """Slab thickness of the two pictures that a model error is estimated from."""
    return unrefined.smallest_spacing / _FINER


@dataclass(frozen=True)
class Classified:
    """A choice of classification auto, and the reason in words: "its error of 1e-3 rms is at most 1/255"."""

    classification: Classification
    texture_refinement: int = 1
    reason: str = ""

    @property
    def sentence(self) -> str:
        """Choice and reason: "slab, since its error of 1e-3 rms is at most 1/255"."""
        return f"{self.classification}, since {self.reason}"


@dataclass(frozen=True)
class AskedOfModel:
    """Arguments of `Renderer.render` that decide how near the medium comes to that of `post`.

    Raises
    ------
    InputError
        If one of them is none of those that there are, or `of` is given without an error.
    """

    texture_refinement: int | str | None  # None: 1, but as many as auto needs
    max_error: float | None
    of: str

    def __post_init__(self) -> None:
        asked = self.texture_refinement
        if asked is not None and asked != "auto" and (isinstance(asked, bool) or asked not in REFINEMENTS):
            raise InputError(f"texture refinement must be 1, 2, 4 or auto, got {asked!r}")
        if self.of not in ("own", "post"):
            raise InputError(f"of must be own or post, got {self.of!r}")
        if self.of == "post" and self.max_error is None:
            raise InputError("an error of post needs a maximum error, got none")

    def settled(self, chosen: Classified | None) -> AskedOfModel:
        """Return it with the refinement of a choice of classification auto, and 1 if none was asked for."""
        return replace(self, texture_refinement=(chosen or self).texture_refinement or 1)

    def truth(self, unrefined: CompleteScene, drawn: CompleteScene) -> CompleteScene:
        """Return the scene whose integral the error is of."""
        return replace(unrefined, classification="post") if self.of == "post" else drawn

    def refinement(
        self, scene: CompleteScene, size: Size, settings: Settings, budget: int, draw_exactly: DrawScene
    ) -> tuple[int, float | None]:
        """Return the factor of the texels' grid, and the maximum error that is left for the slabs.

        Parameters
        ----------
        budget : int
            Bytes of textures.

        Raises
        ------
        InputError
            If the scene's texels cannot be refined, or it cannot be drawn by `post`.
        NoRoomError
            If the refined values would take more memory than textures may.

        Warns
        -----
        AccuracyWarning
            If the model error alone is more than the maximum error; all of this is then left for the slabs.
        """
        if isinstance(self.texture_refinement, int):
            _check_room(scene, self.texture_refinement, budget)
        if self.of == "own" or self.max_error is None:
            return self.shown(scene, settings.slab_thickness, budget), self.max_error
        if not has_model(scene):
            raise InputError("an error of post needs a single volume of values in mode composite")
        errors: dict[int, float] = {}
        for factor in self._possible(scene, budget):
            refined = refined_scene(scene, factor)
            errors[factor] = model_error(refined, scene, size, settings, draw_exactly) or 0.0
            if errors[factor] <= self.max_error / 2:
                break
        best = min(errors, key=lambda factor: errors[factor])
        if errors[best] < self.max_error:
            return best, self.max_error - errors[best]
        warnings.warn(
            f"requested error of {self.max_error:g} of post not reached: the medium of {scene.classification} at "
            f"texture refinement {best} is {upward(errors[best])} from it by estimate; that of post is not",
            AccuracyWarning,
            stacklevel=4,
        )
        return best, self.max_error

    def shown(self, scene: CompleteScene, slab_thickness: float, budget: int) -> int:
        """Return the factor that shows in a picture of a slab thickness, world units, and that there is room for."""
        if isinstance(self.texture_refinement, int):
            return self.texture_refinement
        if isinstance(scene.volume, LargeVolume):
            return 1
        thickness = slab_thickness if slab_thickness > 0 else scene.smallest_spacing
        return chosen_refinement(scene, thickness, _OF_BUDGET * budget)

    def _possible(self, scene: CompleteScene, budget: int) -> list[int]:
        if isinstance(self.texture_refinement, int):
            return [self.texture_refinement]
        if isinstance(scene.volume, LargeVolume):
            return [1]
        most = _OF_BUDGET * budget / _BYTES
        return [1] + [
            each for each in REFINEMENTS[1:] if not beyond_refinement(scene) and scene.volume.size * each**3 <= most
        ]


def _check_room(scene: CompleteScene, factor: int, budget: int) -> None:
    needed = scene.volume.size * factor**3 * _VALUE_BYTES
    if factor > 1 and not beyond_refinement(scene) and needed > budget:
        raise NoRoomError(
            f"texture refinement {factor} of this volume needs {needed / 1e6:.0f} MB for its values, got "
            f"{budget / 1e6:.0f} MB: allow more by --texture-memory"
        )
