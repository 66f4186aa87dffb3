"""Light on a scene and its reflection by the medium (Blinn 1977, with gradients as normals after Levoy 1988).

At a position with gradient g, the normal N = -g / |g| points to lower values. With V the direction to the eye, L_i the
direction to light i, H_i halfway between the two, l_i the colour of the light, times k / (d + k) at a distance d from a
point light with a fall-off of k, and the gradient confidence
w = smoothstep(0, fade, |g|),

    D = ambient + diffuse Σ l_i [(1 - w) + w max(N·L_i, 0)]
    S = specular Σ l_i w max(N·H_i, 0)^shininess     over the lights with N·L_i > 0

change the emission q of a medium of extinction τ to q D + τ S: straight colour c becomes c D + S. If lighting is
two-sided, N is turned to the side of the eye, N·V >= 0. Where w is 0 the gradient is noise, and the medium is lit
evenly from all sides.

Shadows: the fraction T_i(x + b L_i) of light i reaches a position x, unless it is the head light. T_i(y) is the
transmittance of the post-classified medium from y to the light, along the ray between them. The bias b is a 43rd of the
longest edge of the box, or 1.5 times the smallest spacing if that is larger, so that no surface lies in its own shadow.
A picture takes T_i from the `shadow_nodes` of the box, trilinear between them; b does not depend on their number.

A depth cue mixes the emission with a colour by depth (`DepthCue`): black and strength 1 is depth-only shading (Herman,
Liu 1979). It needs no gradient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.color import linear_color
from texvol.util.errors import InputError
from texvol.util.suggestions import check_one_of

LightKind = Literal["head", "directional", "point"]
LIGHT_KINDS: tuple[str, ...] = get_args(LightKind)
Triple = tuple[float, float, float]
# Fraction of the range of values per smallest spacing: 2.5 levels of 8 bits, about quantisation and weak noise.
_FADE = 0.01
MOST_CASTING = 4  # lights whose shadows one texel holds
SHADOW_NODES = 64  # along the longest edge of the box, unless another number is asked for
_LEAST_NODES, _MOST_NODES = 4, 512
_BIAS = 1.5  # in 64ths of the longest edge, the distance of the usual nodes, or in smallest spacings
_FARTHEST = 1e15  # in radii of the box: lights beyond it come from one direction
MOST = 1e30  # largest number in a shader: its product with a number of the scene is a float32


def _triple(numbers: Sequence[float] | Any, what: str) -> Triple:
    try:
        triple = tuple(float(number) for number in numbers)
    except (TypeError, ValueError):
        triple = ()
    if len(triple) != 3 or not np.isfinite(triple).all():
        raise InputError(f"{what} must be three finite numbers, got {numbers!r}")
    return triple


@dataclass(frozen=True)
class Light:
    """Light at the eye ("head"), from a direction ("directional"), or at a position ("point").

    Parameters
    ----------
    kind : "head", "directional" or "point"
    vector : (x, y, z), optional
        Directional: direction to the light, of any length. Point: position, world units. Head: none.
    color : (r, g, b)
        Linear.
    fall_off : float, optional
        Distance k, in world units, at which a point light has half of its strength: at a distance d it has k / (d + k),
        the 1 / (d + k) of the survey (5.2) for a light of colour k. Without it the light does not fall off.
    """

    kind: LightKind = "head"
    vector: Triple | None = None
    color: Triple = (1.0, 1.0, 1.0)
    fall_off: float | None = None

    if TYPE_CHECKING:  # what may be given, beside what is kept

        def __init__(
            self, kind: LightKind = "head", vector: ArrayLike | None = None, color: ArrayLike = (1.0, 1.0, 1.0),
            fall_off: float | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        check_one_of("light: kind", self.kind, LIGHT_KINDS)
        object.__setattr__(self, "color", linear_color(self.color, "light: colour"))
        if self.fall_off is not None:
            if self.kind != "point":
                raise InputError(f"light: only a point light falls off with distance, got kind {self.kind}")
            is_number = isinstance(self.fall_off, int | float) and not isinstance(self.fall_off, bool)
            if not is_number or not 0 < self.fall_off < np.inf:
                raise InputError(f"light: fall-off must be a positive distance, got {self.fall_off!r}")
        what = {"head": "", "directional": "direction", "point": "position"}[self.kind]
        if not what:
            if self.vector is not None:
                raise InputError("light: a head light must have no direction or position: it is at the eye")
            return
        if self.vector is None:
            raise InputError(f"light: a {self.kind} light needs a {what}, three numbers x, y, z")
        object.__setattr__(self, "vector", _triple(self.vector, f"light: {what}"))
        if self.kind == "directional" and not any(self.vector):
            raise InputError("light: direction must not be 0, 0, 0")


@dataclass(frozen=True)
class Lighting:
    """Lights and the reflection of the medium, see the module.

    Parameters
    ----------
    lights : sequence of Light
        By default a head light.
    ambient, diffuse, specular : float
        Factors of at least 0.
    shininess : float
        Blinn's exponent, at least 0.
    two_sided : bool
        True if the side of a surface that faces the eye is lit, whatever the sign of the gradient.
    fade : float, optional
        Gradient magnitude, in data units per world unit, below which shading fades out; by default a hundredth of the
        range of values per smallest spacing.
    shadows : bool
        True if the medium casts shadows; at most four lights may cast them.
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
                raise InputError(f"light: {name} must be a number of at least 0, got {number!r}")
        if self.shadows and len(self.casting) > MOST_CASTING:
            raise InputError(f"light: at most {MOST_CASTING} lights can cast shadows, got {len(self.casting)}")

    @property
    def casting(self) -> tuple[Light, ...]:
        """Lights that may cast shadows, directional ones first; shadows of a head light are invisible from the eye."""
        return tuple(light for kind in ("directional", "point") for light in self.lights if light.kind == kind)

    def fade_for(self, volume: Volume) -> float:
        """Return `fade` or its default for a volume, in data units per world unit, positive."""
        if self.fade is not None:
            return max(self.fade, 1e-300)
        low, high = (0.0, 1.0) if volume.labels else volume.finite_range or (0.0, 0.0)
        return max(_FADE * (high / volume.smallest_spacing - low / volume.smallest_spacing), 1e-300)

    @property
    def brightest(self) -> float:
        """Upper bound of a straight colour of 1 in this light."""
        return sum(self.most)

    @property
    def most(self) -> tuple[float, float]:
        """Upper bounds of D and S."""
        light = max((sum(min(each.color[channel], MOST) for each in self.lights) for channel in range(3)), default=0.0)
        ambient, diffuse, specular = (min(each, MOST) for each in (self.ambient, self.diffuse, self.specular))
        return ambient + diffuse * light, specular * light


