"""Light: what shines on a scene, and what of it matter sends to the eye (Blinn 1977, on gradients after Levoy 1988).

At a place of gradient g, |g| per world unit, the normal N = -g / |g| points to lower values. With V the direction to
the eye, L_i that to light i, H_i halfway between the two, l_i the light's colour and w = smoothstep(0, fade, |g|),

    D = ambient + diffuse Σ l_i [(1 - w) + w max(N·L_i, 0)]
    S = specular Σ l_i w max(N·H_i, 0)^shininess     over the lights with N·L_i > 0

take the emission q of matter of extinction τ to q D + τ S: straight colour c becomes c D + S. Two-sided, N is turned to
the side of the eye, N·V >= 0. Where w is 0 the gradient means nothing, and light falls on matter from all sides.

Shadows: of light i, unless it is the head light, the share T_i(x + b L_i) arrives at a place x. T_i is known at the
`shadow_nodes` of the box, as the transmittance of the post-classified matter from there to the light, and trilinear in
between; b is one and a half times the distance of the nodes, or of the samples if that is more, so that no surface lies
in its own shadow.

A depth cue mixes what glows with a colour, the more the farther it is (`DepthCue`): black and strength 1 is
depth-only shading (Herman, Liu 1979). It needs no gradient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

LightKind = Literal["head", "directional", "point"]
LIGHT_KINDS: tuple[str, ...] = get_args(LightKind)
Triple = tuple[float, float, float]
# Of the range of the values per smallest spacing: 2.5 levels of 8 bits, about what quantisation and weak noise make.
_FADE = 0.01
MOST_CASTING = 4  # lights whose shadows one texel holds
_MOST_NODES, _LEAST_NODES = 64, 4  # along an edge of the box
_NODES_AWAY = 1.5
_FARTHEST = 1e15  # in radii of the box: lights beyond it come from one direction
MOST = 1e30  # of any number that is drawn with: products of one with a number of the scene are float32s


def _triple(numbers: Sequence[float] | Any, what: str) -> Triple:
    try:
        triple = tuple(float(number) for number in numbers)
    except (TypeError, ValueError):
        triple = ()
    if len(triple) != 3 or not np.isfinite(triple).all():
        raise InputError(f"{what} is three finite numbers, and is {numbers!r}")
    return triple


@dataclass(frozen=True)
class Light:
    """A light: at the eye ("head"), from a direction ("directional"), or at a place ("point").

    Parameters
    ----------
    kind : "head", "directional" or "point"
    vector : (x, y, z), optional
        Directional: where the light comes from, of any length. Point: where it is, world units. Head: none.
    color : (r, g, b)
        Linear; it does not fall off with distance.
    """

    kind: LightKind = "head"
    vector: Triple | None = None
    color: Triple = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if self.kind not in LIGHT_KINDS:
            raise InputError(f"light: kind is one of {', '.join(LIGHT_KINDS)}, and not {self.kind!r}")
        object.__setattr__(self, "color", _triple(self.color, "light: colour"))
        if min(self.color) < 0:
            raise InputError(f"light: colour is three numbers from 0 upwards, and is {self.color!r}")
        what = {"head": "", "directional": "direction", "point": "position"}[self.kind]
        if not what:
            if self.vector is not None:
                raise InputError("light: a head light is where the eye is, and has no direction or position")
            return
        if self.vector is None:
            raise InputError(f"light: a {self.kind} light needs a {what}, three numbers x, y, z")
        object.__setattr__(self, "vector", _triple(self.vector, f"light: {what}"))
        if self.kind == "directional" and not any(self.vector):
            raise InputError("light: a directional light needs a direction, and 0, 0, 0 is none")


@dataclass(frozen=True)
class Lighting:
    """Lights and how matter answers them, see the module.

    Parameters
    ----------
    lights : sequence of Light
        A head light unless told.
    ambient, diffuse, specular : float
        Shares from 0 upwards.
    shininess : float
        Blinn's exponent, from 0 upwards.
    two_sided : bool
        Whether the side of a surface that faces the eye is lit, whichever way the gradient points.
    fade : float, optional
        Gradient magnitude, data units per world unit, under which shading fades out; None: a hundredth of the range of
        the values per smallest spacing.
    shadows : bool
        Whether matter takes light from what lies behind it, seen from the light; of at most four lights.
    """

    lights: tuple[Light, ...] = (Light(),)
    ambient: float = 0.3
    diffuse: float = 0.7
    specular: float = 0.2
    shininess: float = 32.0
    two_sided: bool = True
    fade: float | None = None
    shadows: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "lights", tuple(self.lights))
        for name in ("ambient", "diffuse", "specular", "shininess", "fade"):
            number = getattr(self, name)
            if number is None and name == "fade":
                continue
            if isinstance(number, bool) or not isinstance(number, int | float) or not 0 <= number < np.inf:
                raise InputError(f"light: {name} is a number from 0 upwards, and is {number!r}")
        if self.shadows and len(self.casting) > MOST_CASTING:
            raise InputError(f"light: at most {MOST_CASTING} lights cast shadows, and {len(self.casting)} are to")

    @property
    def casting(self) -> tuple[Light, ...]:
        """The lights that may cast shadows, the directional ones first; from the eye, the head light's are not seen."""
        return tuple(light for kind in ("directional", "point") for light in self.lights if light.kind == kind)

    def fade_for(self, volume: Volume) -> float:
        """`fade`, or what it is for a volume where nothing is said; data units per world unit, positive."""
        if self.fade is not None:
            return max(self.fade, 1e-300)
        low, high = (0.0, 1.0) if volume.labels else volume.finite_range or (0.0, 0.0)
        return max(_FADE * (high / volume.smallest_spacing - low / volume.smallest_spacing), 1e-300)

    @property
    def brightest(self) -> float:
        """The most that a straight colour of 1 may become."""
        return sum(self.most)

    @property
    def most(self) -> tuple[float, float]:
        """The largest that D and S may be."""
        light = max((sum(min(each.color[channel], MOST) for each in self.lights) for channel in range(3)), default=0.0)
        ambient, diffuse, specular = (min(each, MOST) for each in (self.ambient, self.diffuse, self.specular))
        return ambient + diffuse * light, specular * light


