"""The error of a call, for tests that look at its message."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


def raised(kind: type[BaseException], call: Callable[..., Any], *arguments: Any, **named: Any) -> BaseException:
    """Return the error of that kind that a call raises."""
    with pytest.raises(kind) as found:
        call(*arguments, **named)
    return found.value
