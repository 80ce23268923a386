"""Templates to pages: one environment, everything escaped, nothing fetched."""

from functools import lru_cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.colours import INKS


def render_page(template: str, **values: Any) -> str:
    """The page that a template of `reports/templates` makes of the values."""
    return _environment().get_template(template).render(inks=INKS, **values)


@lru_cache(maxsize=1)
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
