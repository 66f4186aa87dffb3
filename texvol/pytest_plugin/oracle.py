"""Pictures without a stored reference: the oracle draws the reference, and the bound is the error of the scene's slabs.

The bound comes from the scene and the oracle, never from the checked picture: see `plain_slabs`. If a scene has parts
that `plain_slabs` does not model, the bound of colour is the change from drawing with slabs half as thick, at the same
size and without rounding (see `error_control`); the bound of opacity is still that of plain slabs, unless opacity
depends on the gradient.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits
from texvol.comparison.outcome import Outcome, examine, number_range
from texvol.comparison.pictures import Picture
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata
from texvol.pytest_plugin import plain_slabs
from texvol.pytest_plugin.candidates import Candidate, Maker
from texvol.rendering import error_control
from texvol.rendering.shadow_error import error_of_nodes, in_shadow
from texvol.scene.display import NUMBER_MODES
from texvol.scene.lighting import SHADOW_NODES
from texvol.scene.refinement import refined_scene
from texvol.util.errors import InputError, missing_extra

if TYPE_CHECKING:
    from texvol.scene.scene import Scene

# A picture that is off by this much everywhere has FLIP 0.11 on white, where the eye sees least, and more on all other
# colours: twice the looser limits of `texvol diff`. So a larger bound allows visible errors.
LOOSE = 1 / 16
ACCURACY = ("max_error", "slab_thickness", "sampling_rate")
ORACLE = "ray casting, float64"
# Rounding of one blend: half a step of 8 bits for the product and for the sum; the unit roundoff of half floats.
_BLEND = {"rgba8": 1 / 255, "rgba16f": 2.0**-11, "rgba32f": 0.0}
_TEXEL_FILTER = {"rgba8": 1 / 255}  # drivers filter 8-bit texels in 8 bits too


@dataclass(frozen=True)
class Bound:
    """Largest allowed distance of a picture from the oracle's, and its origin in words."""

    color: float
    opacity: float
    words: str


def examined(candidate: Candidate, options: Mapping[str, Any], maker: Maker, name: str) -> Outcome:
    """Compare a candidate with the oracle's picture.

    Parameters
    ----------
    options : mapping
        Accuracy that the test asks for: `max_error`, `slab_thickness`, `sampling_rate`.

    Raises
    ------
    InputError
        If the picture's scene is unknown.
    MissingExtraError
        If the oracle's library is not installed.
    """
    given, candidate = candidate.scene, _with_scene(candidate)
    scene = candidate.scene
    if scene is None:
        raise InputError(f"picture {name!r}: oracle=True needs a scene; pass a scene, or scene=")
    if (refinement := candidate.settings.get("texture_refinement", 1)) > 1:
        # The medium of refined texels is that of the refined volume.
        scene = refined_scene(scene.completed(candidate.size), refinement)
    numbers = scene.mode in NUMBER_MODES
    if numbers and candidate.picture.whole_numbers:
        raise InputError(f"picture {name!r}: a picture of mode {scene.mode} must hold floats, got whole numbers")
    if candidate.renderer is not None:
        candidate = replace(candidate, stats=candidate.renderer.stats)
    truth = truth_of(scene, candidate.size)
    bound = _bound(candidate, scene, truth, options, maker)
    header = {key: text for key, text in candidate.picture.attributes.items() if key == ATTRIBUTE}
    if given is not None and candidate.renderer is None:  # a file's own header may contradict it
        header = {ATTRIBUTE: scene_metadata(scene.volume.name, scene, checksum=True)[ATTRIBUTE]}
    attributes = {DRIVER_ATTRIBUTE: ORACLE} | header
    reference = Picture.of_array(truth, "the oracle", attributes)
    if candidate.picture.channels != reference.channels:
        reference = _like(candidate.picture, reference)
    scale = number_range(reference) if numbers else 1.0
    most = max(bound.color, bound.opacity) / scale
    limits = Limits(most, 0.0, most, np.inf, most, np.inf, bound.words)
    outcome = examine(candidate.picture, reference, limits, name=name)
    outcome = _parts_apart(outcome, bound, scale)
    words = loose_words(outcome)
    return replace(outcome, notes=(*outcome.notes, words)) if words else outcome


def loose_words(outcome: Outcome) -> str:
    """Return a warning of a bound that allows visible errors; empty for a tighter bound."""
    limits = outcome.limits
    if not limits.max_abs > LOOSE:
        return ""
    unit = " of the numbers' range" if outcome.measures is not None and outcome.measures.scale != 1 else ""
    return (
        f"the bound of picture {outcome.name!r} is {limits.max_abs:.2g}{unit} ({limits.source}), which allows "
        f"visible errors (from {LOOSE:.2g} on); draw the scene with a larger sampling_rate, or with max_error"
    )


