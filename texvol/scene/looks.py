"""A look: transfer function, light, gradient and background that belong together.

A preset has a look by its name; a volume of which nothing is said has one by the kind of its data. The light of a look
is the head light at an exposure that keeps highlights: ambient + diffuse + specular = 1, so that a straight colour of 1
is lit to 1 at most. It is no tone curve: the light of the linear picture is that of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from texvol.scene.camera import Camera
from texvol.scene.covering import covering_labels
from texvol.scene.dark_objects import as_seen, mirrored
from texvol.scene.distances import depth_inside
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.kinds import Kind, as_labels, kind_of
from texvol.scene.label_counts import listed
from texvol.scene.label_names import table_of
from texvol.scene.light_sets import LIGHT_SETS, light_set
from texvol.scene.lighting import Lighting
from texvol.scene.scene_parts import SceneParts
from texvol.scene.transfer import presets
from texvol.scene.transfer.function import TransferFunction
from texvol.scene.transfer.labels import label_function
from texvol.scene.transfer.units import typical_samples
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

NO_LIGHT = "none"
_HEAD = "head"
_SOLID = "solid inside"
EXPOSED = Lighting(ambient=0.14, diffuse=0.74, specular=0.12)
_UNLIT = ("fog", "fluorescence")  # media without surfaces
_BONE = 250.0  # Hounsfield units
_BODY = -500.0
_ENOUGH_BONE = 0.01  # of the body
_FAINT = 0.25  # opacity of labels that hide others, together, where each is as thick as its mean
_SMOOTH = ((2.0, 4e6), (1.0, 1e7))  # scales of gradients of labels, for so many samples

_LOOKS: WeakKeyDictionary[Volume, Look] = WeakKeyDictionary()


@dataclass(frozen=True)
class Look:
    """Transfer function, and what it is shown in.

    Parameters
    ----------
    transfer_function : TransferFunction
    lighting : Lighting, optional
        Without it the medium shows its own colour.
    gradient : Estimator
    background : (r, g, b), optional
        Linear light from behind; by default that of the scene.
    name : str
        What messages call it: a preset, a file, or the kind of data.
    reason : str
        Why it was chosen; empty if it was asked for.
    """

    transfer_function: TransferFunction
    lighting: Lighting | None = None
    gradient: Estimator = CENTRAL
    background: tuple[float, float, float] | None = None
    name: str = ""
    reason: str = ""

    @property
    def sentence(self) -> str:
        """The look and its reason, for people."""
        lit = "lit" if self.lighting is not None else "unlit"
        return f"look {self.name}, {lit}" + (f": {self.reason}" if self.reason else "")

    def parts_for(self, scene: SceneParts, *, lit: bool = True) -> dict[str, Any]:
        """Return the parts of the look by name, without light and background where a scene has its own.

        A medium that emits cannot be lit, and so no volume beside it is.
        """
        parts: dict[str, Any] = {"transfer_function": self.transfer_function}
        emits = any(each.transfer_function is not None and each.transfer_function.emissive for each in scene.added)
        if lit and not emits and scene.lighting is None and self.lighting is not None:
            parts["lighting"] = self.lighting
            if scene.gradient == CENTRAL:
                parts["gradient"] = self.gradient
        if self.background is not None and not any(scene.background):
            parts["background"] = self.background
        return parts


def parts_taken(scene: SceneParts) -> dict[str, Any]:
    """Return the parts that stand for a look, for the name of a preset, and for a word as the light of a scene.

    The word is "none", "head", or the name of a set of lights, which is placed by the scene's camera.
    """
    look: Any = scene.transfer_function
    parts: dict[str, Any] = {}
    unlit = isinstance(scene.lighting, str) and scene.lighting == NO_LIGHT
    if unlit:
        parts["lighting"] = None
    elif isinstance(scene.lighting, str):
        parts["lighting"] = _light_by(scene.lighting, scene)
    if unlit and look is None and scene.mode == "composite":
        look, parts["volume"] = look_for(scene.volume), seen_as(scene.volume)
    elif isinstance(look, str):
        look = look_of(look, scene.volume)
    if isinstance(look, Look):
        parts |= look.parts_for(scene, lit=not unlit and scene.mode == "composite")
    return parts


def _light_by(word: str, scene: SceneParts) -> Lighting:
    """Return the head light of looks, or a set of lights placed by the scene's camera."""
    if word == _HEAD:
        return EXPOSED
    if word not in LIGHT_SETS:
        words = NO_LIGHT, _HEAD, *LIGHT_SETS
        near = did_you_mean(word, words)
        raise InputError(f"scene: lighting must be a Lighting or one of {', '.join(words)}, got {word!r}{near}")
    return light_set(word, scene.camera or Camera.framing(scene.volume))


