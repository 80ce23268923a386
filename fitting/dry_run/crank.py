"""What dry runs say of the crank: its arm, and of each run speed, phase and how close the twin comes."""

from dataclasses import dataclass

import numpy as np

from fitting.dry_run.error_surface import Cell, ErrorSurface
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.tendons import TendonUse
from session import Flag


@dataclass(frozen=True, eq=False)
class CrankTrial:
    """One dry run and the twin with the fitted arm.

    Attributes:
        measured: the run.
        speed_hz, speed_se_hz: turns of the crank a second.
        phase_rad, phase_se_rad: crank angle at time 0, from 0 to 2 pi.
        marker_error_m: published distance of the twin with the joint arm and this speed and phase, m.
        scale: of the picture by all markers, over that of the measured nose-neck distance.
        motion_error_m: root mean square distance of the markers' motions about their means in the joint fit, m.
        published: this run's own lowest published distance.
        surface: the published distance on the grid.
        tendons: in the twin, at the fitted arm and speed.
        flags: what is doubtful.
    """

    measured: DryTrial
    speed_hz: float
    speed_se_hz: float
    phase_rad: float
    phase_se_rad: float
    marker_error_m: float
    scale: float
    motion_error_m: float
    published: Cell
    surface: ErrorSurface
    tendons: TendonUse
    flags: tuple[Flag, ...]

    @property
    def name(self) -> str:
        """As in the session."""
        return self.measured.name


@dataclass(frozen=True, eq=False)
class CrankFit:
    """The crank of a robot.

    Attributes:
        arm_m, arm_se_m: of the joint fit of all runs, and its standard error, m.
        smooth_m: smallest and largest arm around it over which the tail moves smoothly; the arm is within, m.
        trials: the runs.
        flags: what is doubtful about the arm.
    """

    arm_m: float
    arm_se_m: float
    smooth_m: tuple[float, float]
    trials: tuple[CrankTrial, ...]
    flags: tuple[Flag, ...]

    @property
    def arm_per_trial_m(self) -> tuple[float, ...]:
        """Of each run by its own published distance, m."""
        return tuple(trial.published.arm_m for trial in self.trials)

    @property
    def arm_published_m(self) -> float:
        """The published estimate: the mean of those, m."""
        return float(np.mean(self.arm_per_trial_m))
