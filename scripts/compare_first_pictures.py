"""First pictures of real volumes by texvol, PyVista, F3D and VTK, side by side; and how long each takes.

    sh scripts/setup.sh "" side-by-side
    python scripts/compare_first_pictures.py DATA -o FOLDER [--page] [--only NAME,NAME]

DATA is the folder of the real volumes (`real_volumes.py` lists them), or any folder or file with volumes. Each program
is told the file and no more, see `first_picture_programs.py`. Seconds are the processor's for a whole process, start to
finish, which hardly depend on what else runs; texvol reads the file itself, the others a VTK image of it, whose making
does not count. `--page` stores the sheets for the page of documentation. The table is printed.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from real_volumes import VOLUMES, volume_path

from texvol.options.scene_options import SceneOptions
from texvol.scene.kinds import kind_of
from texvol.scene.volume import Volume

REPOSITORY = Path(__file__).resolve().parents[1]
PICTURES = REPOSITORY / "texvol" / "docs" / "pictures"
BESIDE = REPOSITORY / ".venv-side" / "bin" / "python"
PROGRAMS = REPOSITORY / "scripts" / "first_picture_programs.py"
NAMES = {"texvol": "texvol", "pyvista": "PyVista", "f3d": "F3D", "vtk": "VTK, shaded"}
SIZE = 512
_SMALL, _CAPTION, _QUALITY = 192, 18, 80  # of a sheet of the page
_BURNT = 255  # in all three channels of 8 bits


def volumes_of(data: Path, names: Sequence[str]) -> dict[str, list[str]]:
    """Return the words after `texvol render` for each volume: a real one, or each file of a folder."""
    if data.is_file():
        return {data.name.split(".")[0]: [str(data)]}
    known = {name: (volume_path(data, name, file), reading.split()) for name, file, reading, _ in VOLUMES}
    found = {name: [str(path), *reading] for name, (path, reading) in known.items() if path is not None}
    if not found:
        found = {path.name.split(".")[0]: [str(path)] for path in sorted(data.iterdir())}
    return {name: words for name, words in found.items() if not names or name in names}


def options_of(words: Sequence[str]) -> SceneOptions:
    """Return the scene options of a line of `texvol render` with these words."""
    parser = argparse.ArgumentParser(argument_default=argparse.SUPPRESS)
    parser.add_argument("volume")
    for name in ("--shape", "--dtype", "--spacing", "--channel"):
        parser.add_argument(name)
    told = vars(parser.parse_args(list(words)))
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as scene:
        scene.write("".join(f"{name} = {json.dumps(value)}\n" for name, value in told.items()))
        scene.flush()
        return SceneOptions.of(scene=scene.name)


def write_image(volume: Volume, target: Path) -> None:
    """Write a VTK image of a volume for the other programs."""
    values, grid = target.with_suffix(".npy"), target.with_suffix(".json")
    np.save(values, np.ascontiguousarray(volume.values).astype(volume.values.dtype.newbyteorder("=")))
    direction = volume.direction / np.linalg.norm(volume.direction, axis=0)
    told = {"spacing": volume.spacing.tolist(), "origin": volume.origin.tolist(), "direction": direction.tolist()}
    grid.write_text(json.dumps(told), encoding="utf-8")
    subprocess.run([BESIDE, PROGRAMS, "prepare", values, grid, target], check=True)


def drawn(program: str, words: Sequence[str], image: Path, kind: str, picture: Path) -> tuple[float, str]:
    """Draw with a program; return the processor's seconds for its process, and the last line that it said."""
    line: list[str | Path] = [BESIDE, PROGRAMS, program, image, picture, str(SIZE), kind]
    if program == "texvol":
        line = [sys.executable, "-m", "texvol", "render", *words, "--size", str(SIZE), "-o", picture]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(line, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode:
        print(f"{program}: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
    return seconds, (done.stdout + done.stderr).strip().rpartition("\n")[2]


def burnt(picture: Path) -> float:
    """Return the fraction of the pixels of a picture that are white in all channels, of those that are not black."""
    pixels = np.asarray(Image.open(picture).convert("RGB"))
    return float((pixels.min(axis=2) >= _BURNT).sum() / max(int((pixels.max(axis=2) > 0).sum()), 1))


def sheet(pictures: dict[str, Path]) -> Image.Image:
    """Lay the pictures of one volume out in a row, with the programs' names above."""
    whole = Image.new("RGB", (len(pictures) * _SMALL, _SMALL + _CAPTION), (255, 255, 255))
    writer = ImageDraw.Draw(whole)
    for number, (program, path) in enumerate(pictures.items()):
        left = number * _SMALL
        writer.text((left + 3, 2), NAMES[program], (0, 0, 0), ImageFont.load_default(12))
        if path.exists():
            small = Image.open(path).convert("RGB").resize((_SMALL - 2, _SMALL - 2), Image.Resampling.LANCZOS)
            whole.paste(small, (left + 1, _CAPTION))
    return whole


def compare(name: str, words: Sequence[str], folder: Path) -> tuple[Image.Image, str]:
    """Draw a volume with all programs; return its sheet, and its line of the table."""
    volume = options_of(words).load()
    kind, image = kind_of(volume).name, folder / f"{name}.vti"
    write_image(volume, image)
    pictures = {program: folder / f"{name}-{program}.png" for program in NAMES}
    seconds, said = {}, ""
    for program, picture in pictures.items():
        seconds[program], last = drawn(program, words, image, kind, picture)
        said = last if program == "texvol" else said
    times = " | ".join(f"{seconds[program]:.1f}" for program in NAMES)
    error = said.partition("estimated error ")[2].partition(",")[0].partition(" ")[0] or "not estimated"
    line = f"| {name} | {kind} | {error} | {100 * burnt(pictures['texvol']):.1f} | {times} |"
    return sheet(pictures), line


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--page", action="store_true", help="store the sheets for the page of documentation")
    parser.add_argument("--only", type=lambda text: text.split(","), default=[], metavar="NAME,NAME")
    arguments = parser.parse_args()
    if not BESIDE.exists():
        print("other programs are not installed: run sh scripts/setup.sh '' side-by-side", file=sys.stderr)
        return 2
    found = volumes_of(arguments.data, arguments.only) if arguments.data.exists() else {}
    if not found:
        print(f"DATA must be a file or a folder with volumes, got {arguments.data}", file=sys.stderr)
        return 2
    arguments.output.mkdir(parents=True, exist_ok=True)
    print("| file | kind | estimated error | white, % | texvol, s | PyVista, s | F3D, s | VTK, s |", flush=True)
    print("|---|---|---|---|---|---|---|---|")
    for name, words in found.items():
        row, line = compare(name, words, arguments.output)
        row.save(arguments.output / f"{name}.png")
        if arguments.page:
            row.save(PICTURES / f"first-{name}.jpg", quality=_QUALITY, optimize=True)
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
