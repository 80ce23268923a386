"""The sideways sway of the neck over the beat, measured and simulated: in it a roll of the hull shows most plainly."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.model.features import of_markers
from fitting.model.mode import Mode
from fitting.model.roll import NO_ROLL
from fitting.trial import MeasuredTrial


class Wave(NamedTuple):
    """The first harmonic of a marker's sideways motion.

    Attributes:
        amplitude_m: of it.
        phase_deg: by which it is ahead of the hindmost marker's, 0 to 360.
    """

    amplitude_m: float
    phase_deg: float


class Sway(NamedTuple):
    """Of the neck in one trial.

    Attributes:
        frequency_hz: of the beat.
        measured: by the tracks.
        rigid: by the calibrated twin, whose hull does not roll.
        rolling: by the same with the likeliest roll of the fit.
        roll_deg: amplitude of that roll.
    """

    frequency_hz: float
    measured: Wave
    rigid: Wave
    rolling: Wave
    roll_deg: float


def sways(mode: Mode, trials: Sequence[MeasuredTrial]) -> dict[str, Sway]:
    """Of every trial by its name, fitted or held out."""
    first, found = mode.model.trials[0], {}
    for trial in trials:
        neck, hindmost = trial.markers.index("neck"), trial.tail[-1]
        model = type(first)(first.twin, trial, first.phase_rad, with_course=True, roll=mode.roll)
        swum = model.trajectories(mode.coefficients[None])
        rows = [model.measured, *(each.features_of(swum)[0] for each in (model.rolling(NO_ROLL), model))]
        harmonics = [of_markers(row)[:, 1, 1] + 1j * of_markers(row)[:, 1, 2] for row in rows]  # (m,) each
        roll = abs(harmonics[2][neck] - harmonics[1][neck]) / first.twin.robot.marker_positions_m(("neck",))[0, 2]
        measured, rigid, rolling = (_wave(each[neck], each[hindmost]) for each in harmonics)
        found[trial.name] = Sway(trial.frequency.hz, measured, rigid, rolling, float(np.degrees(roll)))
    return found


def _wave(harmonic: complex, reference: complex) -> Wave:
    phase = np.degrees(np.angle(harmonic / reference)) % 360
    return Wave(float(abs(harmonic)), float(phase))