@dataclass(frozen=True)
class DepthCue:
    """What glows at depth z is mixed with `color` by strength · clamp((z - near) / (far - near), 0, 1).

    q becomes q (1 - t) + τ t color. Depth is along the view, from the plane of the eye, world units; `near` and `far`
    are the nearest and farthest corner of the box unless told.
    """

    strength: float = 0.6
    color: Triple = (0.0, 0.0, 0.0)
    near: float | None = None
    far: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 1:
            raise InputError(f"depth cue: strength lies in [0, 1], and is {self.strength!r}")
        object.__setattr__(self, "color", _triple(self.color, "depth cue: colour"))
        if min(self.color) < 0:
            raise InputError(f"depth cue: colour is three numbers from 0 upwards, and is {self.color!r}")
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise InputError(f"depth cue: near is nearer than far, and they are {self.near:g} and {self.far:g}")

    def range_for(self, volume: Volume, camera: Camera) -> tuple[float, float]:
        """Depths, world units, between which the cue grows from nothing to its strength; the first is smaller."""
        depths = camera.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2]
        near = max(float(depths.min()), 0.0) if self.near is None else self.near
        far = float(depths.max()) if self.far is None else self.far
        return near, max(far, near + 1e-6 * volume.radius)


def shadow_nodes(volume: Volume) -> tuple[int, int, int]:
    """Numbers (x, y, z) of nodes in the box at which it is known how much light arrives; each is in a cell's middle."""
    edges = np.linalg.norm(volume.box_edges, axis=0)
    x, y, z = np.clip(np.rint(_MOST_NODES * edges / edges.max()), _LEAST_NODES, _MOST_NODES).astype(int)
    return int(x), int(y), int(z)


def shadow_distance(volume: Volume) -> float:
    """How far towards the light shadows are looked up, world units: 1.5 times what nodes, or samples, are apart."""
    nodes_apart = float(np.linalg.norm(volume.box_edges, axis=0).max()) / _MOST_NODES
    return _NODES_AWAY * max(nodes_apart, volume.smallest_spacing)


def unit(vector: Sequence[float]) -> NDArray[np.float64]:
    """`vector` at length 1."""
    wide = np.asarray(vector, np.float64) / np.abs(vector).max()
    return wide / np.linalg.norm(wide)


def lights_of_kind(lighting: Lighting, kind: str) -> list[Light]:
    """Return the lights of one kind, in the order of the scene."""
    return [light for light in lighting.lights if light.kind == kind]


def position_of(light: Light, volume: Volume) -> NDArray[np.float64]:
    """Position of a point light, (x, y, z) from the middle of the box in world units, at most _FARTHEST away."""
    position = np.array(light.vector) - volume.centre
    return np.asarray(position / max(np.abs(position).max() / (_FARTHEST * volume.radius), 1.0))


def depends_on_eye(lighting: Lighting) -> bool:
    """Return True if the medium is lit differently as seen from another eye."""
    sees_eye = lighting.two_sided or lighting.specular > 0 or bool(lights_of_kind(lighting, "head"))
    return sees_eye and bool(lighting.lights)


def casts_shadows(lighting: Lighting | None) -> bool:
    """Return True if any light casts shadows."""
    return lighting is not None and lighting.shadows and bool(lighting.casting)
