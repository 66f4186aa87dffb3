#!/bin/sh
# Sets up whatever is missing, and renders the built-in volume; `texvol demo` says where the picture is.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."
sh scripts/setup.sh
exec .venv/bin/python -m texvol demo -o "$PWD/demo.png"
