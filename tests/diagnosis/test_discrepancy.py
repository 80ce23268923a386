"""What a refitted twin leaves of several swims where nothing is wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.discrepancy import save
from diagnosis.constants import COURSE_SD, SLIDE_SD_M_S
from diagnosis.discrepancy import Discrepancy, discrepancy_for
from fitting.features import SPEED, advance_phase
from fitting.session_model import SessionModel
from fitting.trial_model import START_PHASE_RAD, TrialModel
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import InputError
from swimcal.mjcf import DRY
from swimcal.twin import Twin
from tests.diagnosis.linear_models import dry_run, trials
from tests.fitting.exact_swims import ROBOT

HERTZ, PHASE_RAD = np.array([0.5, 0.55, 1.3]), np.array([0.0, 2.0, -1.0])
LENGTH = 1 + 14 * len(FISHSIM_MARKERS)


def drawn(everywhere: float, near: float) -> Discrepancy:
    directions = 1e-4 * np.random.default_rng(1).standard_normal((LENGTH, LENGTH))
    return Discrepancy(directions, np.tile([everywhere, near], (LENGTH, 1)))


@pytest.mark.long
def test_each_swim_varies_at_the_phase_at_which_its_tail_begins() -> None:
    known = drawn(0.5, 0.3)
    found = known.of_features(HERTZ, PHASE_RAD).reshape(3, LENGTH, 3, LENGTH)
    for i, phase in enumerate(PHASE_RAD):
        turned = advance_phase(known.directions.T, phase)
        assert found[i, :, i] == pytest.approx(turned.T @ turned, rel=1e-9)


def test_swims_of_like_frequencies_have_more_in_common() -> None:
    known = drawn(0.2, 0.6)
    found = known.of_features(HERTZ, np.zeros(3)).reshape(3, LENGTH, 3, LENGTH)
    alone = known.directions @ known.directions.T
    shares = [float(found[0, SPEED, other, SPEED] / alone[SPEED, SPEED]) for other in (0, 1, 2)]
    assert shares[0] == pytest.approx(1.0)
    assert 0.7 < shares[1] < 0.8
    assert 0.2 <= shares[2] < 0.25
    assert np.linalg.eigvalsh(known.of_features(HERTZ, PHASE_RAD)).min() > -1e-15


def test_runs_in_air_and_courses_have_nothing_in_common_with_swims() -> None:
    twin = Twin(ROBOT, FISHSIM_MARKERS, workers=1)
    clamped = Twin(ROBOT, FISHSIM_MARKERS, DRY, workers=1)
    runs = [(twin, trials()[0]), (twin, trials()[1]), (clamped, dry_run()), (clamped, dry_run())]
    model = SessionModel(tuple(TrialModel(own, trial, START_PHASE_RAD, with_course=True) for own, trial in runs))
    whole = LENGTH + len(FISHSIM_MARKERS) + 2
    found = drawn(0.5, 0.3).over(model).reshape(4, whole, 4, whole)
    assert np.abs(found[0, :, 1]).max() > 0
    assert np.abs(found[2, :, 3]).max() > 0
    assert np.abs(found[:2, :, 2:]).max() == 0
    of_course = [*(SLIDE_SD_M_S,) * len(FISHSIM_MARKERS), *COURSE_SD]
    assert found[1, LENGTH:, 1, LENGTH:] == pytest.approx(np.diag(np.square(of_course)))
    assert np.abs(found[0, LENGTH:, 1]).max() == 0


def test_of_another_marker_it_is_as_of_the_nearest_and_by_itself() -> None:
    robot = ROBOT.model_copy(update={"markers": {**ROBOT.markers, "bead": ROBOT.markers["tail_2"]}})
    shipped, found = discrepancy_for(FISHSIM_MARKERS, robot), discrepancy_for(("nose", "bead", "neck"), robot)
    place = FISHSIM_MARKERS.index("tail_2")
    ahead = float(np.angle(shipped.beat[place]))  # its beat is another than that of the whole tail
    assert abs(ahead) > 0.5
    known, told = shipped.of_features(HERTZ, PHASE_RAD - ahead), found.of_features(HERTZ, PHASE_RAD)
    known, told = known.reshape(3, LENGTH, 3, LENGTH), told.reshape(3, 43, 3, 43)
    own = slice(1 + 14 * place, 15 + 14 * place)
    assert told[:, 15:29, :, 15:29] == pytest.approx(known[:, own, :, own], abs=1e-12)
    assert np.abs(told[:, 15:29, :, :15]).max() == 0
    assert told[:, :15, :, :15] == pytest.approx(known[:, :15, :, :15], abs=1e-12)


def test_it_is_read_as_written_and_an_older_form_is_refused(tmp_path: Path) -> None:
    any_one = drawn(0.5, 0.3)
    beat = np.linspace(0.1, 1.0, 9) * (1 - 2j)
    known = replace(any_one, strengths={"fluid_memory": (0.1,), "bend_offset": ()}, beat=beat)
    save(known, tmp_path / "discrepancy.npz", [1, 2])
    found = Discrepancy.load(tmp_path / "discrepancy.npz")
    assert found.directions == pytest.approx(known.directions, rel=1e-6)
    assert found.common == pytest.approx(known.common, rel=1e-6)
    assert found.strengths == {"fluid_memory": (0.1,)}
    assert found.beat == pytest.approx(beat)
    np.savez(tmp_path / "older.npz", covariance=np.eye(2))
    with pytest.raises(InputError, match=r"older\.npz: not a discrepancy of today; found covariance.* suite anew"):
        Discrepancy.load(tmp_path / "older.npz")
