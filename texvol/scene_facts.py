"""What a picture's header says of its scene, so that it can be drawn again."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from texvol import __version__
from texvol.scene import Scene


def scene_facts(name: str, scene: Scene) -> dict[str, str]:
    """Attributes for the picture's header: what was drawn, so that it can be drawn again."""
    facts: dict[str, Any] = {
        "volume": name,
        "dimensions": scene.volume.dimensions,
        "spacing": scene.volume.spacing.tolist(),
        "classification": scene.classification,
        "background": scene.background,
    }
    if scene.mode != "composite":
        facts |= {"mode": scene.mode} | ({"isovalue": scene.isovalue} if scene.isovalue is not None else {})
    if scene.needs_gradient:
        facts["gradient"] = asdict(scene.gradient)
    facts |= {
        name: asdict(part)
        for name, part in (("lighting", scene.lighting), ("depth_cue", scene.depth_cue), ("camera", scene.camera))
        if part is not None
    }
    if scene.transfer_function is not None:
        facts["transfer_function"] = scene.transfer_function.as_json()
    return {"Software": f"texvol {__version__}", "texvol:scene": json.dumps(facts)}
