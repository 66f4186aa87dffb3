"""Pictures of other libraries in tests, and regions of a test's picture that don't count."""

from __future__ import annotations

import matplotlib.backends.backend_agg  # kept between runs: a second import is half of the first
import matplotlib.figure  # noqa: F401
import numpy as np
import pytest
from PIL import Image
from support.picture_project import Project, said

from texvol.pytest_plugin.foreign import array_of

pytest_plugins = ("pytester", "support.picture_project")
FIGURES = """
from matplotlib.figure import Figure
from PIL import Image

def figure(width=2.0):
    drawn = Figure(figsize=(width, 1.5), dpi=50)
    drawn.add_subplot().plot([0, 1, 0.5], color="tab:red")
    return drawn

def test_figure(check_picture):
    drawn = figure()
    own = drawn.canvas
    check_picture(drawn, "figure")
    assert drawn.canvas is own

def test_pillow(check_picture):
    check_picture(Image.fromarray((255 * waves()[..., :3]).astype(np.uint8)), "pillow")
"""


def test_figures_and_images_are_pictures(project: Project) -> None:
    project.write(test_it=FIGURES)
    assert project.run("--texvol-update").ret == 0
    stored = project.stored("figure")
    assert stored.pixels.shape == (75, 100, 4) and stored.attributes["texvol:renderer"].startswith("matplotlib ")
    assert (stored.pixels[2, 2] == 1).all(), "the figure's white paper"
    reddest = (stored.pixels[..., 0] - stored.pixels[..., 1]).max()
    assert reddest > 0.5, "the curve"
    assert project.run().ret == 0
    project.write(test_it=FIGURES.replace('"tab:red"', '"tab:blue"'))
    assert project.run().ret == 1


def test_a_palette_is_its_colours_and_other_modes_are_not_taken_for_rgb() -> None:
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[:2], pixels[2:] = (255, 0, 0), (0, 0, 255)
    plain = Image.fromarray(pixels)
    indices = plain.convert("P", palette=Image.Palette.ADAPTIVE)
    for each in (plain, indices, plain.convert("RGBX")):
        found = array_of(each)
        assert found is not None and np.array_equal(found[0], pixels)
    indices.info["transparency"] = indices.getpixel((0, 0))
    found = array_of(indices)
    assert found is not None and (found[0][0, 0, 3], found[0][3, 3, 3]) == (0, 255)
    grey = array_of(plain.convert("1"))
    assert grey is not None and grey[0].dtype == np.uint8 and grey[0].ndim == 2
    for mode in ("CMYK", "YCbCr", "HSV", "LAB", "I"):
        with pytest.raises(ValueError, match=f"got mode {mode}"):
            array_of(Image.new(mode, (4, 4)))
    assert array_of(pixels) is None


def test_regions_of_the_file_of_limits_do_not_count(project: Project) -> None:
    from support.picture_project import waves

    project.store(waves())
    project.check("waves() + np.float32(0.2) * (np.mgrid[:24, :32][1] < 5)[..., None] * [1, 1, 1, 0]")
    assert project.run().ret == 1
    project.limits('["waves"]\nignore = [{rectangle = [0, 0, 5, 24], reason = "the date of the run"}]\n')
    assert project.run("--texvol-report", "report").ret == 0
    for page in ("index.html", "pages/waves.html"):
        assert "the date of the run" in (project.folder / "report" / page).read_text("utf-8")
    project.limits('["waves"]\nignore = [{rectangle = [0, 0, 4, 24], reason = "the date of the run"}]\n')
    result = project.run()
    assert result.ret == 1 and "4 × 24 pixels at column 0, row 0 (12.5% of the picture): the date" in said(result)
    project.limits('["waves"]\nignore = [{rectangle = [0, 0, 32, 24], reason = "the date of the run"}]\n')
    assert "must leave pixels to compare" in said(project.run())
    project.limits('["waves"]\nignore = {rectangle = [0, 0, 4, 24], reason = "the date of the run"}\n')
    assert project.run().ret == 1
