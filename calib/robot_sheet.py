"""A robot's description on one sheet: its picture from above, and the numbers that show whether it is right."""

from io import BytesIO
from pathlib import Path

from calib.results.result import Export
from calib.results.twin import SwimTwin
from swimcal.errors import Fault, InputError
from swimcal.mjcf import PUBLISHED_COEFFICIENTS, build_mjcf, natural_hz
from swimcal.results import write_whole
from swimcal.robot import load_robot
from swimcal.twin import Twin

PICTURES = (".png", ".svg", ".pdf")
"""Endings of the pictures that can be written."""
DOTS_AN_INCH = 200


def draw_robot(robot: str | Path | None = None, out: str | Path = "robot.png") -> Export:
    """Draw a robot from above, and say what its description amounts to: mass, length, natural frequency, speed.

    Args:
        robot: a robot's TOML; default: the published 0.57 m fish.
        out: the picture to write, .png, .svg or .pdf.

    Raises:
        InputError: the file has faults, all of them at once; or `out` has another ending.
        ResultsNotWritable: `out` cannot be written.

    Example:
        >>> made = calib.draw_robot(out="fish.png")
        >>> made.notes[1]
        'Its tail rings at 3.6 Hz in air, without tendons'
    """
    from reports.robot import planform_figure  # it loads Matplotlib

    described, picture = load_robot(None if robot is None else Path(robot)), Path(out)
    if picture.suffix.lower() not in PICTURES:
        what, expected = "no picture can be written there", "a name with one of these endings"
        raise InputError([Fault("--out", "", what, picture.name, expected, PICTURES)])
    markers = tuple(described.markers)
    speed_m_s = float(SwimTwin(described, PUBLISHED_COEFFICIENTS, Twin(described, markers)).swim(1.0).speed[0])
    mass_kg, tail_kg = build_mjcf(described).compile().body_mass.sum(), described.tail_mass_kg.sum()
    drawn = BytesIO()
    planform_figure(described, markers).savefig(drawn, format=picture.suffix[1:].lower(), dpi=DOTS_AN_INCH)
    write_whole(picture, drawn.getvalue())
    notes = (
        f"{described.name}: {mass_kg:.2f} kg, of which the tail has {1000 * tail_kg:.0f} g; {described.length_m:.2f} m "
        "from nose to fin",
        f"Its tail rings at {natural_hz(described):.1f} Hz in air, without tendons",
        f"With the published coefficients it swims at {speed_m_s:.3f} m/s at 1 Hz; a fit finds its own",
    )
    return Export((picture,), notes)
