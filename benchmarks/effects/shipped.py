"""Small suite that is shipped: `python -m benchmarks.effects.shipped datasets/withheld` makes it.

Existing sessions stay; to make all anew, remove `small/sessions` and `small/answers` first.
"""

import re
import sys
from hashlib import sha256
from pathlib import Path

from benchmarks.cases import Run
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.run import make_suite
from benchmarks.effects.suite import SIZES
from benchmarks.sample import checksums
from swimcal.results import write_whole

SEED = 1


def ship(folder: Path) -> None:
    """Make `small/` in a folder, and write the checksum of its sessions into the card next to it.

    Raises:
        InputError: `small/` holds another suite.
        RuntimeError: a session could not be made.
    """
    suite = SuiteFolder(folder / "small")
    run = Run(progress=lambda message, _: print(message, file=sys.stderr))
    if failures := make_suite(suite, SEED, SIZES["small"], run):
        raise RuntimeError(f"small suite: {len(failures)} sessions failed, the first: {failures[0].message}")
    card = folder / "CARD.md"
    found = checksum_of_sessions(suite)
    write_whole(card, re.sub(r"(\| `small/sessions` \| `)[^`]*`", rf"\g<1>{found}`", card.read_text(encoding="utf-8")))


def checksum_of_sessions(suite: SuiteFolder) -> str:
    """Return the sha256 of the lines `<sha256>  sessions/<file>` of all files but results, in order of the paths."""
    lines = [f"{digest}  sessions/{name}\n" for name, digest in checksums(suite.sessions).items()]
    return sha256("".join(lines).encode()).hexdigest()


if __name__ == "__main__":
    ship(Path(sys.argv[1]))
