"""The rendering of templates to pages: one environment, everything escaped, nothing fetched."""

from functools import lru_cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from reports.colours import INKS


def render_page(template: str, **values: Any) -> str:
    """Render the page that a template of `reports/templates` makes of the values."""
    return environment("reports", escaped=True).get_template(template).render(inks=INKS, **values)


@lru_cache
def environment(package: str, escaped: bool) -> Environment:
    """Load the templates of a package, for pages (`escaped`) or for plain text."""
    return Environment(
        loader=PackageLoader(package),
        autoescape=escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=not escaped,
    )
