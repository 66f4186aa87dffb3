"""Files that need a choice: the first of several time steps, the length of vectors, and the words about it."""

from __future__ import annotations

from pathlib import Path

import nibabel
import numpy as np
import pytest

from texvol.__main__ import main

STEPS = np.stack([np.full((4, 5, 6), step, np.int16) for step in (10, 20, 30)], axis=3)


def test_the_first_time_step_is_taken_and_said(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    nibabel.save(nibabel.Nifti1Image(STEPS + np.arange(6, dtype=np.int16)[:, None], np.eye(4)), tmp_path / "v.nii")
    told = "the first of 3 time steps is taken; --time N takes another"
    assert main(["info", str(tmp_path / "v.nii")]) == 0
    shown, warned = capfd.readouterr()
    assert told in warned and "values      10 to 15" in shown
    for options in ([], ["--time", "0"]):
        line = ["render", str(tmp_path / "v.nii"), "--size", "8", "-o", str(tmp_path / f"{len(options)}.png"), *options]
        assert main(line) == 0
        assert (told in capfd.readouterr().err) == (not options)
    assert (tmp_path / "0.png").read_bytes() == (tmp_path / "2.png").read_bytes()


def test_vectors_are_taken_by_their_length(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    vectors = np.zeros((4, 5, 6, 1, 2), np.float32)
    vectors[..., 0], vectors[..., 1] = 3, 4
    nibabel.save(nibabel.Nifti1Image(vectors, np.eye(4)), tmp_path / "v.nii")
    assert main(["info", str(tmp_path / "v.nii")]) == 0
    shown, warned = capfd.readouterr()
    assert "vectors are shown by their length" in warned and "values      5 to 5" in shown


def test_what_no_choice_mends_is_said_as_if_there_were_none(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    nibabel.save(nibabel.Nifti1Image(STEPS, np.eye(4)), tmp_path / "v.nii")
    (tmp_path / "v.nii").write_bytes((tmp_path / "v.nii").read_bytes()[:-2])
    assert main(["info", str(tmp_path / "v.nii")]) == 2
    warned = capfd.readouterr().err
    assert "the header's dimensions and type need" in warned and "is taken" not in warned
