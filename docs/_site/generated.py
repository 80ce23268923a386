"""What is generated in pages: it stands on the site where the page has a mark."""

import re

from command_line import command_line
from interface_names import interface
from records import record
from tutorials import tutorials

_MARK = re.compile(r"<!-- generated: (?:(command line|interface|tutorials)|record (\S+)) -->")

_WHOLE = {"command line": command_line, "interface": interface, "tutorials": tutorials}


def filled(page: str) -> str:
    """A page with what is generated in the place of its marks."""
    return _MARK.sub(_text, page)


def _text(mark: re.Match[str]) -> str:
    return _WHOLE[mark[1]]() if mark[1] else record(mark[2])
