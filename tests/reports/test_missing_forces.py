"""Missing forces have the size that their harmonics have, and go with the motion that makes them."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.result import MissingForces
from fitting.calibration import CalibratedTrial
from fitting.pool import waves
from reports import gap
from reports.gap_figures import likenesses, motions, seen
from reports.report import render_report
from swimcal.results import to_plain
from swimcal.robot import load_robot
from tests.fitting.swims import filmed
from tests.reports.diagnoses import FITTED, JOINTS, made_diagnosed, made_forces
from tests.reports.sample import made_context, made_trial

ROBOT = load_robot()


def test_missing_forces_have_the_size_and_the_course_of_their_harmonics() -> None:
    forces = made_forces(0.004, 0.001)
    mean, sd = forces.over(np.array([0.0, np.pi / 2]))

    np.testing.assert_allclose(mean[0, -1], [0.004, 0.0], atol=1e-12)
    np.testing.assert_allclose(sd[0, -1], 0.001 * np.sqrt(1 + 3), atol=1e-12)
    assert forces.size[-1] == pytest.approx(0.004 / np.sqrt(2))
    assert forces.clear[0] == 0.0


@pytest.mark.parametrize(
    ("motion", "sign"), [("deflection", -1.0), ("speed", -1.0), ("acceleration", 1.0)], ids=["spring", "damper", "mass"]
)
def test_a_torque_goes_with_the_motion_that_makes_it(motion: str, sign: float) -> None:
    """In two swims of different frequency: a spring and a mass are in phase, and reported apart all the same."""
    trials = [gently(made_trial(ROBOT, name, seconds=10.0)) for name in FITTED]
    mean = np.zeros((len(FITTED), len(JOINTS), 7))
    for place, trial in enumerate(trials):
        kept = trial.measured.kept
        time_s = trial.measured.time_s[kept]
        bend = motions(trial, kept, ROBOT)[JOINTS[-1]]
        rates = {"deflection": bend, "speed": np.gradient(bend, time_s)}
        rates["acceleration"] = np.gradient(rates["speed"], time_s)
        turn = trial.phase_rad + 2 * np.pi * trial.simulated_hz * time_s
        columns = np.column_stack([np.ones(len(turn)), waves(turn, 3)])
        mean[place, -1] = sign * 0.01 * np.linalg.lstsq(columns, rates[motion], rcond=None)[0]

    like = likenesses(MissingForces(JOINTS, FITTED, mean, 0 * mean), trials, ROBOT)

    assert like[JOINTS[-1]].motions == (motion,)
    assert like[JOINTS[-1]].correlation == pytest.approx(sign, abs=0.02)
    assert like["head_moment"].correlation == 0.0, "nothing is missing there"


def test_a_bent_hinge_is_read_off_the_markers() -> None:
    """All that lies behind the third hinge is turned by 0.2 rad."""
    trial = made_trial(ROBOT, "fast")
    markers = tuple(ROBOT.markers)
    place = ROBOT.marker_positions_m(markers)
    behind = np.maximum(place[:, 0] - ROBOT.hinge_x_m[2], 0.0)
    shape = np.stack([place[:, 0] - behind * (1 - np.cos(0.2)), place[:, 1] + behind * np.sin(0.2)], axis=1)
    shapes = np.broadcast_to(shape - shape[markers.index("nose")], (len(trial.measured.time_s), *shape.shape))
    seen = replace(trial.measured.head, shape_m=shapes)
    bent = replace(
        trial,
        measured=replace(trial.measured, tracks=filmed(markers, trial.measured.time_s, shapes, seen)),
        simulated=replace(trial.simulated, shape_m=shapes),
    )

    found = motions(bent, trial.measured.kept, ROBOT)

    assert sum(found[hinge][0] for hinge in ROBOT.hinges) == pytest.approx(0.2, abs=1e-3)
    assert max(ROBOT.hinges, key=lambda hinge: found[hinge][0]) == ROBOT.hinges[2]


def gently(trial: CalibratedTrial) -> CalibratedTrial:
    """A fifth of its sway, so that three harmonics hold the beat of every hinge."""
    return replace(trial, simulated=replace(trial.simulated, shape_m=trial.simulated.shape_m * [1.0, 0.2]))


def test_forces_that_would_print_as_zero_are_left_out_with_their_table_and_figure() -> None:
    small, none = made_forces(0.004), made_forces(1e-7)
    assert [small.joints[place] for place in seen(small)] == [small.joints[-1]]
    context = made_context()
    for forces, shows in ((small, True), (none, False)):
        diagnosed = made_diagnosed("named", missing_forces=to_plain(forces))
        page = render_report(replace(context, diagnosed=diagnosed), (gap.build_gap,))
        assert ('id="gap-forces"' in page) == shows
        assert ("Size of each missing force" in page) == shows
        assert "0.00 mN" not in page
