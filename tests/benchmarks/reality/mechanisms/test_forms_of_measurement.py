"""Errors of camera and tracker in reality's form, and the twin's nearest to them, on one motion: no simulator between.

What is compared is what a session keeps of a picture: markers in the frame of the head, its length the unit.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from benchmarks.reality.camera import Camera, Picture, Sight
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import CATALOGUED, FAMILIES
from benchmarks.reality.mechanisms.measurement import (
    HeadFrameMisalignment,
    LensDistortion,
    MarkerOffset,
    ScaleError,
    TimeBaseError,
    TrackerDrift,
)
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect, Observation, View
from swimcal.robot import load_robot
from tests.cases import later

TIME_S = np.arange(241) / 60
CAMERA = Camera()
PX_PER_M = CAMERA.focal_px / CAMERA.height_m
NOSE, NECK = FISHSIM_MARKERS.index("nose"), FISHSIM_MARKERS.index("neck")
PLACE_M = load_robot().marker_positions_m(FISHSIM_MARKERS)
VIEW = View(np.zeros(2), np.array([0.0, -1.0]), CAMERA.height_px / 2 / PX_PER_M)
LEAST_RESIDUAL, COPIED, DRAWS = 0.01, 1e-3, 3
"""Relative residuals: of a form of its own at least, in the median over some draws; of the twin's at most."""
LITTLE_ELSE = {
    "scale_error": "two boxes that are too far apart: only that the nose's may be off too is not the twin's",
    "time_base_error": "a clock that runs too fast: only that it sways by up to a tenth of that is not the twin's",
}


def sight(time_s: np.ndarray) -> Sight:
    """A fish that swims ahead across the picture, beats once a second with a wave that grows rearwards, and yaws."""
    x = np.linspace(PLACE_M[:, 0].min(), PLACE_M[:, 0].max(), 400)
    behind = np.clip(x - PLACE_M[NECK, 0], 0.0, None)
    bend = 2.0 * behind * np.sin(2 * np.pi * time_s[:, None] - 6.0 * behind)
    heading = 0.3 + 0.1 * np.sin(2 * np.pi * time_s[:, None] + 1.0)
    axis = -np.exp(1j * (heading + bend))  # tailwards
    line = np.cumsum(axis, axis=1) * (x[1] - x[0])
    at = np.abs(x - PLACE_M[:, :1]).argmin(axis=1)
    axes, head = axis[:, at], 0.1 * np.exp(0.3j) * time_s[:, None] - 0.2j - 0.3
    marker_m = head + line[:, at] + 1j * PLACE_M[:, 1] * axes
    return Sight(FISHSIM_MARKERS, time_s, marker_m, axes, np.zeros(axes.shape))


def in_reality(mechanisms: tuple[Mechanism, ...]) -> np.ndarray:
    """(f, m) markers as a camera sees them, in the frame of the head."""
    time_s = TIME_S
    for mechanism in mechanisms:
        time_s = mechanism.expose(time_s)
    seen = sight(time_s)
    for mechanism in mechanisms:
        seen = mechanism.place(seen)
    picture = Picture(seen.names, TIME_S, CAMERA.project(seen.marker_m, seen.height_m), CAMERA)
    for mechanism in mechanisms:
        picture = mechanism.picture(picture)
    off = (picture.position_px - CAMERA.centre_px) / PX_PER_M
    return of_head(off[..., 0] - 1j * off[..., 1])


def in_twin(effect: Effect, values: np.ndarray, late_s: float) -> np.ndarray:
    """(f, m) the same with an effect of the twin's, of a beat that is late."""
    seen = sight(effect.clock(TIME_S, values) - late_s)
    axes = np.stack([seen.axis, 1j * seen.axis], axis=2)
    above_m = PLACE_M[:, 2] - PLACE_M[NOSE, 2]
    true_sight = Observation(TIME_S, pairs(seen.marker_m), pairs(axes), 2 * np.pi * TIME_S, seen.names, above_m, VIEW)
    found = effect.observe(true_sight, values)
    return of_head(found[..., 0] + 1j * found[..., 1])


def of_head(marker_m: np.ndarray) -> np.ndarray:
    return (marker_m - marker_m[:, [NOSE]]) / (marker_m[:, [NECK]] - marker_m[:, [NOSE]])


def pairs(place: np.ndarray) -> np.ndarray:
    return np.stack([place.real, place.imag], axis=-1)


def residual_of_the_twins(name: str, mechanisms: tuple[Mechanism, ...]) -> float:
    """Share of what mechanisms do to a session that the twin's form of an effect leaves at its best."""
    effect = catalogue()[name].suited(load_robot(), FISHSIM_MARKERS)
    truth = in_reality(mechanisms)
    low, high, sd = np.transpose([parameter[2:] for parameter in effect.parameters])

    def nearest(low: np.ndarray, high: np.ndarray, unit: np.ndarray) -> float:
        """With the phase of the beat refitted, as in every trial."""

        def residuals(of_unit: np.ndarray) -> np.ndarray:
            values = np.zeros(len(sd))
            values[: len(unit)] = unit * of_unit[1:]
            return pairs(in_twin(effect, values, 0.01 * of_unit[0]) - truth).ravel()

        bounds = [np.append(end, edge / unit) for end, edge in ((-10.0, low), (10.0, high))]
        start = np.clip(np.full(len(unit) + 1, 1e-3), *bounds)
        return float(np.sqrt(2 * least_squares(residuals, start, bounds=bounds).cost))

    none = np.zeros(0)
    return nearest(low, high, sd) / nearest(none, none, none)


@pytest.mark.parametrize("name", FAMILIES["measurement"])
@pytest.mark.long
def test_reality_errs_in_a_form_of_its_own(name: str) -> None:
    made = [CATALOGUED[name](np.random.default_rng(seed))(1.0) for seed in range(DRAWS)]
    residual = float(np.median([residual_of_the_twins(name, each) for each in made]))
    assert residual > COPIED
    assert (residual < LEAST_RESIDUAL) == (name in LITTLE_ELSE)


@pytest.mark.parametrize(
    ("name", "copied"),
    [
        ("scale_error", ScaleError(0.0, 0.003)),
        ("marker_offset", MarkerOffset((("tail_3", 0.004 - 0.002j),), glued=1.0)),
        *later(
            ("head_frame_misalignment", HeadFrameMisalignment(1e-6, 0.003, -0.001)),
            ("lens_distortion", LensDistortion(0.03, 0.0, 0.0, 0.0)),
            ("time_base_error", TimeBaseError(0.02, 0.0, 0.0)),
            ("tracker_drift", TrackerDrift((("tail_1", 1e-4),), 0.0, seed=1)),
        ),
    ],
)
def test_what_the_twin_s_form_is_in_reality_too_is_found_out(name: str, copied: Mechanism) -> None:
    """Reality's mechanisms with nothing in them that is not the twin's."""
    assert residual_of_the_twins(name, (copied,)) < COPIED
