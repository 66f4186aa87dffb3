"""Uniforms and switches of the programs; all that depends on the box is worked out in float64.

Lights are counted among directions of the world, gradients relative to the largest that a texel may hold, positions
relative to the middle of the box and its radius, so that float32 has digits left in worlds of any size.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.drawing import Drawing, DrawnVolume, View
from texvol.scene.camera import Camera
from texvol.scene.cutting import Cutting
from texvol.scene.lighting import (
    MOST,
    DepthCue,
    Lighting,
    casts_shadows,
    depends_on_eye,
    lights_of_kind,
    position_of,
    shadow_distance,
    unit,
)
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import SlabStacks
from texvol.textures.value_texture import ValueTexture

# Switches that are 0 where nothing asks for them.
NOTHING_SPECIAL = dict.fromkeys(
    ("RAMPS", "SPREAD", "WHOLE_SLABS", "SHALLOW", "EMISSIVE", "MISSING", "GRADIENT", "WEIGHTS")
    + ("MODULATIONS", "GRADED", "CONTOURS"),
    0,
)
NO_LIGHT = dict.fromkeys(
    ("LIT", "HEAD_LIGHT", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "FALL_OFF", "SPECULAR", "TWO_SIDED", "SHADOWS"), 0
)
_LEAST = 1e-30  # of what is divided by: its product with MOST and its square are float32s
_MOST_SQUARINGS = 7  # in place of a power
_ENDS_AHEAD, _LEAST_AHEAD, _MOST_AHEAD = 6.0, 16.0, 64.0  # times the slabs that end a ray, and slabs


def picture_switches(drawing: Drawing) -> dict[str, int]:
    """Switches that all volumes of a picture share."""
    return {
        "PERSPECTIVE": int(drawing.is_perspective),
        "HALF_SPACES": len(drawing.cutting),
        "INTERVAL": int(bool(drawing.interval)),
        "CUE": int(drawing.depth_cue is not None),
        "COUNT": int(drawing.count),
    }


def volume_switches(drawn: DrawnVolume, brick: Brick) -> dict[str, int]:
    """Switches of one volume and the brick of it that is drawn, but for those of its texels."""
    skips = drawn.skips is not None or drawn.bounds is not None
    fetched = drawn.fetched and not drawn.volume.nearest  # labels are not interpolated
    of_texels = {"BRICKS": int(not brick.is_whole), "SKIPS": int(skips), "FETCHED": int(fetched)}
    return light_switches(drawn.lighting) | of_texels


def single_switches(drawing: Drawing, brick: Brick) -> dict[str, int]:
    """Switches of slab_stack.glsl and projection.glsl, which draw a single volume."""
    drawn, view = drawing.first, drawing.view
    if drawing.projection is not None:
        assert isinstance(drawn.baked, ValueTexture), "only values are projected"
        texels = NO_LIGHT | drawing.projection.switches(drawn.baked) | {"KNOWN": int(bool(drawing.known))}
    else:
        obliquity = view.camera.largest_obliquity(view.size)
        texels = NO_LIGHT | NOTHING_SPECIAL | drawn.baked.switches(view.slab_thickness, obliquity)
        divides = drawing.least_divided is not None
        at_once = 2 if divides else _slabs_at_once(drawing, texels)
        texels |= {"CAPS": int(drawing.cutting.caps), "AT_ONCE": at_once, "DIVIDES": int(divides)}
    cut = {"BRICKS": int(drawing.is_cut(brick))}
    return texels | volume_switches(drawn, brick) | cut | picture_switches(drawing)


def _slabs_at_once(drawing: Drawing, switches: dict[str, int]) -> int:
    """Return how many slabs of a run are sampled at a time: more in long runs with few registers for each slab."""
    is_little = switches["CLASSIFICATION"] == 2 and switches["RAMPS"] and not switches["GRADIENT"] | switches["WEIGHTS"]
    drawn = drawing.first
    runs_are_long = drawn.skips is None or drawing.view.slab_thickness <= drawn.volume.smallest_spacing
    return 4 if is_little and runs_are_long else 2


def picture_uniforms(drawing: Drawing, stacks: SlabStacks) -> dict[str, Any]:
    """Uniforms that all volumes of a picture share."""
    camera, size = drawing.view.camera, drawing.view.size
    uniforms: dict[str, Any] = {"eye_depth": stacks.eye_depth, "picture_middle": (size[0] / 2, size[1] / 2)}
    if drawing.cutting:
        uniforms["half_spaces"] = half_spaces_in_box(drawing.cutting, drawing.first.volume)
    if drawing.is_perspective and (drawing.projection is None or drawing.projection.measures_rays):
        uniforms["tangent_per_pixel"] = 2 * camera.half_height / size[1]
    return uniforms


def volume_uniforms(drawing: Drawing, drawn: DrawnVolume, brick: Brick) -> dict[str, Any]:
    """Uniforms of one volume and the brick of it that is drawn, but for those of its cells."""
    uniforms = ray_uniforms(drawn.volume, drawing.view) | _texel_uniforms(drawing, drawn, brick)
    uniforms |= _lit_uniforms(drawing, drawn)
    return uniforms | brick_uniforms(brick, drawing.own_range(brick)) if drawing.is_cut(brick) else uniforms


def box_from_world(volume: Volume) -> NDArray[np.float64]:
    """Matrix of shape (3, 3) that takes a step in the world to fractions of the box."""
    return volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]


def ray_uniforms(volume: Volume, view: View) -> dict[str, Any]:
    """Positions of the rays in the box at depth 0, and their steps for a depth of one slab."""
    rays = view.camera.pixel_rays(view.size, view.origin)
    to_box = box_from_world(volume)
    per_slab = to_box * view.slab_thickness
    uniforms: dict[str, Any] = {
        "point": tuple(0.5 + to_box @ (rays.point + (view.origin - volume.centre))),
        "point_per_column": tuple(to_box @ rays.point_per_column),
        "point_per_row": tuple(to_box @ rays.point_per_row),
        "velocity": tuple(per_slab @ rays.velocity),
    }
    if view.camera.projection == "perspective":
        uniforms["velocity_per_column"] = tuple(per_slab @ rays.velocity_per_column)
        uniforms["velocity_per_row"] = tuple(per_slab @ rays.velocity_per_row)
    return uniforms


def _texel_uniforms(drawing: Drawing, drawn: DrawnVolume, brick: Brick) -> dict[str, Any]:
    """Uniforms of the texels: a medium, or the values themselves in a projection."""
    if drawing.projection is not None:
        assert isinstance(drawn.baked, ValueTexture), "only values are projected"
        return drawing.projection.uniforms(drawn.baked, brick) | (drawn.bounds.uniforms if drawn.bounds else {})
    scales = {"color_scale": drawing.color_scale, "least_transmittance": drawing.least_transmittance}
    if drawing.least_divided is not None:
        scales["least_divided"] = drawing.least_divided
    return scales | drawn.baked.uniforms(drawing.view.slab_thickness)


def cell_uniforms(drawing: Drawing, drawn: DrawnVolume, brick: Brick) -> dict[str, Any]:
    """Position of the cells that are skipped; none where nothing is."""
    if drawn.skips is None:
        return {}
    cells: dict[str, Any] = {"cells_per_box": drawn.cells_per_box}
    return cells | {"first_cell": drawn.first_cell} if drawing.is_cut(brick) else cells


def skip_uniforms(drawing: Drawing, brick: Brick) -> dict[str, Any]:
    """Cells of the box, and in `post` the number of visible slabs that a ray collects before it samples them.

    A ray that ends has collected the slabs behind its end in vain; a ray that goes on waits for its neighbours each
    time it collects again. So it collects a few times as many slabs as would end it if all were as dense as the
    densest.
    """
    drawn = drawing.first
    uniforms = cell_uniforms(drawing, drawn, brick)
    baked = drawn.baked
    if drawing.projection is None and isinstance(baked, ValueTexture) and baked.classification == "post":
        deepest = float(baked.transfer_function.extinctions.max()) * drawing.view.slab_thickness
        ahead = math.inf
        if deepest > 0 and drawing.least_transmittance > 0:
            ahead = -_ENDS_AHEAD * math.log(drawing.least_transmittance) / deepest
        uniforms["slabs_ahead"] = min(max(ahead, _LEAST_AHEAD), _MOST_AHEAD)
    return uniforms


def _lit_uniforms(drawing: Drawing, drawn: DrawnVolume) -> dict[str, Any]:
    """Uniforms of lights and of a depth cue; none where there are neither."""
    view = drawing.view
    uniforms: dict[str, Any] = {}
    if drawn.lighting is not None:
        assert isinstance(drawn.baked, ValueTexture), "texels of other kinds are lit when they are baked"
        uniforms |= light_uniforms(drawn.lighting, drawn.volume, drawn.baked.largest_gradient)
        uniforms |= eye_uniforms(drawn.lighting, view.camera, view.size)
    if drawing.depth_cue is not None:
        uniforms |= cue_uniforms(drawing.depth_cue, drawn.volume, view.camera, view.slab_thickness, view.origin)
    return uniforms


def half_spaces_in_box(cutting: Cutting, volume: Volume) -> list[tuple[float, ...]]:
    """Half spaces (a, b, c, d) that keep a x + b y + c z + d ≥ 0, in box coordinates."""
    normals, distances = cutting.half_spaces(volume)
    in_box = normals @ volume.box_edges
    offsets = -0.5 * in_box.sum(axis=1) - distances
    # Shaders work in single precision and take 1e-30 for 0: a power of two makes it about 1 in a world of any size.
    _, exponents = np.frexp(np.abs(in_box).max(axis=1, initial=0.0))
    return [tuple(each) for each in np.ldexp(np.column_stack([in_box, offsets]).T, -exponents).T.tolist()]


def brick_uniforms(brick: Brick, own_range: NDArray[np.float64]) -> dict[str, Any]:
    """Samples of the box that a brick's texture holds, and the part of the box that is drawn with it."""
    low, high = own_range
    samples, first, per_sample = brick.texture_from_box
    return {
        "brick_low": tuple(low),
        "brick_high": tuple(high),
        "samples_per_box": tuple(samples),
        "first_sample": tuple(first),
        "textures_per_sample": tuple(per_sample),
    }


