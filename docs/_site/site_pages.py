"""What the site has beyond its pages: the command line as it is, GitHub's anchors, and a check that it loads nothing."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from generated import filled
from sphinx.application import Sphinx
from sphinx.util import logging

_LOADS = re.compile(
    r"""<(?:script|img|iframe|video|audio|source|embed)\b[^>]*\bsrc=["'](?:https?:)?//[^"']*"""
    r"""|<link\b[^>]*\brel=["'](?:stylesheet|preload|preconnect|icon)[^>]*\bhref=["'](?:https?:)?//[^"']*"""
    r"""|<link\b[^>]*\bhref=["'](?:https?:)?//[^"']*["'][^>]*\brel=["'](?:stylesheet|preload|preconnect|icon)"""
    r"""|(?:url\(|@import )["']?(?:https?:)?//[^"')]*"""
)
_log = logging.getLogger(__name__)


def fill(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Writes what is generated into a page that has been read."""
    source[0] = filled(source[0])


def add_anchors(_app: Sphinx, document: nodes.document) -> None:
    """Gives headings the anchors that code hosts give them, underscores kept: `flags.html#at_bound`."""
    for section in document.findall(nodes.section):
        slug = section.get("slug")
        if slug and slug not in section["ids"]:
            section["ids"].append(slug)


def check_offline(app: Sphinx, failure: Exception | None) -> None:
    """Warns, and so fails, where a page would load something from the network."""
    for page, loaded in () if failure else network_loads(Path(app.outdir)):
        _log.warning("%s loads %s from the network", page, loaded)


def network_loads(site: Path) -> Iterator[tuple[str, str]]:
    """Pages and style sheets with what they would load from the network."""
    for page in sorted([*site.rglob("*.html"), *site.rglob("*.css")]):
        for found in _LOADS.finditer(page.read_text()):
            yield str(page.relative_to(site)), found[0]


def setup(app: Sphinx) -> dict[str, Any]:
    """As Sphinx asks of an extension."""
    app.connect("source-read", fill)
    app.connect("doctree-read", add_anchors)
    app.connect("build-finished", check_offline)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
