"""Commit of the source that a run tests: of the CI system's environment, else of git in the current folder."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping

_VARIABLES = ("GITHUB_SHA", "CI_COMMIT_SHA", "BUILDKITE_COMMIT", "CIRCLE_SHA1", "BUILD_SOURCEVERSION", "GIT_COMMIT")
_PATIENCE = 5.0  # seconds for git, which may have to read a slow disk
_HASH = re.compile(r"[0-9a-f]{7,64}")


def commit_of(environment: Mapping[str, str]) -> str:
    """Return the commit; empty if there is none."""
    for name in _VARIABLES:
        if _HASH.fullmatch(found := environment.get(name, "").strip().lower()):
            return found
    try:
        done = subprocess.run(
            ["git", "rev-parse", "--verify", "HEAD"],
            capture_output=True, text=True, timeout=_PATIENCE, check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return ""
    return found if _HASH.fullmatch(found := done.stdout.strip()) else ""
