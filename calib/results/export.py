"""Files that a function wrote of what stands, and what they are."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Export:
    """What was written.

    Attributes:
        files: in the order in which they were made; an index comes last.
        notes: what they show, of which effort, and what was left out and how to renew it.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()

    @property
    def file(self) -> Path:
        """The last of them."""
        return self.files[-1]
