"""The missing forces on the moving fish: an arrow at the head, and lines for head and hinges over time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rerun as rr

from fitting import CalibratedTrial
from reports.missing_forces import FORCES, MissingForces
from reports.recording.layer import GAP, Layer, entity_of, lines

MISSING_FORCE = "missing_force_mN"
MISSING_TORQUE = "missing_torque_mN_m"
ARROW = "missing_force"
LONGEST = 2.0  # length of the longest arrow, in distances from nose to neck
_MILLI = 1000.0


class MissingOverTime(NamedTuple):
    """The forces that a diagnosis finds missing, frame by frame.

    Attributes:
        joints: (j,) along and across the head (nose to neck; counter-clockwise from there, seen from above), the moment
            on it, then the hinges.
        force: (n, j) N or N m; nan where it is not known.
    """

    joints: tuple[str, ...]
    force: np.ndarray

    @classmethod
    def of(cls, forces: MissingForces, trial: CalibratedTrial, frames: int, first: int) -> MissingOverTime | None:
        """Evaluate the forces in the frames of a fitted swim; None for any other trial.

        Args:
            forces: the missing forces of the diagnosis.
            trial: the swim.
            frames: number n of frames of the recording.
            first: the recording's frame that is the first measured one.
        """
        if trial.measured.name not in forces.trials:
            return None
        measured = trial.measured
        turn = trial.phase_rad + measured.crank_rad(measured.time_s[measured.kept], trial.simulated_hz)
        mean, _ = forces.over(turn)
        kept = np.zeros(frames, bool)
        kept[first : first + len(measured.kept)] = measured.kept
        force = np.full((frames, len(forces.joints)), np.nan)
        force[kept] = mean[forces.trials.index(measured.name)].T
        return cls(forces.joints, force)


def missing_layers(trial: str, missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> list[Layer]:
    """Make the arrow in the picture and the lines next to it.

    Args:
        trial: name of the trial.
        missing: its missing forces.
        nose_px: (n, 2) nose in the picture, nan where it is not seen.
        neck_px: (n, 2) neck in the picture, nan where it is not seen.
    """
    is_force = np.array([joint in FORCES for joint in missing.joints])
    layers = [_arrow(trial, missing, nose_px, neck_px)]
    for name, part in ((MISSING_FORCE, is_force), (MISSING_TORQUE, ~is_force)):
        joints = np.array(missing.joints)[part].tolist()
        layers.append(lines(entity_of(trial, name), joints, _MILLI * missing.force[:, part]))
    return layers


def arrows_px(missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> np.ndarray:
    """Compute the (n, 2) arrows of the force on the head in the picture, whose y points down.

    The longest is two heads long.

    Args:
        missing: the missing forces.
        nose_px: (n, 2) nose in the picture.
        neck_px: (n, 2) neck in the picture.
    """
    along = neck_px - nose_px
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1)  # along, turned counter-clockwise seen from above
    force = missing.force[:, [missing.joints.index(name) for name in FORCES]]  # (n, 2) N
    arrows = force[:, :1] * along + force[:, 1:] * across
    largest = np.nanmax(np.linalg.norm(arrows, axis=1), initial=0.0)
    return np.asarray(arrows * (LONGEST * np.nanmedian(length) / largest if largest > 0 else 0.0))


def _arrow(trial: str, missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> Layer:
    arrows = arrows_px(missing, nose_px, neck_px)
    good = np.isfinite(arrows).all(axis=1)
    columns = rr.Arrows2D.columns(vectors=arrows[good], origins=neck_px[good]).partition(good.astype(int))
    style = rr.Arrows2D.from_fields(colors=[GAP], radii=-2.0, draw_order=30.0)
    return Layer(entity_of(trial, "picture", ARROW), (style,), np.arange(len(arrows)), tuple(columns))
