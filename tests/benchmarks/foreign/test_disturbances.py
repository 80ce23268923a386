"""Sessions are drawn alike each time, and every disturbance does what it says."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.foreign import disturbances
from benchmarks.foreign.disturbances import KINDS, apply, disturb
from benchmarks.foreign.judge import true_speeds
from benchmarks.foreign.recordings import Recording, Recordings
from swimcal.motor_log import MOTOR_COLUMNS, MotorCommands, MotorLog
from tests.benchmarks.foreign.handmade import FPS, MARKERS, PX_PER_M, SPEED_M_S, session, swim

NAMES = {kind.name: kind for kind in KINDS}
PLAIN = session()


def one(name: str, seed: int = 0, *, role: str = "fit") -> tuple[Recordings, Recording, Recording]:
    """A session of one trial with one disturbance; the trial, and the same trial undisturbed."""
    before, after = session(swim("swim_a", 1.0, role)), session(swim("swim_a", 1.0, role), filmed=False)
    kind, random = NAMES[name], np.random.default_rng(seed)
    if kind.in_pool:
        apply(after, kind, random)
    after.trials[0].film(FPS, after.tracker, np.random.default_rng(0), after.varied)
    if not kind.in_pool:
        apply(after, kind, random)
    return after, after.trials[0], before.trials[0]


def unseen(trial: Recording) -> np.ndarray:
    return np.isnan(trial.xy[..., 0])


def test_a_session_is_disturbed_alike_each_time() -> None:
    twins = [session(filmed=False), session(filmed=False)]
    for each in twins:
        disturb(each, 4, np.random.default_rng(4))
    assert twins[0].disturbances == twins[1].disturbances != []
    for one_of, other in zip(twins[0].trials, twins[1].trials, strict=True):
        np.testing.assert_array_equal(one_of.xy, other.xy)


def test_every_third_session_is_clean_and_the_others_go_round_all_kinds() -> None:
    firsts = set()
    for number in range(2 * len(KINDS)):
        made = session(filmed=False)
        disturb(made, number, np.random.default_rng(number))
        assert bool(made.disturbances) <= bool(number % 3)
        assert len(made.disturbances) <= 3
        firsts |= {made.disturbances[0].split(":")[0]} if number % 3 and made.disturbances else set()
    assert len(firsts) > 0.6 * len(KINDS)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_every_kind_changes_the_session_and_says_of_which_trial(kind: disturbances.Disturbance, tmp_path: Path) -> None:
    made = session(filmed=False)
    _with_log(made)
    if kind.in_pool:
        apply(made, kind, np.random.default_rng(1))
    for trial in made.trials:
        trial.film(FPS, made.tracker, np.random.default_rng(0), made.varied)
    plain = session()
    if not kind.in_pool:
        apply(made, kind, np.random.default_rng(1))
    _with_log(plain)
    assert made.disturbances[0].startswith(f"{kind.name}: swim_")
    for folder, each in (("made", made), ("plain", plain)):
        each.write(tmp_path / folder / "session")
    files = [path.relative_to(tmp_path / "made") for path in (tmp_path / "made").rglob("*.*")]
    files = [path for path in files if path.name != "disturbances.json"]
    pairs = [(tmp_path / "made" / path, tmp_path / "plain" / path) for path in files]
    assert any(not other.is_file() or one.read_bytes() != other.read_bytes() for one, other in pairs)


def _with_log(made: Recordings) -> None:
    time_s = np.arange(200) / 100
    columns = {name: np.zeros(200) for name in MOTOR_COLUMNS} | {"time_s": time_s, "position_rad": 6.0 * time_s}
    commands = MotorCommands(np.array([0.0, 1.0]), ("rest", "drive"), np.array([0.0, 6.0]))
    made.trials[0].log = MotorLog(**columns), commands


def test_the_true_speed_is_that_of_the_swim_by_every_definition() -> None:
    low, high, length_s = true_speeds(PLAIN, PLAIN.trials[0])
    assert low == pytest.approx(SPEED_M_S, rel=1e-6)
    assert high == pytest.approx(SPEED_M_S, rel=1e-6)
    assert length_s == pytest.approx(7.0)
    held_out = PLAIN.trials[1]  # 1 Hz: two beats are known
    assert true_speeds(PLAIN, held_out)[2] == pytest.approx(6.0)


@pytest.mark.parametrize("factor", [-1.0, 0.0, 0.5, 1.5])
def test_a_current_changes_the_true_speed_by_its_factor(factor: float) -> None:
    seeds = (seed for seed in range(40) if f"{factor:g} times" in one("current", seed)[0].disturbances[0])
    made, trial, _ = one("current", next(seeds))
    assert true_speeds(made, trial)[0] == pytest.approx(factor * SPEED_M_S, abs=1e-6)
    assert bool(trial.said) == (factor <= 0)


def test_a_turning_swim_keeps_its_speed_along_the_head_and_bends() -> None:
    made, trial, before = one("turns")
    low, high, _ = true_speeds(made, trial)
    assert high == pytest.approx(SPEED_M_S, rel=0.01)
    assert 0.9 * SPEED_M_S < low < 0.99 * SPEED_M_S  # along its mean heading: a chord
    first, last = (trial.xy[i, 1] - trial.xy[i, 0] for i in (0, -1))
    assert np.degrees(np.arccos(first @ last / np.linalg.norm(first) / np.linalg.norm(last))) > 30
    assert np.linalg.norm(np.diff(before.xy[:, :2], axis=1), axis=-1).std() < 1.0


def test_a_fast_beat_is_the_same_motion_as_far_per_beat() -> None:
    made, trial, _ = one("beats_fast")
    assert 5.0 <= trial.hz <= 8.0
    assert true_speeds(made, trial)[0] == pytest.approx(SPEED_M_S * trial.hz, rel=1e-3)
    assert np.ptp(trial.pool_s) >= 5.0
    tail = trial.pool_px[:, -1, 1] - trial.pool_px[:, -1, 1].mean()
    spectrum = np.abs(np.fft.rfft(tail))
    assert np.fft.rfftfreq(len(tail), trial.pool_s[1])[spectrum.argmax()] == pytest.approx(trial.hz, rel=0.05)


def test_a_growing_picture_changes_the_distance_of_nose_and_neck_but_not_the_true_speed() -> None:
    made, trial, before = one("scale_drifts")
    apart = np.linalg.norm(trial.xy[:, 1] - trial.xy[:, 0], axis=1)
    assert apart[-30:].mean() / apart[:30].mean() == pytest.approx(1 + trial.growth, abs=0.005)
    assert true_speeds(made, trial) == true_speeds(made, before)


@pytest.mark.parametrize("name", ["rests_first", "rests", "stops"])
def test_a_robot_that_rests_does_not_move_for_a_while(name: str) -> None:
    _, trial, before = one(name)
    still = np.abs(np.diff(trial.pool_px[:, -1, 1])) < 1e-9
    assert still.sum() > 200
    assert still[:200].all() == (name != "stops")
    assert trial.said
    assert (trial.pool_s[-1] > before.pool_s[-1]) == (name != "rests")


def test_what_is_unseen_is_unseen_where_it_says() -> None:
    for name, share in (("tail_gap", (0.19, 0.61)), ("head_gap", (0.19, 0.51)), ("all_gap", (0.1, 0.14))):
        gone = unseen(one(name)[1])
        markers = gone.any(axis=0)
        assert markers.sum() == (len(MARKERS) if name == "all_gap" else 1)
        assert markers[:2].any() == (name != "tail_gap")
        assert share[0] < gone[:, markers].mean() < share[1]
    _, trial, _ = one("tail_never_compared")
    assert unseen(trial)[60:].any(axis=0).sum() == 1
    assert not unseen(trial)[:40].any()
    assert 2 <= (~unseen(one("tail_in_few_frames")[1])).sum(axis=0).min() <= 12
    assert 0.4 < unseen(one("tail_on_one_side")[1]).mean(axis=0).max() < 0.6
    _, trial, _ = one("head_in_first_beats")
    assert unseen(trial)[1:120, :2].any(axis=1).all()
    assert not unseen(trial)[[0, 130]].any()


def test_a_robot_leaves_the_picture_nose_first_and_does_not_come_back() -> None:
    gone = unseen(one("leaves")[1])
    firsts = np.where(gone.any(axis=0), gone.argmax(axis=0), len(gone))
    assert firsts[0] == firsts.min() < len(gone)
    assert gone[-1].any()
    assert (np.diff(gone.astype(int), axis=0) >= 0).all()


def test_a_held_out_trial_is_blank_after_its_two_beats() -> None:
    made, trial, _ = one("blank_once_held_out", role="holdout")
    assert unseen(trial)[121:].all()
    assert not unseen(trial)[:119].any()
    assert trial.said
    assert not made.refused


def test_a_misplaced_marker_is_30_mm_off_throughout() -> None:
    _, trial, before = one("tail_misplaced")
    off = np.linalg.norm(trial.xy - before.xy, axis=-1)
    np.testing.assert_allclose(np.sort(off.max(axis=0)), [0, 0, 0, 0, 0.03 * PX_PER_M], atol=1e-9)


def test_exchanged_markers_are_exchanged() -> None:
    _, trial, before = one("head_exchanged")
    np.testing.assert_array_equal(trial.xy[:, [1, 0]], before.xy[:, [0, 1]])
    _, trial, before = one("tail_swapped")
    other = np.flatnonzero((trial.xy != before.xy).any(axis=(1, 2)))
    assert len(other) == np.ptp(other) + 1
    assert 0.03 < len(other) / len(trial.xy) < 0.27


def test_clocks_go_wrong_as_they_say() -> None:
    assert (np.diff(one("stamps_jitter")[1].time_s) > 0).all()
    assert 0 < np.std(np.diff(one("stamps_jitter")[1].time_s)) < 1 / FPS
    _, trial, before = one("frames_dropped")
    assert set(trial.time_s) < set(before.time_s)
    assert (np.diff(one("frames_doubled")[1].xy, axis=0) == 0).all(axis=(1, 2)).sum() > 3
    made, trial, _ = one("stamps_repeated")
    assert (np.diff(trial.time_s) == 0).any()
    assert made.refusable
    assert np.ptp(one("milliseconds")[1].time_s) == pytest.approx(8000.0)
    _, trial, before = one("frames_uneven")
    assert np.ptp(trial.time_s) == pytest.approx(np.ptp(before.time_s))
    assert np.std(np.diff(trial.time_s)) > 0.01 / FPS


def test_an_unusable_trial_stands_beside_the_others() -> None:
    found = {}
    for seed in range(20):
        made, trial, _ = one("unusable_beside", seed)
        found[made.disturbances[0].split(": ")[-1]] = made.trials[1]
        assert np.isfinite(trial.xy).all()
    assert np.isnan(found["empty"].xy).all()
    assert len(found["five frames"].time_s) == 5
    assert np.std(found["noise"].xy, axis=0).min() > 200


def test_readings_a_turn_off_are_a_turn_off() -> None:
    made = session()
    _with_log(made)
    log = made.trials[0].log
    assert log is not None
    apply(made, NAMES["log_misread"], np.random.default_rng(0))
    misread = made.trials[0].log
    assert misread is not None
    off = (misread[0].position_rad - log[0].position_rad) / (2 * np.pi)
    assert 1 <= (np.abs(off) > 0.5).sum() <= 8
    np.testing.assert_allclose(np.abs(off[np.abs(off) > 0.5]), 1.0)
    made.trials[0].log = log
    apply(made, NAMES["log_modulo"], np.random.default_rng(0))
    wrapped = made.trials[0].log
    assert wrapped is not None
    assert np.ptp(wrapped[0].position_rad) < 2 * np.pi < np.ptp(log[0].position_rad)


def test_what_the_file_says_wrong_is_in_the_file(tmp_path: Path) -> None:
    made, _, _ = one("scale_in_other_unit")
    made.write(tmp_path / "scale")
    assert (
        f"scale_length_m = {made.scale_factor * made.robot.scale_length_m:.6g}"[:22]
        in (tmp_path / "scale" / "session.toml").read_text()
    )
    assert made.refused
    made, _, _ = one("command_missing")
    made.write(tmp_path / "command")
    assert "commanded_hz" not in (tmp_path / "command" / "session.toml").read_text()
    made, trial, _ = one("command_wrong")
    assert abs((trial.commanded_hz or np.nan) / trial.hz - 1) == pytest.approx(0.1)
    made, trial, _ = one("nothing_to_fit")
    assert trial.role == "holdout"
    assert made.refused
