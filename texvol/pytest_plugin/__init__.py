"""pytest plugin: `check_picture` compares a picture with its stored reference, or with the oracle.

    def test_cloud(check_picture):
        check_picture(draw(), "cloud")                   # an array, a file, a texvol.Scene: references/cloud.exr
        check_picture(scene, "fog", oracle=True)         # no stored picture: the oracle is the reference

pytest loads this package in every run, wherever texvol is installed; so it holds only hooks, and imports the rest
when a picture is checked. The other modules:

    names, references, tables      reference and limits of a picture
    pending                        references to be written at the end
    candidates, foreign, repeats   pictures that tests pass
    checking                       one check
    oracle, plain_slabs            bound of a picture without a stored reference
    records, session, report       results of all checks, and the report's folder
    options                        pytest's options, and folders of the run, also for the workers of pytest-xdist
    summary                        exit status, terminal and attachments
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any

import pytest

from texvol.pytest_plugin import options, records
from texvol.pytest_plugin.records import PictureError
from texvol.pytest_plugin.summary import Reporter

__all__ = ["PictureError"]

if TYPE_CHECKING:
    from texvol.pytest_plugin.checking import Check
    from texvol.pytest_plugin.session import PictureSession


def pytest_addoption(parser: pytest.Parser) -> None:
    options.add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    options.check(config)
    if not options.is_worker(config):
        config.pluginmanager.register(Reporter(config), "texvol-reporter")


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Send a worker of pytest-xdist the folders of the run."""
    node.workerinput["texvol"] = options.for_worker(node.config)


def pytest_unconfigure(config: pytest.Config) -> None:
    options.remove_shared_folder(config)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    records.attach(report, item, call)
    return report


@pytest.fixture(scope="session")
def _texvol_session(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[PictureSession]:
    from texvol.pytest_plugin.session import PictureSession

    session = PictureSession(request.config, tmp_path_factory.getbasetemp() / "pictures-of-texvol")
    yield session
    session.maker.close()


@pytest.fixture
def check_picture(request: pytest.FixtureRequest, _texvol_session: PictureSession) -> Check:
    """Compare a picture with its reference: check_picture(picture, "name").

    The picture is an array (height, width[, 1-4 channels]), linear premultiplied floats or sRGB integers; a path of an
    EXR, PNG, TIFF or JPEG; a texvol.Scene, drawn with size=, sampling_rate=, max_error= …; a Figure of matplotlib; an
    Image of Pillow; or a function that returns a picture. oracle=True: the oracle draws the reference, of a scene or
    with scene=. repeat=N separates noise from a systematic difference. driver="…" names the driver that drew an array.
    References are in references/ beside the test's file, limits in limits.toml there; pytest --texvol-update writes
    references that are new or fail.
    """
    from texvol.pytest_plugin.checking import Check

    return Check(request.node, _texvol_session)
