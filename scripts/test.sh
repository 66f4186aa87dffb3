#!/bin/sh
# Sets up whatever is missing, checks style, and runs all tests while types are checked; arguments go on to pytest.
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
# Types are checked in the time in which tests wait for windows, workers and servers.
said=$(mktemp)
nice -n 5 .venv/bin/python -m mypy --no-error-summary >"$said" 2>&1 &
checking=$!
trap 'kill $checking 2>/dev/null || :; rm -f "$said"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
# All tests together use every kernel of the oracle: compiled beforehand, none is compiled in each process.
if [ $# = 0 ]; then .venv/bin/python scripts/compile_oracle.py; fi
# Three processes: on two cores they take a fifth less time than two, since many tests wait for a window or a worker.
# Each goes through files in order, so that programs are compiled once, and at the end takes over what others have left.
status=0
.venv/bin/python -m pytest -n 3 --dist worksteal "$@" || status=$?
wait "$checking" || { status=$?; echo "mypy:"; }
cat "$said"
exit "$status"
