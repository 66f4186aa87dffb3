"""Lit fields of one gradient, and what light makes of them by the formulas; for the oracle's tests."""

from __future__ import annotations

import numpy as np

from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SLOPE = np.array([0.4, -0.7, 0.5])  # data units per world unit
COLOR, EXTINCTION = np.array([0.9, 0.5, 0.1]), 0.8
GRIDS = {
    "cubes": {},
    "anisotropic": {"spacing": (0.3, 1.0, 0.6)},
    "sheared": {"spacing": (0.3, 0.5, 0.4), "origin": (4, 5, 6), "direction": [[-1, 0.5, 0], [0.1, 1, 0.4], [0, 0, 1]]},
}
AMBIENT, DIFFUSE, SPECULAR = 0.2, 0.6, 0.5


def linear_volume(slope=SLOPE, shape=(5, 6, 7), **position):
    """Value slope · (world position - centre)."""
    grid = Volume(np.zeros(shape), **position)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)[..., ::-1]
    positions = index @ grid.world_from_index.T + grid.origin - grid.centre
    return Volume(positions @ np.asarray(slope, float), **position)


def uniform(extinction=EXTINCTION, color=COLOR, **further):
    return TransferFunction([0], [color], [extinction], **further)


def lights_of(*lights, shininess=20.0, **further):
    return Lighting(lights, AMBIENT, DIFFUSE, SPECULAR, shininess, **further)


def unit(vector):
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def answer(lighting, g, to_eye, w=1.0):
    """(D, S) of a place of gradient g under head and directional lights; two_sided, by the formulas."""
    normal = np.broadcast_to(-unit(np.asarray(g)), to_eye.shape)
    if lighting.two_sided:
        normal = np.where((normal * to_eye).sum(-1, keepdims=True) < 0, -normal, normal)
    diffuse, specular = lighting.ambient, 0.0
    for light in lighting.lights:
        to_light = to_eye if light.kind == "head" else unit(np.array(light.vector))
        cosine = (normal * to_light).sum(-1, keepdims=True)
        halfway = np.maximum((normal * unit(to_light + to_eye)).sum(-1, keepdims=True), 0)
        diffuse = diffuse + lighting.diffuse * np.array(light.color) * (1 - w + w * np.maximum(cosine, 0))
        shine = w * np.where(cosine > 0, halfway**lighting.shininess, 0)
        specular = specular + lighting.specular * np.array(light.color) * shine
    return diffuse, specular


def framed(volume, projection="orthographic"):
    return Camera.framing(volume, projection)


SUN = Light("directional", (0.3, -2.0, 1.5), (1.0, 0.8, 0.6))
BACK = Light("directional", (-0.2, 1.0, -0.4), (0.2, 0.3, 1.0))
LIGHTING = {
    "head": lights_of(Light()),
    "dull": lights_of(Light(), SUN, shininess=1),
    "flat": lights_of(Light(), SUN, shininess=0),
    "sharp": lights_of(SUN, shininess=50),
    "several": lights_of(Light(color=(0.3, 0.2, 0.1)), SUN, BACK),
    "one-sided": lights_of(SUN, BACK, two_sided=False),
    "one-sided head": lights_of(Light(), two_sided=False),
}


def cued(color, extinction, length, t0, t1, cue_color):
    """∫ τ e^(-τ s) (c (1 - t) + t k) ds, t from t0 to t1 linearly: ∫ τ e^(-τ s) s ds = (1 - (1 + x) e^-x) / τ."""
    x = extinction * length
    whole = -np.expm1(-x)
    mean_t = t0 * whole + (t1 - t0) / length * (1 - (1 + x) * np.exp(-x)) / extinction
    return color * (whole - mean_t) + mean_t * cue_color
