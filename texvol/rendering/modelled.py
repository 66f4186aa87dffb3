"""Names of what the renderer models beyond absorption and emission along parallel rays."""

from __future__ import annotations

from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.shapes import Mesh


def modelled(scene: CompleteScene) -> list[str]:
    """Return the names for `--stats`; a feature that is not among them has cost nothing."""
    names = {
        "perspective": scene.camera.projection == "perspective",
        "background": any(scene.background) and scene.mode in ("composite", "isosurface"),
        scene.mode: scene.mode != "composite",
        "air": scene.air is not None,
        "clip planes": bool(scene.clip),
        "crop box": scene.crop is not None,
        "caps": scene.cutting.caps,
        "depth picture": scene.depth is not None,
        "mask": scene.mask is not None or any(each.mask is not None for each in scene.added),
        "several volumes": bool(scene.added),
        "labels": any(volume.labels for volume in scene.volumes),
        "blocks": any(volume.blocks for volume in scene.volumes),
        "colours": any(volume.colors is not None for volume in scene.volumes),
    }
    if scene.geometry:
        names |= _geometry(scene)
    each_alone = scene.each_alone()
    if any(each.needs_gradient for each in each_alone):
        names[f"{scene.gradient.kind} gradient"] = True
    if scene.mode == "composite":
        for each in each_alone:
            names |= {name: True for name, is_modelled in _medium(each).items() if is_modelled}
    if scene.mode in ("composite", "isosurface"):
        names |= _light(scene)
    return [name for name, is_modelled in names.items() if is_modelled]


def _medium(scene: CompleteScene) -> dict[str, bool]:
    medium = scene.medium
    return {
        "emissive": medium.emissive,
        "gradient modulation": medium.modulation is not None,
        "graded materials": bool(medium.graded),
        "contours": bool(medium.contours),
    }


def _geometry(scene: Scene) -> dict[str, bool]:
    meshes = [shape for shape in scene.geometry if isinstance(shape, Mesh)]
    return {
        "geometry": bool(meshes),
        "lines": len(meshes) < len(scene.geometry),
        "translucent geometry": any(shape.opacity < 1 for shape in scene.geometry),
        "head light on geometry": scene.lighting is None and any(mesh.lit for mesh in meshes),
    }


def _light(scene: Scene) -> dict[str, bool]:
    lighting = scene.lighting
    names = {"depth cue": scene.depth_cue is not None}
    if lighting is None:
        return names | {"head light": scene.mode == "isosurface"}
    kinds = [light.kind for light in lighting.lights]
    return {
        "ambient light": not kinds,
        "head light": "head" in kinds,
        "directional lights": "directional" in kinds,
        "point lights": "point" in kinds,
        "highlights": lighting.specular > 0 and bool(kinds),
        "shadows": lighting.shadows,
    } | names
