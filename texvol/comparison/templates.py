"""Jinja2 templates of the HTML pages: escaped automatically, with control characters shown by their numbers.

Templates are the files in `pages/` of a package; every package also sees those of texvol.comparison. All pages extend
frame.html: they need no other file, and a browser allows them no request.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from texvol.util.shown_text import shown

# Each status has a sign besides its colour, for readers who do not see colours. Worst first.
SIGNS = {"broken": "✕", "different": "≠", "new": "+", "same": "✓"}
_SHOWN_AS = {"updated": "new"}  # statuses of pytest's reports; all others without a sign of their own are failures


def rendered(
    template: str,
    package: str = "texvol.comparison",
    /,
    filters: Mapping[str, Callable[[Any], Any]] = {},
    **context: Any,
) -> str:
    """Return the text of a template of a package, filled with `context`; `filters` are the package's own."""
    environment = _environment(package)
    environment.filters.update(filters)
    return environment.get_template(template).render(context)


def kind_of_status(status: str) -> str:
    """Return the status whose sign and colour a status has: itself, or one of `SIGNS`."""
    return status if status in SIGNS else _SHOWN_AS.get(status, "broken")


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with `digits` significant digits; a dash for None."""
    if value is None:
        return "–"
    if value != value:
        return "NaN"
    if abs(value) == float("inf"):
        return "∞" if value > 0 else "−∞"
    return f"{value:.{digits}g}".replace("-", "−")


@cache
def _environment(package: str) -> Environment:
    loader = ChoiceLoader([PackageLoader(each, "pages") for each in dict.fromkeys((package, "texvol.comparison"))])
    environment = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_printable,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # NaN is no JSON. Keys stay in their order.
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.filters["number"] = number
    environment.globals["signs"] = SIGNS
    environment.globals["kind_of_status"] = kind_of_status
    environment.globals["source"] = lambda name: Markup(loader.get_source(environment, name)[0])
    return environment


def _printable(value: Any) -> Any:
    """Return the value as the template prints it: in text, control characters by their numbers."""
    return shown(value) if isinstance(value, str) and not isinstance(value, Markup) else value