@dataclass(frozen=True)
class DepthCue:
    """Mixture of the emission with a colour by depth: q (1 - t) + τ t color.

    t = strength · clamp((z - near) / (far - near), 0, 1). Depth z is along the view from the plane of the eye, in world
    units. `near` and `far` are by default the depths of the nearest and farthest corner of the box.
    """

    strength: float = 0.6
    color: Triple = (0.0, 0.0, 0.0)
    near: float | None = None
    far: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 1:
            raise InputError(f"depth cue: strength must be from 0 to 1, got {self.strength!r}")
        object.__setattr__(self, "color", linear_color(self.color, "depth cue: colour"))
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise InputError(f"depth cue: near must be less than far, got {self.near:g} and {self.far:g}")

    def range_for(self, volume: Volume, camera: Camera) -> tuple[float, float]:
        """Return the depths, in world units, at which t is 0 and at which it is the strength; the first is smaller."""
        depths = camera.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2]
        near = max(float(depths.min()), 0.0) if self.near is None else self.near
        far = float(depths.max()) if self.far is None else self.far
        return near, max(far, near + 1e-6 * volume.radius)


def checked_shadow_nodes(shadow_nodes: int) -> int:
    """Return the number of nodes along the longest edge of the box.

    Raises
    ------
    InputError
        If there can't be so many.
    """
    whole = isinstance(shadow_nodes, int | np.integer) and not isinstance(shadow_nodes, bool)
    if not whole or not _LEAST_NODES <= shadow_nodes <= _MOST_NODES:
        raise InputError(f"shadow nodes must be a number from {_LEAST_NODES} to {_MOST_NODES}, got {shadow_nodes!r}")
    return int(shadow_nodes)


def shadow_nodes(volume: Volume, most: int = SHADOW_NODES) -> tuple[int, int, int]:
    """Numbers (x, y, z) of nodes with a light transmittance, each in the middle of an equal part of the box.

    `most` is the number along the longest edge.
    """
    edges = np.linalg.norm(volume.box_edges, axis=0)
    x, y, z = np.clip(np.rint(most * edges / edges.max()), _LEAST_NODES, most).astype(int)
    return int(x), int(y), int(z)


def shadow_distance(volume: Volume) -> float:
    """Bias: distance towards the light at which the transmittance is looked up, in world units."""
    part = float(np.linalg.norm(volume.box_edges, axis=0).max()) / SHADOW_NODES
    return _BIAS * max(part, volume.smallest_spacing)


def unit(vector: Sequence[float]) -> NDArray[np.float64]:
    """Return the vector at length 1."""
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
