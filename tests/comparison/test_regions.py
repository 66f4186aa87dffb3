"""Regions that don't count: nothing in them is a difference, all measures are those of the other pixels."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from support.compared_pictures import smooth

from texvol.cli.command_line import main
from texvol.comparison.limits import ONE_DRIVER
from texvol.comparison.outcome import Outcome, examine
from texvol.comparison.page import comparison_page
from texvol.comparison.pictures import Picture
from texvol.comparison.regions import Region
from texvol.formats.pictures import image
from texvol.util.errors import InputError

REASON = "the date of the run"
TABLE = {"rectangle": [8, 4, 20, 10], "reason": REASON}


def region(**changed: object) -> Region:
    return Region.of(TABLE | changed, Path(), "ignore")


def compared(candidate: np.ndarray, reference: np.ndarray, *regions: Region) -> Outcome:
    return examine(Picture.of_array(candidate), Picture.of_array(reference), ONE_DRIVER, regions=regions)


@pytest.mark.parametrize("wrong", [0.5, np.nan, np.inf])
def test_nothing_in_a_region_is_a_difference_and_all_beside_it_is(wrong: float) -> None:
    reference = smooth((60, 40))
    candidate = reference.copy()
    candidate[4:14, 8:28] = wrong
    found = compared(candidate, reference, region())
    assert found.status == "same" and found.is_equal and found.measures is not None
    assert found.measures.pixels == 40 * 60 - 200
    (note,) = found.notes
    assert REASON in note and "20 × 10 pixels at column 8, row 4" in note and "8.33%" in note
    assert REASON in comparison_page(found)
    for column, row in ((7, 4), (8, 3), (28, 13), (27, 14)):
        beside = candidate.copy()
        beside[row, column, :3] = reference[row, column, :3] + 0.1
        assert compared(beside, reference, region()).status == "different"
    assert compared(candidate, reference).status != "same"


def test_means_are_those_of_the_pixels_that_count() -> None:
    # With a half of the picture left out, the measures are those of the other half alone. The difference is so far
    # from the border that no neighbourhood of a measure crosses it.
    reference = smooth((60, 40))
    candidate = reference.copy()
    candidate[:, :10, :3] += np.float32(0.01)
    half = compared(candidate, reference, region(rectangle=[30, 0, 30, 40])).measures
    alone = compared(candidate[:, :30], reference[:, :30]).measures
    assert half is not None and alone is not None
    for name in ("max_error", "rms_error", "mean_error", "percentile_99"):
        numbers = [asdict(each)["parts"]["all"][name] for each in (half, alone)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-6)
    assert half.percent_over == alone.percent_over == pytest.approx(100 / 3)
    for name in ("ssim", "flip", "flip_weighted_median", "beyond_flip", "beyond_rms"):
        assert getattr(half, name) == pytest.approx(getattr(alone, name), rel=1e-5)


def test_a_mask_is_what_is_not_black(tmp_path: Path) -> None:
    reference = smooth((60, 40))
    candidate = reference.copy()
    candidate[10:20, 5:9] = 1
    mask = np.zeros((40, 60, 3), np.uint8)
    mask[10:20, 5:9, 1] = 1
    path = tmp_path / "mask.tif"
    import tifffile

    tifffile.imwrite(path, mask, photometric="rgb")
    found = compared(candidate, reference, Region.of({"mask": path.name, "reason": REASON}, tmp_path, "ignore"))
    assert found.is_equal and "mask mask.tif" in found.notes[0]
    with pytest.raises(InputError, match="size, 30 × 40 pixels, got 60 × 40"):
        compared(candidate[:, :30], reference[:, :30], Region(REASON, mask=path))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"rectangle": [0, 0, 60, 40]}, "must leave pixels to compare"),
        ({"rectangle": [50, 0, 11, 4]}, "must be in the picture of 60 × 40 pixels, got 11 × 4 pixels at column 50"),
        ({"rectangle": [0, 0, 0, 4]}, "rectangle must be"),
        ({"rectangle": [0, 0, True, 4]}, "rectangle must be"),
        ({"rectangle": [-1, 0, 1, 4]}, "rectangle must be"),
        ({"rectangle": "8,4,20,10"}, "rectangle must be"),
        ({"reason": "flaky"}, "at least 3 words"),
        ({"reason": None}, "at least 3 words"),
        ({"mask": "m.png"}, "a rectangle or a mask"),
        ({"radius": 3}, "a rectangle or a mask"),
    ],
)
def test_what_is_no_region_is_refused(table: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        compared(smooth((60, 40)), smooth((60, 40)), region(**table))


def test_the_command_takes_regions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reference = smooth((60, 40))
    candidate = reference.copy()
    candidate[4:14, 8:28] = 0
    paths = [str(tmp_path / name) for name in ("a.exr", "b.exr")]
    for path, pixels in zip(paths, (candidate, reference), strict=True):
        image.write(path, pixels)
    assert main(["diff", *paths]) == 1
    assert main(["diff", *paths, "--ignore", f"8,4,20,10:{REASON}"]) == 0
    assert REASON in capsys.readouterr().out
    for text in ("8,4,20:the date of the run", "8,4,20,10", "8,4,20,10:date", "none.png:the date of the run"):
        assert main(["diff", *paths, "--ignore", text]) == 2
        assert capsys.readouterr().err.count("\n") == 1
