"""No stored picture: the oracle's is the reference, and the bound is the error that the scene has in slabs so thick.

The bound comes from the scene and the oracle, never from the picture that it is for: see `plain_slabs`. Where a scene
is more than that models, colour is bounded by what drawing it with slabs half as thick changes, at the same size and
without rounding (see `error_control`); opacity still by the plain slabs, wherever it does not depend on the gradient.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits
from texvol.comparison.outcome import Outcome, examine, number_range
from texvol.comparison.pictures import Picture
from texvol.provenance.scene_metadata import ATTRIBUTE, scene_metadata
from texvol.pytest_plugin import plain_slabs
from texvol.pytest_plugin.candidates import Candidate, Maker
from texvol.rendering import error_control
from texvol.scene.display import NUMBER_MODES
from texvol.util.errors import InputError, missing_extra

if TYPE_CHECKING:
    from texvol.scene.scene import Scene

# A picture that is off by so much everywhere has FLIP 0.11 on white, where the eye sees least, and more on every other
# ground: twice what the looser limits of `texvol diff` allow. Whoever looks sees an error that such a bound lets pass.
LOOSE = 1 / 16
ACCURACY = ("max_error", "slab_thickness", "sampling_rate")
ORACLE = "ray casting, float64"
# Of a format's numbers, what one blend rounds away: half a step of 8 bits where it is kept between 0 and 1, twice that
# for what is added; half precision's unit roundoff.
_BLEND = {"rgba8": 1 / 255, "rgba16f": 2.0**-11, "rgba32f": 0.0}
_TEXEL_FILTER = {"rgba8": 1 / 255}  # drivers filter 8-bit texels in 8 bits too


@dataclass(frozen=True)
class Bound:
    """How far a picture may be from the oracle's, at most; and why, in words."""

    color: float
    opacity: float
    words: str


def examined(candidate: Candidate, options: Mapping[str, Any], maker: Maker, name: str) -> Outcome:
    """What came of holding a candidate against the oracle.

    Parameters
    ----------
    options : mapping
        What the test says of the accuracy: `max_error`, `slab_thickness`, `sampling_rate`.

    Raises
    ------
    InputError
        If it is not known what the picture is of.
    MissingExtraError
        If the oracle's library is not installed.
    """
    given, candidate = candidate.scene, _with_scene(candidate)
    scene = candidate.scene
    if scene is None:
        raise InputError(f"picture {name!r}: oracle=True needs a scene: hand one over, or say scene= of what it shows")
    numbers = scene.mode in NUMBER_MODES
    if numbers and candidate.picture.whole_numbers:
        raise InputError(f"picture {name!r}: of mode {scene.mode} the numbers themselves are compared: use floats")
    if candidate.renderer is not None:
        candidate = replace(candidate, stats=candidate.renderer.stats)
    truth = truth_of(scene, candidate.size)
    bound = _bound(candidate, scene, truth, options, maker)
    header = {key: text for key, text in candidate.picture.attributes.items() if key == ATTRIBUTE}
    if given is not None and candidate.renderer is None:  # which a file's own header may contradict
        header = {ATTRIBUTE: scene_metadata(scene.volume.name, scene, checksum=True)[ATTRIBUTE]}
    attributes = {DRIVER_ATTRIBUTE: ORACLE} | header
    reference = Picture.of_array(truth, "the oracle", attributes)
    if candidate.picture.channels != reference.channels:
        reference = _like(candidate.picture, reference)
    scale = number_range(reference) if numbers else 1.0
    most = max(bound.color, bound.opacity) / scale
    limits = Limits(most, 0.0, most, np.inf, most, np.inf, bound.words)
    outcome = examine(candidate.picture, reference, limits, name=name)
    return _with_note(_parts_apart(outcome, bound, scale))


def loose_words(outcome: Outcome) -> str:
    """Warning of a bound that lets errors pass which are plain to see; empty for a tighter one."""
    limits = outcome.limits
    if not limits.max_abs > LOOSE:
        return ""
    unit = " of the numbers' range" if outcome.measures is not None and outcome.measures.scale != 1 else ""
    return (
        f"the bound of picture {outcome.name!r} is {limits.max_abs:.2g}{unit} ({limits.source}), so loose that errors "
        f"pass which are plain to see (from {LOOSE:.2g} on): draw it with a larger sampling_rate, or with max_error"
    )


def _with_note(outcome: Outcome) -> Outcome:
    words = loose_words(outcome)
    return replace(outcome, notes=(*outcome.notes, words)) if words else outcome


def truth_of(scene: Scene, size: tuple[int, int]) -> NDArray[np.float64]:
    """The oracle's picture."""
    try:
        from texvol.ray_casting import raycast
    except ImportError as error:
        raise missing_extra("numba", "oracle", "the oracle") from error
    return raycast(scene, size)


def _with_scene(candidate: Candidate) -> Candidate:
    """The candidate with the scene in its header, where the test does not say which."""
    if candidate.scene is not None or ATTRIBUTE not in candidate.picture.attributes:
        return candidate
    from texvol.provenance.stored_scene import stored_scene_of

    picture = candidate.picture
    folder = str(picture.name).rpartition("/")[0] or "."
    stored = stored_scene_of(picture.attributes, name=picture.name, folder=folder)
    return replace(candidate, scene=stored.scene, settings=stored.settings)