def light_switches(lighting: Lighting | None) -> dict[str, int]:
    """Switches of light.glsl, and LIT."""
    if lighting is None:
        return {"LIT": 0}
    return {
        "LIT": 1,
        "HEAD_LIGHT": int(bool(lights_of_kind(lighting, "head"))),
        "DIRECTIONAL_LIGHTS": len(lights_of_kind(lighting, "directional")),
        "POINT_LIGHTS": len(lights_of_kind(lighting, "point")),
        "FALL_OFF": int(any(light.fall_off for light in lighting.lights)),
        "SPECULAR": _specular(lighting),
        "TWO_SIDED": int(lighting.two_sided and bool(lighting.lights)),
        "SHADOWS": int(casts_shadows(lighting)),
    }


def light_uniforms(lighting: Lighting, volume: Volume, largest_gradient: float) -> dict[str, Any]:
    """Uniforms of light.glsl; `largest_gradient` is what a gradient of 1 in the shader stands for, per world unit."""
    uniforms: dict[str, Any] = {"ambient": min(lighting.ambient, MOST)}
    if lighting.lights:
        uniforms["diffuse"] = min(lighting.diffuse, MOST)
        uniforms["fade"] = float(np.clip(lighting.fade_for(volume) / largest_gradient, _LEAST, MOST))
    if highlights := _specular(lighting):
        uniforms["specular"] = min(lighting.specular, MOST)
    if highlights == 1:
        uniforms["shininess"] = min(lighting.shininess, MOST)
    if heads := lights_of_kind(lighting, "head"):
        uniforms["head_color"] = _array([np.sum([light.color for light in heads], axis=0)])[0]
    if directional := lights_of_kind(lighting, "directional"):
        uniforms["directions"] = _array([unit(light.vector) for light in directional if light.vector])
        uniforms["direction_colors"] = _array([light.color for light in directional])
    if points := lights_of_kind(lighting, "point"):
        uniforms["positions"] = _array([position_of(light, volume) / volume.radius for light in points])
        uniforms["position_colors"] = _array([light.color for light in points])
        if any(light.fall_off for light in points):
            # A light that does not fall off has half of its strength at a distance that nothing reaches.
            falls = [float(np.clip((light.fall_off or MOST) / volume.radius, _LEAST, MOST)) for light in points]
            uniforms["fall_offs"] = falls
    if points or casts_shadows(lighting):
        to_position, to_box = box_matrices(volume)
        uniforms["world_from_box"] = tuple(to_position.T.reshape(-1))  # column after column
        uniforms["world_corner"] = tuple(to_position @ np.full(3, -0.5))
    if casts_shadows(lighting):
        uniforms["box_from_position"] = tuple(to_box.T.reshape(-1))
        uniforms["shadow_distance"] = shadow_distance(volume) / volume.radius
    return uniforms


