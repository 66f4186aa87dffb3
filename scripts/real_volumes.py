"""Render the real volumes of a data folder, hold each picture against the oracle, and print a table in Markdown.

    python scripts/real_volumes.py DATA -o FOLDER [NAME ...]

DATA is a folder with the volumes listed below, each in a folder of its name; what is missing is left out. A volume's
seconds are those of the whole command `texvol render`, start to finish.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from texvol.comparison import compare
from texvol.formats.pictures import image

# Folder, file, how to read it, and the scene.
VOLUMES: list[tuple[str, str, str, str]] = [
    ("male", "male.raw.bz2", "--shape 128,256,256 --dtype uint8 --spacing 1.5777,0.99586,1.008",
     "--tf ct-bone --eye 260,-430,180 --up 0,0,-1"),
    ("engine", "engine.nii.gz", "", "--eye 700,-500,420"),
    ("lung", "3DCT_lung.mha", "", "--tf ct-bone"),
    ("phantom", "", "", "--tf ct-bone"),
    ("brain", "mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz", "", "--tf mr"),
    ("flair", "FLAIR.nrrd", "", "--tf mr"),
    ("orientation", "", "", "--eye 0,-20,400 --target 0,-20,0 --up 0,1,0"),
    ("tooth", "", "", ""),
    ("fly", "fly_150x256x256.tif", "", "--eye 500,-300,420"),
    ("shell", "", "", ""),
    ("hydrogen", "hydrogen.vti", "", "--tf inferno"),
    ("frog", "frog_tissues.vti", "", "--eye 250,235,900 --up 0,1,0"),
    ("nucleus", "dna_conf_wf.ome.tif", "--channel 0 --spacing 0.512,0.512,0.499", "--tf magma --eye 34,33,150"),
    ("protein", "", "", "--tf viridis"),
]  # fmt: skip
SUFFIXES = (".nrrd", ".nhdr", ".nii.gz", ".mha", ".mrc", ".map", ".tif", ".vti")


def volume_path(data: Path, folder: str, file: str) -> Path | None:
    """The volume's file, the only one in its folder, or the folder itself if it is a DICOM series."""
    path = data / folder / file
    if file or not path.is_dir():
        return path if path.exists() else None
    return next((each for each in sorted(path.iterdir()) if each.name.endswith(SUFFIXES)), path)


def timed(*line: str) -> float:
    """Seconds of one `texvol` command."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "texvol", *line], check=True)
    return time.perf_counter() - start


def row(data: Path, output: Path, name: str, file: str, reading: str, scene: str) -> str | None:
    """One line of the table, and the pictures that it speaks of."""
    path = volume_path(data, name, file)
    if path is None:
        return None
    picture, truth = output / f"{name}.exr", output / f"{name}-oracle.exr"
    options = [str(path), *reading.split(), *scene.split()]
    seconds = timed("render", *options, "-o", str(output / f"{name}.png"))
    timed("render", *options, "-o", str(picture))
    timed("raycast", *options, "-o", str(truth))
    difference = compare(image.read(picture), image.read(truth))
    shown = f"{name}/{path.name}" if path.name != name else f"{name}/"
    preset = scene.split()[1] if scene.startswith("--tf") else "(proposed)"
    return f"| `{shown}` | {preset} | {seconds:.1f} | {difference.rms_error:.1e} | {difference.max_error:.1e} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("names", nargs="*", metavar="NAME")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    print("| file | preset | seconds | rms error | maximum error |\n|---|---|---|---|---|")
    for volume in VOLUMES:
        if not arguments.names or volume[0] in arguments.names:
            line = row(arguments.data, arguments.output, *volume)
            if line:
                print(line, flush=True)


if __name__ == "__main__":
    main()
