"""ParaView is given the scene that texvol draws; processor seconds are counted of all that a process has started."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).parents[2]
sys.path.insert(0, str(REPOSITORY / "scripts"))

import benchmark_paraview as beside  # noqa: E402
from benchmark_large import Large  # noqa: E402
from processor_time import of_descendants  # noqa: E402

import texvol  # noqa: E402

_BURN = "import sys, time\nwhile time.process_time() < 0.4: pass\nprint(flush=True); sys.stdin.read()"


def _view(folder: Path, samples: int = 16, name: str = "opaque") -> beside.View:
    return beside.View(Large(folder, samples, "1GB", 1), name, folder)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """The size of the benchmark's pictures, which are a 16th of their usual ones."""
    monkeypatch.setattr(beside, "_SIZE", (128, 128))
    return beside._SIZE


def test_processor_seconds_are_of_all_descendants_and_of_nobody_else() -> None:
    by_a_child = f"import subprocess, sys\nsubprocess.run([sys.executable, '-c', {_BURN!r}])"
    before = of_descendants(os.getpid())
    line = [sys.executable, "-c", by_a_child]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        of_all, of_grandchild = of_descendants(os.getpid()) - before, of_descendants(child.pid)
        child.communicate()
    assert of_grandchild >= 0.39  # counted in hundredths of a second
    assert of_all >= of_grandchild
    assert of_descendants(child.pid) == 0.0


def test_opacities_are_those_of_one_sample_and_colours_the_same(tmp_path: Path) -> None:
    view = _view(tmp_path)
    told = json.loads(view.request(tmp_path / "a.png", tmp_path / "a.json", 3).read_text())
    values, colors, opacity = (np.array(each) for each in zip(*told["points"], strict=True))
    emission, extinction = view.function.classify(values)
    np.testing.assert_allclose(np.exp(-extinction), 1 - opacity, atol=1e-12)
    np.testing.assert_allclose(colors * extinction[:, np.newaxis], emission, atol=1e-12)
    assert opacity[0] == 0.0 and opacity.max() > 0.5
    assert Path(told["values"]).read_bytes() == np.load(view.npy).tobytes()


@pytest.mark.usefixtures("small")
def test_the_command_draws_the_scene_of_the_warm_pictures(tmp_path: Path) -> None:
    view, exr = _view(tmp_path), tmp_path / "a.exr"
    subprocess.run(view.line(view.npy, exr, "--sampling-rate", 2), check=True)
    seconds, picture = beside.Texvol("npy").warm(view)
    rms, largest = beside.differences(beside.oiio.ImageBuf(str(exr)).get_pixels()[..., :3], picture)
    assert largest < 1e-6 < picture.max()
    assert rms <= largest
    assert len(seconds) == 3


def test_the_rate_that_is_as_good_is_the_smallest_within_both_errors(tmp_path: Path, small: tuple[int, int]) -> None:
    view = _view(tmp_path, name="translucent")
    exact = texvol.raycast(view.scene(view.npy), small)[..., :3]
    assert beside.as_good(view, exact, (1.0, 1.0)) == beside.Texvol("npy", rate=1 / 16)
    assert beside.as_good(view, exact, (0.0, 1.0)) is None
    rms, largest = beside.differences(beside.Texvol("npy", rate=0.5).warm(view)[1], exact)
    assert beside.as_good(view, exact, (rms * 1.01, largest * 1.01)) == beside.Texvol("npy", rate=0.5)


@pytest.mark.slow
@pytest.mark.skipif(not all(map(shutil.which, ("pvbatch", "mpiexec", "Xvfb"))), reason="ParaView is not installed")
@pytest.mark.parametrize("ranks", [1, 2])
def test_paraview_draws_the_same_picture(tmp_path: Path, ranks: int) -> None:
    view = _view(tmp_path, 48, "translucent")
    exact = texvol.raycast(view.scene(view.npy), (512, 512))[..., :3]
    with beside.display() as where:
        seconds, picture = beside.ParaView(ranks, where).warm(view)
    rms, _ = beside.differences(picture, exact)
    assert exact.max() > 0.3
    assert rms < 2e-3  # rounding to 8 bits is 1e-3; samples taken from the nearest are 2.5e-3, 1 % of height 6e-3
    assert len(seconds) == 3 and all(processor > 0 for _, processor in seconds)
