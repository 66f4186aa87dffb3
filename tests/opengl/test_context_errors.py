"""What is said when there is no context, and what is tried before."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.small_pictures import available, backend_or_skip, current, draw, run_python

from texvol.opengl.contexts import egl, native, open_context, osmesa
from texvol.util.errors import ContextError, InputError


def test_an_unknown_back_end_is_named_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="backend must be one of auto, egl, osmesa, got 'glx'"):
        open_context("glx")


@pytest.fixture
def nothing_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without either library."""
    available()  # remembers what the machine has, before that is hidden
    monkeypatch.setattr(native, "loaded", {})
    monkeypatch.setattr(egl, "LIBRARIES", ("libNoEGL.so.1",))
    monkeypatch.setattr(osmesa, "LIBRARIES", ("libNoOSMesa.so.8",))


@pytest.mark.usefixtures("nothing_loaded")
def test_missing_libraries_are_named_with_their_packages() -> None:
    with pytest.raises(ContextError) as caught:
        open_context()
    message = str(caught.value)
    assert "\n" not in message
    for part in ("libNoEGL.so.1", "libNoOSMesa.so.8", "libegl1", "libosmesa6", "mesa-libEGL", "mesa-libOSMesa"):
        assert part in message


@pytest.mark.usefixtures("nothing_loaded")
def test_an_explicit_back_end_is_not_replaced_by_the_other(monkeypatch: pytest.MonkeyPatch, backend: str) -> None:
    other = backend_or_skip("osmesa" if backend == "egl" else "egl")
    library = {"egl": (egl, "libEGL.so.1"), "osmesa": (osmesa, "libOSMesa.so.8")}[other]
    monkeypatch.setattr(library[0], "LIBRARIES", (library[1],))
    with pytest.raises(ContextError) as caught:
        open_context(backend)
    assert f"{other}:" not in str(caught.value)
    open_context(other).release()
    context = open_context("auto")
    assert context.backend == other
    context.release()


def test_a_library_without_a_function_is_too_old(monkeypatch: pytest.MonkeyPatch) -> None:
    backend_or_skip("osmesa")
    monkeypatch.setattr(native, "loaded", {})
    monkeypatch.setitem(osmesa.SIGNATURES, "OSMesaFromTheFuture", (None,))
    with pytest.raises(ContextError, match=r"libOSMesa\.so\.\d has no OSMesaFromTheFuture, it is too old"):
        open_context("osmesa")


def test_every_display_is_tried_and_its_reason_given(monkeypatch: pytest.MonkeyPatch) -> None:
    backend_or_skip("egl")

    def refuse(handle: native.Handle) -> None:
        raise ContextError("refused")

    monkeypatch.setattr(egl.EglHandle, "bind", refuse)
    with pytest.raises(ContextError) as caught:
        open_context("egl")
    # A driver may have several devices; Mesa's has one at least, and the platform without a surface.
    assert str(caught.value).count(": refused") >= 2
    assert current() == [False, False]


def test_the_next_display_serves_when_the_first_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    backend_or_skip("egl")
    bind = egl.EglHandle.bind
    refused: list[egl.EglHandle] = []

    def refuse_once(handle: egl.EglHandle) -> None:
        if not refused or refused[0] is handle:
            refused.append(handle)
            raise ContextError("refused")
        bind(handle)

    monkeypatch.setattr(egl.EglHandle, "bind", refuse_once)
    context = open_context("egl")
    assert draw(context).any()
    context.release()


def test_an_old_driver_is_refused_with_the_version_wanted() -> None:
    # Mesa's own switch; a driver that is not Mesa ignores it and opens.
    done = run_python(
        "from texvol.opengl.contexts import open_context; print(open_context().renderer)",
        MESA_GL_VERSION_OVERRIDE="3.1",
    )
    if done.returncode == 0:
        pytest.skip(f"{done.stdout.strip()} is not Mesa's")
    last = done.stderr.strip().splitlines()[-1]
    assert "no OpenGL 3.3 context" in last
    assert "egl:" in last
    assert "osmesa:" in last


def test_a_driver_that_cannot_keep_its_cache_draws_all_the_same(backend: str, tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.touch()
    done = run_python(
        f"from support import small_pictures as t; assert t.draw(t.open_context({backend!r})).any()",
        HOME=str(occupied),
        XDG_CACHE_HOME=str(occupied),
    )
    assert done.returncode == 0, done.stderr
