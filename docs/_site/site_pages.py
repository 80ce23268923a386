"""Additions to the site beyond its pages: what is generated, GitHub's anchors, and a check that it loads nothing."""

from pathlib import Path
from typing import Any

from docutils import nodes
from generated import filled
from offline import network_loads
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)


def fill(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Write what is generated into a page that has been read."""
    source[0] = filled(source[0])


def add_anchors(_app: Sphinx, document: nodes.document) -> None:
    """Give headings the anchors that code hosts give them, underscores kept: `flags.html#at_bound`."""
    for section in document.findall(nodes.section):
        slug = section.get("slug")
        if slug and slug not in section["ids"]:
            section["ids"].append(slug)


def index_headings(_app: Sphinx, document: nodes.document) -> None:
    """Have the search find a heading such as `at_bound` also by its words, which is how messages write it."""
    for section in document.findall(nodes.section):
        title = section[0].astext()
        if "_" in title:
            entry = ("single", title.replace("_", " "), section["ids"][0], "", None)
            section.insert(1, addnodes.index(entries=[entry]))


def unlink_folders(_app: Sphinx, document: nodes.document) -> None:
    """Replace links to folders of the repository by their text: the site has no such pages."""
    here = Path(document["source"]).parent
    for link in list(document.findall(addnodes.pending_xref)):
        if (here / link.get("reftarget", "")).is_dir():
            link.replace_self(link.children)


def add_dashes(_app: Sphinx, document: nodes.document) -> None:
    """Write the dashes of lists of parameters as such; elsewhere two hyphens begin an option."""
    for field in document.findall(nodes.field):
        for text in list(field.findall(nodes.Text)):
            if text.startswith(" -- "):
                text.parent.replace(text, nodes.Text(" – " + text.removeprefix(" -- ")))


def check_offline(app: Sphinx, failure: Exception | None) -> None:
    """Warn, and so fail, where a page would load something from the network."""
    for page, loaded in () if failure else network_loads(Path(app.outdir)):
        _log.warning("%s loads %s from the network", page, loaded)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension's hooks with Sphinx."""
    app.connect("source-read", fill)
    app.connect("doctree-read", add_anchors)
    app.connect("doctree-read", index_headings)
    app.connect("doctree-read", add_dashes)
    app.connect("doctree-read", unlink_folders)
    app.connect("build-finished", check_offline)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
