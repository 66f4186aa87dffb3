#!/bin/sh
# Tests the plugin in napari itself, in .venv-napari, which has napari, Qt (340 MB) and the libraries of .venv.
# Usage: sh scripts/test_napari.sh
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."
python=.venv-napari/bin/python

sh scripts/setup.sh test
if ! "$python" -c 'import napari, PyQt6' 2>/dev/null; then
    rm -rf .venv-napari
    .venv/bin/python -m venv .venv-napari
    # Libraries of .venv come after its own.
    .venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))' \
        >"$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/beside.pth"
    "$python" -m pip install --quiet --disable-pip-version-check 'napari[pyqt6]>=0.6,<1' 'qtpy>=2.4,<3'
    # Qt's platform plugin opens these by name.
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        DEBIAN_FRONTEND=noninteractive apt-get -qq install -y libxcb-cursor0 libxcb-icccm4 libxcb-image0 \
            libxcb-keysyms1 libxcb-randr0 libxcb-render-util0 libxcb-shape0 libxcb-xinerama0 libxkbcommon-x11-0 >/dev/null
    fi
fi
exec "$python" -m pytest tests/napari_plugin "$@"
