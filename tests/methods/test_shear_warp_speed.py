"""Shear-warp is there for its speed: less time than a plain ray caster on bone."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from support.equal_steps import EqualSteps
from support.method_scenes import OBLIQUE, fog, rms, seen_along, truth
from support.real_data import every_other_sample, real_volume
from support.scenes import BONE, smooth_volume

import texvol
from texvol.methods import method_of
from texvol.scene.scene import Scene
from texvol.scene.transfer import preset

SIZE = (256, 256)


def least_seconds(draw: Callable[[], np.ndarray], times: int = 4) -> float:
    """Least time of a few calls, after one that compiles; other load only adds."""
    draw()
    found = []
    for _ in range(times):
        start = time.perf_counter()
        draw()
        found.append(time.perf_counter() - start)
    return min(found)


def ratio(scene: Scene) -> float:
    """Time of a plain ray caster over that of shear-warp, both in threads, nothing of what is prepared counted."""
    complete = scene.completed(SIZE)
    plain, fast = EqualSteps(complete), method_of("shear-warp")(complete)
    return least_seconds(lambda: plain.picture(SIZE)) / least_seconds(lambda: fast.picture(complete.camera, SIZE))


def test_the_plain_ray_caster_is_one() -> None:
    volume = smooth_volume(24)
    scene = Scene(volume, fog(1 / 24), seen_along(volume, OBLIQUE)).completed((32, 24))
    assert rms(EqualSteps(scene).picture((32, 24)) - truth("shear-warp", scene, (32, 24))) < 2e-3


def test_shear_warp_is_faster_on_bone() -> None:
    volume = smooth_volume(96)
    # Measured: 11 here and 31 below on two cores. The rest is left to a loaded machine.
    assert ratio(Scene(volume, BONE, seen_along(volume, OBLIQUE))) > 2


def test_shear_warp_is_faster_on_a_real_ct() -> None:
    volume = every_other_sample(texvol.load(real_volume("lung/3DCT_lung.mha")))
    assert ratio(Scene(volume, preset("ct-bone", volume), seen_along(volume, OBLIQUE))) > 2
