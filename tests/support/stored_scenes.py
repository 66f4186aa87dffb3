"""Scenes of every kind that a picture's header has to hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from support.scenes import BONE, FOG, inside, random_volume, smooth_volume
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.gradient import Estimator
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

VOLUME = random_volume(3)
SHEARED = Volume(
    random_volume(4).values, (1.0, 0.8, 1.2), (-3, 5, 7), [[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]], name="sheared"
)
LABELS = Volume(np.rint(4 * random_volume(5).values), origin=(2, 3, 4), labels=True, name="labels")
RGB = Volume(np.ones((3, 4, 5)), (2, 2, 2), colors=random_volume(6, (5 * 3, 4, 3)).values.reshape(3, 4, 5, 3))
GRADED = replace(
    FOG,
    modulation=np.array([(0.0, 0.1), (0.31, 0.9)]),
    graded=(Graded(np.array([0.1, 0.9]), np.array([(0.1, 0.2, 0.3)] * 2), np.array([0.7, 0.1]), 0.01, 0.2),),
    contours=(Contour(0.37, 1.3, (0.2, 0.1, 0.05), 0.3),),
    materials=("fat", "bone"),
)
EMISSIVE = TransferFunction(np.array([0.0, 1.0]), np.array([(0.0, 0.1, 0.3), (2.5, 0.5, 0)]), np.ones(2), emissive=True)
PREMULTIPLIED = TransferFunction(
    np.array([0.1, 0.5, 0.5, 0.9]), np.eye(4)[:, :3], np.array([0.3, 0.2, np.inf, np.inf]), premultiplied=True
)
LIT = Lighting(
    (Light(), Light("directional", (1, -2, 1 / 3), (0.5, 1, 0.7)), Light("point", (9, -4, 3.3))),
    ambient=0.1,
    diffuse=0.6,
    specular=0.3,
    shininess=11.5,
    two_sided=False,
    fade=0.07,
)
SCENES = {
    **{kind: Scene(VOLUME, BONE, classification=kind) for kind in ("slab", "extinction", "post", "integrated")},
    "sheared, from inside": Scene(
        SHEARED, FOG, inside(SHEARED, "perspective"), (0.2, 0.1, 1 / 3), classification="slab"
    ),
    "orthographic": Scene(
        VOLUME, FOG, Camera.orthographic((30, 20, 10), (4, 4, 4), (0, 1, 0.1), 11 / 3), classification="slab"
    ),
    "proposed": Scene(smooth_volume(12), classification="slab"),
    "lit": Scene(VOLUME, FOG, classification="post", lighting=LIT, gradient=Estimator("gaussian", 0.8)),
    "shadows": Scene(
        VOLUME,
        BONE,
        lighting=Lighting(LIT.lights[1:], shadows=True),
        gradient=Estimator("zucker-hummel"),
        classification="slab",
    ),
    "depth cue": Scene(VOLUME, FOG, depth_cue=DepthCue(0.3, (0.1, 0.2, 0.9), 2.5, 20 / 3), classification="slab"),
    "graded": Scene(VOLUME, GRADED, classification="post", lighting=LIT),
    "graded in texels": Scene(VOLUME, GRADED, classification="slab"),
    "emissive": Scene(VOLUME, EMISSIVE, classification="extinction"),
    "premultiplied, opaque": Scene(VOLUME, PREMULTIPLIED, classification="post"),
    **{mode: Scene(SHEARED, mode=mode, classification="slab") for mode in ("xray", "mip", "minip", "average")},
    "isosurfaces": Scene(
        SHEARED,
        mode="isosurface",
        isosurfaces=(Isosurface(0.5, (0.2, 0.3, 1 / 3), 0.25), Isosurface(0.7)),
        lighting=LIT,
    ),
    "attenuation": Scene(VOLUME, mode="xray", air="hounsfield", classification="slab"),
    "above air, coloured": Scene(VOLUME, FOG, mode="xray", air=1 / 3, coloring="tf", classification="slab"),
    "cut": Scene(
        VOLUME,
        BONE,
        clip=(ClipPlane((1, -2, 1 / 3), -7.5),),
        crop=((1, 6.5), (-np.inf, 7.3), (0, np.inf)),
        classification="slab",
    ),
    "capped": Scene(VOLUME, FOG, classification="post", clip=(ClipPlane((0, 1, 1), 4.1),), caps=True),
    "isosurface": Scene(
        VOLUME, FOG, mode="isosurface", isovalue=0.43, lighting=LIT, depth_cue=DepthCue(), classification="slab"
    ),
    "masked": Scene(VOLUME, BONE, classification="post", mask=Mask(VOLUME.values > 0.4)),
    "faded, and volumes of several kinds": Scene(
        VOLUME,
        FOG,
        mask=Mask(1 - VOLUME.values),
        added=(AddedVolume(SHEARED, BONE), AddedVolume(LABELS), AddedVolume(RGB)),
        classification="slab",
    ),
    "isosurface, own colour": Scene(
        VOLUME, mode="isosurface", isovalue=1 / 3, background=(1, 0, 0.5), classification="slab"
    ),
}
