"""Figures that are made and not drawn, which takes most of their time, for tests of what a report says."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

import pytest
from matplotlib.figure import Figure


def undrawn(_figure: Figure, file: TextIO, **_: object) -> None:
    """In the place of `Figure.savefig`."""
    file.write("<svg><defs></defs></svg>")


@contextmanager
def nothing_drawn() -> Iterator[None]:
    """Within the block figures are made and not drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", undrawn)
        yield
