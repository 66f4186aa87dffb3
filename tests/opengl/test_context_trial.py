"""Driver settings of the environment that crash a driver end a trial process only, and give one line."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support.small_pictures import backend_or_skip

from texvol.opengl import contexts
from texvol.opengl.contexts import trial
from texvol.util.errors import ContextError

# Each ended the process (SIGSEGV) with Mesa 22.3, or is known to be refused.
NONSENSE = {
    "GALLIUM_DRIVER": "nonsense",
    "MESA_GLSL_VERSION_OVERRIDE": "110",
    "MESA_EXTENSION_OVERRIDE": "-GL_ARB_texture_float",
    "MESA_GL_VERSION_OVERRIDE": "2.1",
}


def is_mesas(backend: str) -> None:
    backend_or_skip(backend)
    context = contexts.open_context(backend)
    name = context.renderer
    context.release()
    if "llvmpipe" not in name and "softpipe" not in name:
        pytest.skip(f"{name} is not Mesa's, and takes no orders from its variables")


def ran(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-c", code]
    return subprocess.run(
        line, cwd=folder, env=os.environ | environment, capture_output=True, text=True, check=False, timeout=120
    )


@pytest.mark.parametrize("name, backend", list(zip(NONSENSE, ["egl", "osmesa", "auto", "egl"], strict=True)))
def test_no_signal_ends_a_command(tmp_path: Path, name: str, backend: str) -> None:
    is_mesas("osmesa" if backend == "osmesa" else "egl")
    np.save(tmp_path / "v.npy", np.zeros((4, 4, 4), np.float32))
    code = (
        "import sys; from texvol.__main__ import main;"
        f"sys.exit(main(['render', 'v.npy', '--size', '8x8', '--backend', {backend!r}, '-o', 'a.png']))"
    )
    done = ran(code, tmp_path, **{name: NONSENSE[name]})
    assert done.returncode == 2, done
    assert done.stderr.startswith("texvol: error: no OpenGL 3.3 context; ") and done.stderr.count("\n") == 1
    assert os.listdir(tmp_path) == ["v.npy"]


@pytest.mark.parametrize("name", ["GALLIUM_DRIVER", "MESA_EXTENSION_OVERRIDE"])
def test_python_gets_an_error_that_names_the_variable(tmp_path: Path, name: str) -> None:
    is_mesas("osmesa")
    code = (
        "import texvol\nfor _ in range(2):\n    try:\n        texvol.Renderer('osmesa')\n"
        "    except texvol.ContextError as error:\n        print(error)"
    )
    done = ran(code, tmp_path, **{name: NONSENSE[name]})
    assert done.returncode == 0, done
    lines = done.stdout.splitlines()
    assert len(lines) == 2 and lines[0] == lines[1]  # also when it is asked again
    assert f"the driver ends the process (SIGSEGV), asked for {name}={NONSENSE[name]}" in lines[0]


def test_a_driver_that_is_asked_for_and_there_is_taken(tmp_path: Path) -> None:
    is_mesas("egl")
    done = ran("import texvol; print(texvol.Renderer('egl').renderer_name)", tmp_path, GALLIUM_DRIVER="softpipe")
    assert done.stdout.strip() == "softpipe", done


def test_an_ordinary_environment_starts_no_process(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in trial.unusual():
        monkeypatch.delenv(name.partition("=")[0], raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    for name, value in {
        "EGL_LOG_LEVEL": "fatal",
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "LP_NUM_THREADS": "1",  # which a worker sets, so that its driver leaves room to the others
        "MESA_SHADER_CACHE_DIR": "/tmp",
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(subprocess, "run", None)
    assert trial.unusual() == []
    begun = time.perf_counter()
    trial.check("egl")
    assert time.perf_counter() - begun < 0.02


def test_what_is_unusual_is_named() -> None:
    home = {"HOME": "/nowhere"}
    assert trial.unusual(home | {"GALLIUM_DRIVER": "x", "PATH": "y"}) == ["GALLIUM_DRIVER=x"]
    (long,) = trial.unusual(home | {"MESA_EXTENSION_OVERRIDE": "x" * 1000})
    assert len(long) < 100


def test_a_file_that_tells_drivers_what_to_do_is_tried(tmp_path: Path) -> None:
    (tmp_path / ".drirc").touch()
    assert trial.unusual({"HOME": str(tmp_path)}) == [f"{tmp_path}/.drirc"]


def test_a_driver_that_does_not_answer_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GALLIUM_DRIVER", "x")
    monkeypatch.setattr(trial, "_PATIENCE", 0.001)
    with pytest.raises(ContextError, match="does not answer, asked for GALLIUM_DRIVER=x"):
        trial.check("egl")


def test_where_no_process_can_be_started_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GALLIUM_DRIVER", "x")
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    trial.check("egl")
