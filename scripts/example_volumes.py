"""Writes the volumes that the documentation's examples use, all of them computed: a chest, a brain, a cell, weather.

    python scripts/example_volumes.py -o FOLDER [--spacing MM]

`--spacing` is that of the chest's samples: 2 mm unless told. The tests ask for 12 mm, so that the examples run quickly.

    chest.nrrd, chest.raw   CT in Hounsfield units, with contrast agent     pet.nrrd     uptake of a tracer, coarser
    organs.nrrd             labels of the chest's organs                    lungs.nrrd   mask, 1 in the lungs
    beating.nii.gz          eight steps of a heart beat                     brain.nrrd   T1-weighted MR, skull removed
    cell.tif                two channels of a cell                          weather.nc   temperature on pressure levels
    knot.npy, cloud.npy, gyroid.npy                                         closed forms
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import example_chest as anatomy
import numpy as np
from gallery_volumes import cloud, gyroid, random_field, trefoil
from numpy.typing import NDArray

SPACING = 2.0
RAW_SPACING = 8.0  # of chest.raw, whatever the spacing of the others, since a command states its dimensions
STEPS = 8  # of the heart beat


def write_nrrd(path: Path, values: NDArray[Any], spacing: float, unit: str = "") -> None:
    """Write values[z, y, x] about the origin."""
    import nrrd

    header: dict[str, Any] = {
        "space": "left-posterior-superior",
        "space directions": np.eye(3) * spacing,
        "space origin": [(1 - count) * spacing / 2 for count in values.shape[::-1]],
        "space units": ["mm"] * 3,
        "encoding": "gzip",
    }
    if unit:
        header["sample units"] = unit
    nrrd.write(str(path), values.transpose(2, 1, 0), header)


def write_chest(folder: Path, spacing: float) -> None:
    """Write the files of the chest."""
    values = anatomy.chest(spacing).astype(np.int16)
    write_nrrd(folder / "chest.nrrd", values, spacing, "HU")
    anatomy.chest(RAW_SPACING).astype(np.int16).tofile(folder / "chest.raw")
    write_nrrd(folder / "pet.nrrd", anatomy.pet(2 * spacing), 2 * spacing)
    labels = anatomy.organs(spacing)
    write_nrrd(folder / "organs.nrrd", labels, spacing)
    lungs = np.isin(labels, [anatomy.LABELS["left lung"], anatomy.LABELS["right lung"]])
    write_nrrd(folder / "lungs.nrrd", lungs.astype(np.uint8), spacing)


def write_beating(folder: Path, spacing: float) -> None:
    """Write a chest whose heart beats once, in steps of a tenth of a second."""
    import nibabel

    beats = (1 - np.cos(2 * np.pi * np.arange(STEPS) / STEPS)) / 2
    steps = np.stack([anatomy.chest(spacing, float(beat)) for beat in beats]).astype(np.int16)
    affine = np.diag([-spacing, -spacing, spacing, 1.0])  # NIfTI's axes point to the right, to the front and up
    affine[:3, 3] = -affine.diagonal()[:3] * (np.array(steps.shape[:0:-1]) - 1) / 2
    image = nibabel.Nifti1Image(steps.transpose(3, 2, 1, 0), affine)
    image.header.set_xyzt_units("mm", "sec")
    image.header["pixdim"][4] = 0.1
    nibabel.save(image, folder / "beating.nii.gz")


def brain(samples: int) -> NDArray[np.uint8]:
    """A T1-weighted brain: white matter bright, a folded cortex, dark fluid in the furrows."""
    axis = ((np.arange(samples) + 0.5) / samples * 2 - 1).astype(np.float32)
    x, y, z = axis, axis[:, None], axis[:, None, None]
    below = np.where(z < -0.1, 1.0 + 0.9 * (z + 0.1) ** 2, 1.0)
    halves = np.sqrt(((np.abs(x) - 0.03) / 0.70) ** 2 + (y / 0.92) ** 2 + (z / 0.72 * below) ** 2)
    depth = (halves - 1) * 0.7
    field = random_field((samples,) * 3, 1664, 9.0) - random_field((samples,) * 3, 1664, 3.5)
    furrows = 0.17 * np.exp(-((field / field.std() / 0.22) ** 2)) * np.clip(1 + depth / 0.35, 0, 1)
    fissure = 0.5 * np.exp(-((x / 0.022) ** 2)) * (z > -0.15)
    folded = depth + furrows + fissure
    soft = 1.5 / samples
    values = np.zeros((samples,) * 3, np.float32)
    for edge, value in ((0.05, 35.0), (0.0, 125.0), (-0.065, 205.0)):
        inside = np.clip(0.5 - ((depth if value < 50 else folded) - edge) / (2 * soft), 0, 1)
        values += inside * (value - values)
    return anatomy.blurred(values).astype(np.uint8)


def cell(samples: int) -> NDArray[np.uint16]:
    """Two channels (z, channel, y, x) of a cell: a mottled nucleus, and filaments about it."""
    x, y, z = (np.linspace(-1, 1, count, dtype=np.float32) for count in (samples, samples, samples // 2))
    y, z = y[:, None], z[:, None, None]
    shape = (samples // 2, samples, samples)
    mottled = np.exp(0.5 * random_field(shape, 1839, 12.0))
    ball = np.sqrt((x / 0.36) ** 2 + ((y + 0.05) / 0.30) ** 2 + (z / 0.5) ** 2)
    nucleus = np.clip(12 * (1 - ball), 0, 1) * mottled
    random = np.random.RandomState(1957)
    filaments = np.zeros(shape, np.float32)
    unit = anatomy.Grid(x, y, z * 0.5, 2 / samples)
    for _ in range(70):
        angle, length = random.uniform(0, 2 * np.pi), random.uniform(0.55, 0.95)
        start = (0.30 * np.cos(angle), 0.26 * np.sin(angle), random.uniform(-0.2, 0.2))
        turned = angle + random.normal() * 0.5
        end = (length * np.cos(turned), length * np.sin(turned), start[2] + random.normal() * 0.12)
        filaments = np.maximum(filaments, unit.inside(unit.capsule(start, end, 0.008)))
    return np.stack([np.clip(each * 9000, 0, 60000) for each in (nucleus, filaments)], axis=1).astype(np.uint16)


def write_cell(folder: Path, samples: int) -> None:
    """Write the cell as ImageJ does."""
    import tifffile

    metadata = {"axes": "ZCYX", "unit": "um", "spacing": 0.5}
    path = folder / "cell.tif"
    tifffile.imwrite(path, cell(samples), imagej=True, resolution=(samples / 32, samples / 32), metadata=metadata)


def write_weather(folder: Path, samples: int) -> None:
    """Write temperature on pressure levels, of which the lowest is missing over mountains."""
    import netCDF4

    longitude, latitude = np.linspace(0, 360, samples, endpoint=False), np.linspace(-88, 88, samples // 2)
    height = np.array([0.1, 0.8, 1.5, 3, 5.6, 9, 12, 16])
    waves = 6 * np.sin(np.radians(3 * longitude)) * np.cos(np.radians(latitude))[:, None]
    surface = 25 - 45 * np.abs(latitude / 90)[:, None] ** 1.5 + waves
    values = surface - np.minimum(6.5 * height, 70)[:, None, None]
    values[0, np.abs(np.sin(np.radians(longitude)) + latitude[:, None] / 60) < 0.1] = -9999
    with netCDF4.Dataset(folder / "weather.nc", "w") as file:
        for name, axis, unit in (
            ("height", height, "km"), ("latitude", latitude, "degrees_north"), ("longitude", longitude, "degrees_east")
        ):  # fmt: skip
            file.createDimension(name, len(axis))
            variable = file.createVariable(name, "f4", (name,))
            variable[:], variable.units = axis, unit
        temperature = file.createVariable("temperature", "f4", ("height", "latitude", "longitude"), fill_value=-9999)
        temperature[:], temperature.units = values, "degC"


def write_volumes(folder: Path, spacing: float) -> None:
    """Write all of them."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = max(round(256 / spacing), 16)
    write_chest(folder, spacing)
    write_beating(folder, 2 * spacing)
    write_nrrd(folder / "brain.nrrd", brain(samples), 180 / samples)
    write_cell(folder, samples)
    write_weather(folder, samples)
    for form in (trefoil, cloud, gyroid):
        name = "knot" if form is trefoil else form.__name__
        np.save(folder / f"{name}.npy", form(samples).astype(np.float32))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--spacing", type=float, metavar="MM", default=SPACING)
    arguments = parser.parse_args()
    write_volumes(arguments.output, arguments.spacing)
    return 0


if __name__ == "__main__":
    sys.exit(main())
