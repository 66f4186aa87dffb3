"""One OpenGL context and one Renderer for all tests, cleaned and checked for errors around each; and each back end."""

from __future__ import annotations

import ctypes
import gc
import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING
from unittest.mock import patch

import pytest
from hypothesis import settings
from support.browser import browser  # noqa: F401 (a fixture)
from support.small_pictures import BACKENDS, backend_or_skip
from support.viewer import open_page  # noqa: F401 (a fixture)

from texvol.opengl.contexts import Context, open_context
from texvol.rendering.renderer import Renderer

if TYPE_CHECKING:
    from texvol.distributed.workers import Workers

# A shell that runs the tests in the background has them ignore ctrl-C, and what they start would inherit that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Most of the time of the tests would be llvmpipe's, optimising shaders that draw a few hundred pixels: without, they
# take a third less. The pictures are the same, see opengl/test_driver_optimisation.py; other drivers do not look at it.
os.environ.setdefault("GALLIVM_PERF", "nopt")

# An example that takes longer than 0.2 seconds is a busy machine.
settings.register_profile("tests", settings.default, deadline=None)
settings.load_profile("tests")

gc.disable()  # until all tests are collected, which leaves little garbage and a million objects to look at


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put tests first whose readers fork this process: that takes longer the more memory others have filled."""
    items.sort(key=lambda item: item.path.parts[-2:-1] != ("formats",) and item.path.name != "test_fuzz.py")


def pytest_collection_finish() -> None:
    """Take what the collected modules hold out of the garbage collector's sight.

    It is some 400,000 objects, of which every `gc.collect()` of a test would look at each: 0.15 to 0.3 seconds.
    """
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_unconfigure() -> None:
    """Free all objects at the end: libraries report as leaked what is left."""
    gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def state_of_tests(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Recent files and sizes of windows are the tests' own, in this process and in those that it starts."""
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))


@pytest.fixture(scope="session")
def session_context() -> Iterator[Context]:
    """The one context of the session; tests ask for `context`."""
    opened = open_context()
    opened.gl.gc_mode = "context_gc"  # what a test drops is queued, and freed after it, while the context is current
    yield opened
    opened.release()


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """Two workers that the tests of a module share; processes that wait for all further tests would take their time."""
    from texvol.distributed.workers import Workers

    with Workers(2) as started:
        yield started


@pytest.fixture
def context(session_context: Context) -> Iterator[Context]:
    """The session's context, current; the test must leave no OpenGL error, and what it made is freed."""
    gl = session_context.gl
    with session_context:
        assert gl.error == "GL_NO_ERROR", "an OpenGL error was left before this test"
        yield session_context
        left = gl.error
        gc.collect()
        gl.gc()
        gl.enable_only(gl.NOTHING)
        assert left == "GL_NO_ERROR", "the test left an OpenGL error"
        assert gl.error == "GL_NO_ERROR", "cleaning up after the test gave an OpenGL error"


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    """The one Renderer of the session: its programs are compiled once for all tests.

    It keeps half as many programs as others do, of some 4 to 8 MB each, so that a process stays below 1 GB.
    """
    with patch("texvol.opengl.shaders._MOST_PROGRAMS", 32), Renderer() as opened:
        yield opened


@pytest.fixture(scope="module", autouse=True)
def trimmed_memory() -> Iterator[None]:
    """Give the memory that a module's tests have freed back to the system; malloc keeps it otherwise."""
    yield
    gc.collect()
    gc.freeze()  # what is left stays to the end: libraries that a test was the first to load
    with suppress(OSError, AttributeError):  # glibc only
        ctypes.CDLL(None).malloc_trim(0)


@pytest.fixture(autouse=True)
def clean_renderer(request: pytest.FixtureRequest) -> Iterator[None]:
    """Free the textures that a test had a Renderer make; the test must leave no OpenGL error.

    Hypothesis refuses arguments that are set up for each test, which is why `renderer` is not.
    """
    used = request.getfixturevalue("renderer") if "renderer" in request.fixturenames else None
    yield
    if isinstance(used, Renderer) and not used._context.released:
        with used._context:
            left = used._context.gl.error
            for cache in used._pictures.in_memory.cache.volumes:
                cache.release()
        assert left == "GL_NO_ERROR", "the test left an OpenGL error"


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest) -> str:
    """Each back end that the machine has."""
    return backend_or_skip(request.param)


@pytest.fixture
def both_backends() -> tuple[str, ...]:
    """Both of them, or the test is skipped."""
    return tuple(map(backend_or_skip, BACKENDS))
