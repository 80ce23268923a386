"""`calib mjcf` for a robot without a calibration."""

from pathlib import Path

from session import write_whole
from swimmer import build_mjcf, load_robot


def write_nominal_mjcf(robot_file: Path | None, out: Path) -> None:
    """Writes the MJCF of a robot (None: the 0.57 m fish) with the published coefficients.

    Raises:
        InputError: all faults of the robot file.
        ResultsNotWritable: `out` cannot be written.
    """
    spec = build_mjcf(load_robot(robot_file))
    spec.compile()
    write_whole(out, spec.to_xml())
