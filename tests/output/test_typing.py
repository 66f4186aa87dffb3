"""A script of a user passes mypy --strict: what may be given is typed as it is documented."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from texvol.util.package import environment_of_child

KNOWN = Path(__file__).parents[2] / ".mypy_cache/user"  # what mypy has found of modules that have not changed since

SCRIPT = """
import numpy as np
import texvol


def main() -> None:
    values = np.zeros((8, 9, 10), np.float32)
    picture = texvol.render(values, 128, tf="viridis", view="front", sampling_rate=2)
    picture.save("a.png")
    print(picture.to_srgb().shape, picture.error, picture.stats["slab_thickness"])
    volume = texvol.Volume(values, (1, 1, 2))
    moved = texvol.Volume(volume.values, volume.spacing, volume.origin + 1, volume.direction)
    camera = texvol.Camera.perspective([9, 99, 9], target=moved.centre, up=np.array([0, 0, 1]))
    ramp = texvol.TransferFunction([0, 4], [[0, 0, 1], [1, 0.5, 0]], [0.1, 2])
    light = texvol.Lighting((texvol.Light("point", moved.centre + 50),))
    cut = [texvol.ClipPlane([1, 0, 0], 2), texvol.ClipPlane(moved.direction[0], 2)]
    part = texvol.Scene(moved, ramp, camera, np.ones(3), lighting=light, clip=cut, crop=[[0, 5], [0, 4.5], [0, 4]])
    part.save("part.toml")
    print(texvol.TransferFunction.preset("ct-bone", volume), texvol.open_array(values, volume.spacing).shape)
    scene = texvol.Scene(volume, "magma", lighting="none", background=[1, 1, 1])
    with texvol.Renderer() as renderer:
        for each in renderer.orbit(scene.replace(background=(1, 1, 1)), 4, (64, 64)):
            each.save("b.png")
        fine = renderer.render(scene, (64, 64), max_error=0.01)
    print(texvol.compare(fine, texvol.raycast(scene, (64, 64))).max_error)
    picture[8:24, :64].save("part.png")
    ramp.save("ramp.vp.json", unit_distance=2)
    print(texvol.measure(scene, [texvol.Measure("ruler", [(0, 0, 0), (10, 0, 0)])]), picture.view("u4").shape)
    print(texvol.Volume.from_xarray(texvol.Volume(values).to_xarray()).spacing[0])
"""


def test_a_script_of_a_user_is_typed(tmp_path: Path) -> None:
    (tmp_path / "user.py").write_text(SCRIPT, encoding="utf-8")
    (tmp_path / "wrong.py").write_text(SCRIPT.replace("picture.error", "picture.mistake"), encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", f"--cache-dir={KNOWN}", "user.py", "wrong.py"]
    env = environment_of_child(PATH=os.environ.get("PATH", ""))
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    said = done.stdout.splitlines()
    assert len(said) == 2, done.stdout + done.stderr
    assert said[0].startswith("wrong.py") and '"mistake"' in said[0]