def _like(picture: Picture, reference: Picture) -> Picture:
    """The oracle's picture with as many channels as the candidate's; grey has no scene."""
    if picture.channels < 3:
        raise InputError(f"{picture.name}: oracle=True needs colours, RGB or RGBA, and {picture.words} came")
    pixels = reference.pixels.copy()
    pixels[..., 3] = 1
    return replace(reference, pixels=pixels, channels=3, has_opacity=False)


def _bound(candidate: Candidate, scene: Scene, truth: NDArray, options: Mapping[str, Any], maker: Maker) -> Bound:
    settings = _settings(candidate, scene, options)
    wanted = options.get("max_error")
    if wanted is not None and not 0 < wanted < np.inf:
        raise InputError(f"max_error must be positive and finite, and is {wanted!r}")
    if wanted is not None and candidate.renderer is None:
        return Bound(wanted, wanted, f"max_error={wanted:g}, as the test says")
    color, opacity, words = _expected(candidate, scene, truth, settings, maker)
    if wanted is None:
        return Bound(color, opacity, words)
    return Bound(min(color, wanted), min(opacity, wanted), f"{words}, and max_error={wanted:g}")


def _expected(
    candidate: Candidate, scene: Scene, truth: NDArray, settings: Mapping[str, Any], maker: Maker
) -> tuple[float, float, str]:
    """Bounds of colour and opacity, and where they come from."""
    thickness, size = settings["slab_thickness"], candidate.size
    allowance = _rounding(candidate, scene, truth, settings)
    color = opacity = None
    if plain_slabs.can_draw(scene):
        texel_format = candidate.stats.get("texture_format", settings.get("texture_format", "auto"))
        plain, coarse = plain_slabs.pictures_of_slabs(scene, size, thickness, texel_format)
        off = np.maximum(np.abs(plain - truth), np.abs(coarse - truth)) + np.abs(coarse - plain)
        expected = error_control.SAFETY * off + allowance
        opacity = float(expected[..., 3].max())
        color = float(expected[..., :3].max()) if plain_slabs.knows_color(scene) else None
    words = f"the error of plain slabs {thickness:.4g} thick"
    if color is None:
        estimate = _estimate(candidate, scene, settings, maker) + allowance
        words = f"what slabs half of {thickness:.4g} thick change" + ("; of opacity, " + words if opacity else "")
        color, opacity = estimate, estimate if opacity is None else opacity
    assert opacity is not None
    return color, opacity, words


def _settings(candidate: Candidate, scene: Scene, options: Mapping[str, Any]) -> dict[str, Any]:
    """How the picture was drawn, or is taken to have been."""
    from texvol.rendering import accuracy

    if candidate.settings.get("slab_thickness"):
        return dict(candidate.settings)
    thickness = accuracy.checked(scene, options.get("slab_thickness"), options.get("sampling_rate"), None)
    return {"slab_thickness": thickness, "texture_format": "rgba32f"}


def _rounding(candidate: Candidate, scene: Scene, truth: NDArray, settings: Mapping[str, Any]) -> float:
    """What formats and early ends of rays add: float32 itself, each blend into a smaller target, 8-bit filtering."""
    brightest = max(float(np.abs(truth[np.isfinite(truth)]).max(initial=0.0)), 1.0)
    stacks = -(-2 * scene.volume.radius // settings["slab_thickness"])
    blends = _BLEND.get(settings.get("target_format", "rgba32f"), 0.0) * stacks
    texels = _TEXEL_FILTER.get(candidate.stats.get("texture_format", ""), 0.0)
    ends = settings.get("early_termination", 0.0) or 0.0
    return brightest * (error_control.rounding_of(scene) + blends + texels + ends)


def _estimate(candidate: Candidate, scene: Scene, settings: Mapping[str, Any], maker: Maker) -> float:
    """What halving the slabs changes in the whole picture, drawn without rounding.

    The candidate's own renderer is not asked: what it estimates grows with its mistakes.
    """
    exact: dict[str, Any] = {"texture_format": "rgba32f", "target_format": "rgba32f", "early_termination": 0.0}
    renderer, thickness = maker.renderer(), settings["slab_thickness"]
    coarse = renderer.render(scene, candidate.size, slab_thickness=thickness, **exact)
    finer = renderer.render(error_control.reference_for(scene), candidate.size, slab_thickness=thickness / 2, **exact)
    return error_control.estimate(coarse, finer, 1, error_control.rounding_of(scene))


def _parts_apart(outcome: Outcome, bound: Bound, scale: float) -> Outcome:
    """The outcome, different also where only one of colour and opacity is over its own bound."""
    if outcome.measures is None or outcome.status == "broken":
        return outcome
    over = []
    for part, limit in (("color", bound.color / scale), ("opacity", bound.opacity / scale)):
        if part not in outcome.measures.parts:
            continue
        beyond = outcome.measures.parts[part].max_error - float(outcome.candidate.rounding.max())
        if not beyond <= limit + np.finfo(np.float32).eps:
            over.append(f"{part} is {beyond:.3g} from the oracle's, and the bound is {limit:.3g} ({bound.words})")
    if not over:
        return outcome
    return replace(outcome, status="different", violations=(*over, *outcome.violations))
