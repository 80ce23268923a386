"""What is generated in pages: it stands on the site where the page has a mark."""

import re

from command_line import command_line
from interface_names import interface
from records import record

_MARK = re.compile(r"<!-- generated: (?:(command line)|(interface)|record (\S+)) -->")


def filled(page: str) -> str:
    """A page with what is generated in the place of its marks."""
    return _MARK.sub(_text, page)


def _text(mark: re.Match[str]) -> str:
    if mark[1]:
        return command_line()
    return interface() if mark[2] else record(mark[3])
