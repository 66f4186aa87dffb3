"""Commands that install an extra, from a checkout and from a wheel."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.installed_wheel import installed, run, wheel  # noqa: F401  (fixtures)

from texvol.util import installation
from texvol.util.installation import install_command, libraries

REPOSITORY = Path(__file__).parents[2]
REQUIRES = [
    "numpy<3,>=2.0",
    "texvol[zarr]; extra == 'dask'",
    "distributed>=2024.9; extra == 'dask'",
    "h5py<4,>=3.11; extra == 'zarr'",
    'moto[server] <6,>=5.0 ; python_version > "3" and extra == "zarr"',
    "vtk; extra == 'zarr-other'",
]


def test_in_a_checkout_it_is_the_checkout() -> None:
    assert install_command("film") == f"pip install -e '{REPOSITORY}[film]'"


def test_extras_of_extras_are_followed_and_markers_left_out() -> None:
    assert list(libraries(REQUIRES, "dask")) == ["h5py<4,>=3.11", "moto[server]<6,>=5.0", "distributed>=2024.9"]


@pytest.mark.parametrize("kind", ["folder", "gone", "wheel", "index"])
def test_installed_elsewhere_nothing_names_texvol_on_an_index(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "my source"
    source.mkdir()
    if kind == "folder":
        (source / "pyproject.toml").touch()
    about = {"archive_info": {}} if kind == "wheel" else {"dir_info": {}}
    url = json.dumps(about | {"url": source.as_uri()})
    told = None if kind == "index" else url
    distribution = SimpleNamespace(requires=REQUIRES, read_text=lambda name: told)
    monkeypatch.setattr(installation, "PACKAGE", tmp_path / "packages" / "texvol")
    monkeypatch.setattr(metadata, "distribution", lambda name: distribution)
    wanted = {"folder": f"pip install '{source}[zarr]'"}
    assert install_command("zarr") == wanted.get(kind, "pip install 'h5py<4,>=3.11' 'moto[server]<6,>=5.0'")


def test_a_wheel_says_the_libraries(installed: Path) -> None:  # noqa: F811
    code = "from texvol.util.errors import missing_extra; print(missing_extra('imageio-ffmpeg', 'film', 'a film'))"
    said = run(installed / "bin" / "python", "-c", code, cwd=installed)
    assert said.strip().endswith("pip install 'imageio-ffmpeg<1,>=0.6'")
