#!/bin/sh
# Sets up whatever is missing, checks style and types, and runs all tests; arguments go on to pytest.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."
# Containers often set this, and each of the hundreds of processes that tests start would compile every module that it
# imports: a third of the processor time of all tests.
unset PYTHONDONTWRITEBYTECODE
sh scripts/setup.sh test osmesa
.venv/bin/python -m ruff check --quiet
# Matrix products of the tests are small: threads for them only wait for each other.
OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
export OPENBLAS_NUM_THREADS
# All tests together use every kernel of the oracle: compiled beside the check of types, none is compiled in each process.
compiling=
if [ $# = 0 ]; then .venv/bin/python scripts/compile_oracle.py & compiling=$!; fi
.venv/bin/python -m mypy --no-error-summary
[ -z "$compiling" ] || wait "$compiling"
# Three processes: on two cores they take a fifth less time than two, since many tests wait for a window or a worker.
# Each goes through files in order, so that programs are compiled once, and at the end takes over what others have left.
exec .venv/bin/python -m pytest -n 3 --dist worksteal "$@"
