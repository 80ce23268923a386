"""Opening a recording in the Rerun viewer."""

import shutil
import subprocess
import sys
from pathlib import Path

from session import SwimcalError

VIEWER = "rerun"


def open_viewer(recording: Path) -> None:
    """Starts the viewer that was installed with this program, else the one on the path, and does not wait for it.

    Raises:
        SwimcalError: there is none, or it cannot be started.
    """
    beside = str(Path(sys.executable).parent)
    viewer = shutil.which(VIEWER, path=beside) or shutil.which(VIEWER)
    if viewer is None:
        raise _not_opened(recording, f"no command `{VIEWER}` in {beside} or on the path")
    try:
        subprocess.Popen([viewer, str(recording)], start_new_session=True)
    except OSError as error:
        raise _not_opened(recording, f"{viewer}: {error.strerror or error}") from error


def _not_opened(recording: Path, found: str) -> SwimcalError:
    return SwimcalError(
        f"the viewer cannot be opened; found: {found}; expected: the viewer of the package rerun-sdk. "
        f"Install it with `pip install rerun-sdk`, or open {recording} on another machine."
    )
