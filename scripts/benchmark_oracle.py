"""Time `texvol render --check all` of lit scenes, whole commands; prints a table in Markdown.

    python scripts/benchmark_oracle.py DATA [WORD ...]

DATA holds the folders `male`, `lung` and `fly`, of which those that are missing are left out; words choose the scenes
whose names hold one of them. The table has seconds of the processor beside those of the clock, which are right only
where nothing else runs. The oracle's kernels should have been compiled before (`compile_oracle.py`).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from benchmark_timing import columns, row, texvol_line, usage
from scipy.ndimage import gaussian_filter

MALE = "--shape 128,256,256 --dtype uint8 --spacing 1.5777,0.99586,1.008 --view front"
# Name, path within the data and its options; no path for volumes that are made here.
VOLUMES = {
    "male": ("male/male.raw.bz2", MALE),
    "lung": ("lung/3DCT_lung.mha", "--view front"),
    "fly": ("fly/fly_150x256x256.tif", "--eye 500,-300,420"),
    "clouds": ("", "--view iso"),
    "labels": ("", "--view iso --labels"),
}
LIT = "--light head --specular 0.3 --two-sided"
THREE = "--light head --light 1,2,3 --light=-3,1,1 --specular 0.3 --two-sided"
SCENES = {
    **{f"male, {tf}, {kind}": ("male", f"--tf {tf} --classification {kind} {LIT}")
       for tf in ("ct-bone", "ct-soft-tissue", "fog") for kind in ("slab", "post", "integrated")},
    "male, first look": ("male", ""),
    "male, fog, post, three lights": ("male", f"--tf fog --classification post {THREE}"),
    "male, boundaries": ("male", f"--tf boundaries {LIT}"),
    "lung, ct-soft-tissue, post": ("lung", f"--tf ct-soft-tissue --classification post {LIT}"),
    "fly, fog, post": ("fly", f"--tf fog --classification post {LIT}"),
    "clouds, fog, extinction": ("clouds", f"--tf fog --classification extinction {LIT}"),
    "clouds, fog, post": ("clouds", f"--tf fog --classification post {LIT}"),
    "clouds, fog, post, three lights": ("clouds", f"--tf fog --classification post {THREE}"),
    "clouds, fog, post, unlit": ("clouds", "--tf fog --classification post --light none"),
    "labels": ("labels", LIT),
}  # fmt: skip


def made(folder: Path) -> dict[str, Path]:
    """Write the volumes that are made, 256³, and return their files: smooth noise as of a CT, and labels of it."""
    noise = gaussian_filter(np.random.default_rng(3).standard_normal((256,) * 3).astype(np.float32), 3)
    fraction = (noise - noise.min()) / np.ptp(noise)
    volumes = {"clouds": (2500 * fraction - 1000).astype(np.int16), "labels": (12 * fraction).astype(np.uint8)}
    for name, values in volumes.items():
        np.save(folder / name, values)
    return {name: folder / f"{name}.npy" for name in volumes}


def main(data: Path, words: list[str]) -> None:
    """Print the table."""
    columns("scene", "processor seconds", "seconds")
    with tempfile.TemporaryDirectory() as name:
        own = made(Path(name))
        for scene, (volume, options) in SCENES.items():
            within, reading = VOLUMES[volume]
            path = data / within if within else own[volume]
            if not path.exists() or (words and not any(word in scene for word in words)):
                continue
            line = f"{path} {reading} {options} --size 512x512 --check all -o {name}/picture.png"
            used = usage(texvol_line("render", *line.split()))
            row(scene, f"{used.processor_seconds:.1f}", f"{used.seconds:.1f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("words", nargs="*", metavar="WORD")
    arguments = parser.parse_args()
    main(arguments.data, arguments.words)
