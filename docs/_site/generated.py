"""What is generated in pages: it stands on the site where the page has a mark."""

import re

from command_line import command_line
from interface_names import interface
from messages import messages
from records import record
from tutorials import tutorials
from words import words

_MARK = re.compile(r"<!-- generated: (?:(command line|interface|messages|tutorials|words)|record (\S+)) -->")

_WHOLE = {
    "command line": command_line,
    "interface": interface,
    "messages": messages,
    "tutorials": tutorials,
    "words": words,
}


def filled(page: str) -> str:
    """A page with what is generated in the place of its marks."""
    return _MARK.sub(_text, page)


def _text(mark: re.Match[str]) -> str:
    return _WHOLE[mark[1]]() if mark[1] else record(mark[2])
