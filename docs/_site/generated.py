"""What is generated in pages: it stands on the site where the page has a mark."""

import re

from command_line import command_line
from records import record

_MARK = re.compile(r"<!-- generated: (?:command line|record (\S+)) -->")


def filled(page: str) -> str:
    """A page with what is generated in the place of its marks."""
    return _MARK.sub(lambda found: record(found[1]) if found[1] else command_line(), page)