def look_of(name: str, volume: Volume, materials: Sequence[str] | None = None) -> Look:
    """Return the look of a preset.

    Raises
    ------
    InputError
        In the cases of `preset`.
    """
    medium = replace(presets.preset(name, volume, materials), by_look=True)
    return Look(medium, None if name in _UNLIT or medium.emissive else EXPOSED, name=name)


def look_for(volume: Volume) -> Look:
    """Return the look of the first picture of a volume, by the kind of its data; the same object each time.

    The transfer function of labels is for `seen_as(volume)`, whose values are labels.
    """
    if volume not in _LOOKS:
        look = _look_by(kind_of(volume), volume)
        _LOOKS[volume] = replace(look, transfer_function=replace(look.transfer_function, by_look=True))
    return _LOOKS[volume]


def look_as_is(volume: Volume) -> Look:
    """Return the look of the first picture of a volume whose values are what it says, labels or not."""
    kind = kind_of(volume)
    if kind.name != "labels" or volume.labels:
        return look_for(volume)
    medium = replace(presets.proposed_in_light(volume), by_look=True)
    return Look(medium, EXPOSED, name="proposal", reason="its values are no labels")


def seen_as(volume: Volume) -> Volume:
    """Return the volume as its first picture shows it: with labels if its values look like labels."""
    return as_labels(volume) if kind_of(volume).name == "labels" else volume


def look_name(volume: Volume) -> str:
    """Return the name of the look of the first picture of a volume."""
    kind = kind_of(volume).name
    if kind == "CT":
        return _ct_preset(volume)
    named = {"MR": "mr", "distance": _SOLID, "signed": "diverging", "noise": "fluorescence", "field": "viridis"}
    return kind if kind in ("labels", "fluorescence") else named.get(kind, "proposal")


def _look_by(kind: Kind, volume: Volume) -> Look:
    if kind.name == "labels":
        medium, reason = _medium_of_labels(as_labels(volume), kind.reason)
        return Look(medium, EXPOSED, _gradient_of_labels(volume), name="labels", reason=reason)
    if kind.name == "fluorescence":
        channel = getattr(volume, "channel", None)
        medium = presets.proposed_for(volume) if channel else presets.preset("fluorescence", volume)
        return Look(medium, name="fluorescence", reason=kind.reason)
    if (name := look_name(volume)) in presets.PRESETS:
        return replace(look_of(name, volume), reason=kind.reason)
    if kind.name == "distance" and (depth := depth_inside(volume)) is not None:
        return Look(presets.solid_inside(volume, depth), EXPOSED, name=_SOLID, reason=kind.reason)
    if kind.name == "dark" and (exchanged := mirrored(volume)):
        return Look(as_seen(presets.proposed_in_light(exchanged), volume), EXPOSED, name="proposal", reason=kind.reason)
    medium = presets.proposed_for(volume) if kind.name == "colours" else presets.proposed_in_light(volume)
    return Look(medium, EXPOSED, name="proposal", reason=kind.reason)


def _medium_of_labels(volume: Volume, reason: str) -> tuple[TransferFunction, str]:
    """Return a transfer function in which labels that hide most of the others are faint, and the reason with that."""
    table = table_of(volume)
    hidden = [label for label, entry in table.entries.items() if not entry.shown] if table else []
    covering = covering_labels(volume, (0, *hidden))
    if not covering:
        return presets.proposed_for(volume), reason
    spacing = volume.smallest_spacing
    part = spacing / len(covering)
    opacities = {each.label: 1 - (1 - _FAINT) ** (part / max(each.thickness, spacing)) for each in covering}
    which = listed(np.sort([each.label for each in covering]))
    faint = "label {} is faint, since it hides" if len(covering) == 1 else "labels {} are faint, since they hide"
    return label_function(volume, opacities), f"{reason}; {faint.format(which)} others (--label-look)"


def _gradient_of_labels(volume: Volume) -> Estimator:
    """Return the gradient estimator for the stairs of labels: as smooth as takes at most a second or two."""
    return next((Estimator("gaussian", scale) for scale, most in _SMOOTH if volume.size <= most), CENTRAL)


def _ct_preset(volume: Volume) -> str:
    """Return the preset for CT: bone where there is any, else soft tissue."""
    samples = typical_samples(volume)
    body = samples[samples > _BODY]
    return "ct-bone" if body.size and float(np.mean(body > _BONE)) >= _ENOUGH_BONE else "ct-soft-tissue"