def truth_of(scene: Scene, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the oracle's picture."""
    try:
        from texvol.rendering.streaming.exact import raycast
    except ImportError as error:
        raise missing_extra("numba", "oracle", "the oracle") from error
    return raycast(scene, size)


def _with_scene(candidate: Candidate) -> Candidate:
    """Return the candidate with the scene in its header, if the test names no scene."""
    if candidate.scene is not None or ATTRIBUTE not in candidate.picture.attributes:
        return candidate
    from texvol.provenance.stored_scene import stored_scene_of

    picture = candidate.picture
    folder = str(picture.name).rpartition("/")[0] or "."
    stored = stored_scene_of(picture.attributes, name=picture.name, folder=folder)
    return replace(candidate, scene=stored.scene, settings=stored.settings)


def _like(picture: Picture, reference: Picture) -> Picture:
    """Return the oracle's picture with the candidate's number of channels; raise InputError for grey."""
    if picture.channels < 3:
        raise InputError(f"{picture.name}: the picture must be RGB or RGBA for oracle=True, got {picture.words}")
    pixels = reference.pixels.copy()
    pixels[..., 3] = 1
    return replace(reference, pixels=pixels, channels=3, has_opacity=False)


def _bound(candidate: Candidate, scene: Scene, truth: NDArray, options: Mapping[str, Any], maker: Maker) -> Bound:
    wanted = options.get("max_error")
    if wanted is not None and not 0 < wanted < np.inf:
        raise InputError(f"max_error must be positive and finite, got {wanted!r}")
    if wanted is not None and candidate.renderer is None:
        return Bound(wanted, wanted, f"max_error={wanted:g} of the test")
    found = _expected(candidate, scene, truth, _settings(candidate, scene, options), maker)
    if wanted is None:
        return found
    return Bound(min(found.color, wanted), min(found.opacity, wanted), f"{found.words}, and max_error={wanted:g}")


def _expected(candidate: Candidate, scene: Scene, truth: NDArray, settings: Mapping[str, Any], maker: Maker) -> Bound:
    """Return the bound that the thickness of the slabs sets."""
    thickness, size = settings["slab_thickness"], candidate.size
    allowance = _rounding(candidate, scene, truth, settings)
    words, opacity = f"the error of plain slabs {thickness:.4g} thick", None
    if plain_slabs.can_draw(scene):
        texel_format = candidate.stats.get("texture_format", settings.get("texture_format", "auto"))
        divides = settings.get("adaptive") == "on"
        plain, coarse = plain_slabs.pictures_of_slabs(scene, size, thickness, texel_format, divides)
        off = np.maximum(np.abs(plain - truth), np.abs(coarse - truth)) + np.abs(coarse - plain)
        expected = error_control.SAFETY * off + allowance
        opacity = float(expected[..., 3].max())
        if plain_slabs.knows_color(scene):
            return Bound(float(expected[..., :3].max()), opacity, words)
    estimate = _estimate(candidate, scene, settings, maker) + allowance
    change = f"the change from slabs {thickness:.4g} to half as thick"
    if opacity is None:
        return Bound(estimate, estimate, change)
    return Bound(estimate, opacity, f"{change}; of opacity, {words}" if opacity else change)


def _settings(candidate: Candidate, scene: Scene, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of the drawing, or assumed ones."""
    from texvol.rendering.settings import checked

    if candidate.settings.get("slab_thickness"):
        return dict(candidate.settings)
    thickness = checked(scene, options.get("slab_thickness"), options.get("sampling_rate"), None)
    return {"slab_thickness": thickness, "texture_format": "rgba32f"}


def _rounding(candidate: Candidate, scene: Scene, truth: NDArray, settings: Mapping[str, Any]) -> float:
    """Error from formats and early termination: float32 itself, each blend into a smaller target, 8-bit filtering."""
    brightest = max(float(np.abs(truth[np.isfinite(truth)]).max(initial=0.0)), 1.0)
    stacks = -(-2 * scene.volume.radius // settings["slab_thickness"])
    blends = _BLEND.get(settings.get("target_format", "rgba32f"), 0.0) * stacks
    texels = _TEXEL_FILTER.get(candidate.stats.get("texture_format", ""), 0.0)
    ends = settings.get("early_termination", 0.0) or 0.0
    return brightest * (error_control.rounding_of(scene) + blends + texels + ends)


def _estimate(candidate: Candidate, scene: Scene, settings: Mapping[str, Any], maker: Maker) -> float:
    """Return the change of the whole picture from slabs half as thick, and that by more nodes of shadows.

    All are drawn without rounding. The candidate's own renderer is not used: its estimates grow with its mistakes.
    """
    exact: dict[str, Any] = {"texture_format": "rgba32f", "target_format": "rgba32f", "early_termination": 0.0}
    renderer, thickness = maker.renderer(), settings["slab_thickness"]
    nodes = settings.get("shadow_nodes", SHADOW_NODES)

    def drawn(scene: Scene, thickness: float, nodes: int, **more: Any) -> NDArray[np.float32]:
        return renderer.render(scene, candidate.size, slab_thickness=thickness, shadow_nodes=nodes, **exact, **more)

    of_nodes = error_of_nodes(partial(drawn, scene, thickness), nodes) if in_shadow(scene) else 0.0
    coarse = drawn(scene, thickness, nodes, adaptive=settings.get("adaptive", "off"))
    finer = drawn(error_control.reference_for(scene), thickness / 2, nodes)
    return error_control.estimate(coarse, finer, 1, error_control.rounding_of(scene)) + of_nodes


def _parts_apart(outcome: Outcome, bound: Bound, scale: float) -> Outcome:
    """Return the outcome; different also if only colour or only opacity exceeds its own bound."""
    if outcome.measures is None or outcome.status == "broken":
        return outcome
    over = []
    for part, limit in (("color", bound.color / scale), ("opacity", bound.opacity / scale)):
        if part not in outcome.measures.parts:
            continue
        beyond = outcome.measures.parts[part].max_error - float(outcome.candidate.rounding.max())
        if not beyond <= limit + np.finfo(np.float32).eps:
            over.append(f"{part} is {beyond:.3g} from the oracle's, the bound is {limit:.3g} ({bound.words})")
    if not over:
        return outcome
    return replace(outcome, status="different", violations=(*over, *outcome.violations))
