"""Check that a site loads nothing from the network."""

import re
from collections.abc import Iterator
from pathlib import Path

_LOADS = re.compile(
    r"""<(?:script|img|iframe|video|audio|source|embed)\b[^>]*\bsrc=["'](?:https?:)?//[^"']*"""
    r"""|<link\b[^>]*\brel=["'](?:stylesheet|preload|preconnect|icon)[^>]*\bhref=["'](?:https?:)?//[^"']*"""
    r"""|<link\b[^>]*\bhref=["'](?:https?:)?//[^"']*["'][^>]*\brel=["'](?:stylesheet|preload|preconnect|icon)"""
    r"""|(?:url\(|@import )["']?(?:https?:)?//[^"')]*"""
)


def network_loads(site: Path) -> Iterator[tuple[str, str]]:
    """Yield pages and style sheets with what they would load from the network."""
    for page in sorted([*site.rglob("*.html"), *site.rglob("*.css")]):
        for found in _LOADS.finditer(page.read_text()):
            yield str(page.relative_to(site)), found[0]