def box_matrices(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From fractions of the box to positions in units of its radius, both from its middle, and back; shape (3, 3)."""
    to_position = volume.box_edges / volume.radius
    return to_position, volume.index_from_world * volume.radius / np.array(volume.dimensions)[:, np.newaxis]


def eye_uniforms(lighting: Lighting, camera: Camera, size: tuple[int, int]) -> dict[str, Any]:
    """Uniforms of the direction to the eye for each pixel; none if the light looks the same from everywhere."""
    if not depends_on_eye(lighting):
        return {}
    rays = camera.pixel_rays(size, np.zeros(3))
    uniforms: dict[str, Any] = {"to_eye_middle": tuple(-rays.velocity)}
    if camera.projection == "perspective":
        uniforms["to_eye_per_column"] = tuple(-rays.velocity_per_column)
        uniforms["to_eye_per_row"] = tuple(-rays.velocity_per_row)
    return uniforms


def cue_uniforms(
    cue: DepthCue, volume: Volume, camera: Camera, slab_thickness: float, about: NDArray[np.float64]
) -> dict[str, Any]:
    """A depth cue, with depth in slab thicknesses from the world point `about`."""
    near, far = cue.range_for(volume, camera)
    middle = float(camera.forward @ (about - camera.eye))
    return {
        "cue": _array([(*cue.color, cue.strength)])[0],
        "cue_range": _array([((middle - near) / (far - near), slab_thickness / (far - near))])[0],
    }


def _specular(lighting: Lighting) -> int:
    """Return the switch of highlights: 0 without them, and more than 1 for exponents that few squarings make."""
    if not (lighting.specular > 0 and lighting.lights):
        return 0
    mantissa, exponent = np.frexp(lighting.shininess)  # 2^n is 1/2 times 2^(n + 1)
    return int(exponent) if mantissa == 0.5 and 2 <= exponent <= _MOST_SQUARINGS + 1 else 1


def _array(rows: Iterable[Any]) -> list[tuple[float, ...]]:
    return [tuple(map(float, np.clip(row, -MOST, MOST))) for row in rows]
