"""What was tracked so far, kept on disk so that interrupted work goes on where it was."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from session.results import writing_whole


@dataclass(frozen=True)
class Partial:
    """A file for what was tracked so far.

    Attributes:
        path: of the file, an ``.npz``; it is removed once the work is done.
        fingerprint: of all that the tracks depend on; what was kept under another one is not used.
    """

    path: Path
    fingerprint: str

    def read(self) -> dict[str, np.ndarray] | None:
        """What was kept; None when there is nothing, or nothing that can be used."""
        try:
            with self.path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                kept = {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, KeyError, RuntimeError, BadZipFile):  # what NumPy and zipfile raise
            return None
        return kept if str(kept.pop("fingerprint", "")) == self.fingerprint else None

    def write(self, kept: Mapping[str, np.ndarray]) -> None:
        """Keeps what was tracked so far, in the place of what was kept before."""
        with writing_whole(self.path) as part:
            np.savez(part, allow_pickle=False, fingerprint=np.array(self.fingerprint), **kept)

    def remove(self) -> None:
        """Forgets it."""
        self.path.unlink(missing_ok=True)
