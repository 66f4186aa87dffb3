#!/bin/sh
# Makes the site of the documentation in build/site, from the pages in texvol/docs and the docstrings; warnings are errors.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."
sh scripts/setup.sh docs
.venv/bin/python -m sphinx -W --keep-going -q -b html -c scripts/site -d build/doctrees texvol/docs build/site
printf 'texvol: the site is %s\n' "$PWD/build/site/index.html"
