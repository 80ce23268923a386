"""Writing the camera file of the session's contract."""

from pathlib import Path

import tomlkit

from session import CameraCalibration, write_whole


def save_camera(path: Path, calibration: CameraCalibration) -> None:
    """Writes a camera file, whole or not at all; `session.load_camera` reads the same numbers back.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    table = tomlkit.table()
    for key, value in calibration.model_dump(exclude_none=True).items():
        table[key] = list(value) if isinstance(value, tuple) else value
    document = tomlkit.document()
    document["camera"] = table
    write_whole(path, tomlkit.dumps(document))
