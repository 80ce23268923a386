"""What the effects of the drive do to the crank."""

import numpy as np
import pytest

from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Drive, Effect
from swimcal.mjcf import DRY
from swimcal.runs import Turn
from swimcal.twin import Twin
from tests.swimcal.robots import FISH

RIPPLE = catalogue()["motor_speed_ripple"]
SAG = catalogue()["motor_speed_sag"]
DELAY = catalogue()["motor_start_delay"]

TIME_S = np.linspace(0.0, 6.0, 2401)
SPEED = 2 * np.pi * 0.8
EVEN = Drive(0.8, 0.4, None)


def turn_with(effect: Effect, *values: float, drive: Drive = EVEN) -> Turn:
    turn = effect.drive(drive, np.array(values)).turn
    assert turn is not None
    return turn


def crank_with(effect: Effect, *values: float, time_s: np.ndarray) -> np.ndarray:
    """(f,) of a dry run of the twin at 0.8 Hz from phase 0.4."""
    twin = AffectedTwin(Twin(FISH, scene=DRY, workers=1), [effect])
    one = AffectedRuns(np.ones((1, 5)), np.array([0.8]), np.array([0.4]), values=np.array([values]))
    return twin.simulate(one, time_s).crank_rad[0]


@pytest.mark.parametrize(
    ("effect", "values"), [(RIPPLE, (0.2, -0.1)), (SAG, (0.0, 0.2)), (DELAY, (0.3,))], ids=["ripple", "sag", "delay"]
)
def test_the_speed_of_a_turn_is_the_derivative_of_its_angle(effect: Effect, values: tuple[float, ...]) -> None:
    rippled = RIPPLE.drive(EVEN, np.array([0.3, 0.1]))
    for drive in (EVEN, rippled):
        turn = turn_with(effect, *values, drive=drive)
        np.testing.assert_allclose(np.gradient(turn.angle(TIME_S), TIME_S)[1:-1], turn.speed(TIME_S)[1:-1], atol=0.01)
        assert turn.angle(np.zeros(1))[0] == 0.0


def test_the_share_of_speed_lost_to_the_load_grows_with_the_square_of_the_command() -> None:
    slow, fast = (1 - SAG.turned_hz(f, np.array([0.01, 0.0])) / f for f in (0.5, 1.5))
    assert fast / slow == pytest.approx(9.0, rel=0.03)
    assert fast == pytest.approx(0.01 * 1.5**2, rel=0.03)
    assert SAG.drive(EVEN, np.array([0.01, 0.0])) is EVEN


def test_a_warming_motor_slows_down_about_the_measured_speed() -> None:
    turn, share = turn_with(SAG, 0.0, 0.1), 0.1
    speed = turn.speed(TIME_S)
    assert (np.diff(speed) < 0).all()
    assert speed[0] - turn.speed(np.array([1e3]))[0] == pytest.approx(share * SPEED)
    assert turn.angle(np.array([5.0]))[0] == pytest.approx(5.0 * SPEED)


def test_a_ripple_advances_the_crank_by_the_integral_of_the_speed() -> None:
    """In the twin: (sin 2 phi - sin 2 phi_0) / 2 times the cosine's share of the speed, phi of the even turn."""
    time_s, cosine = np.linspace(0.0, 2.0, 41), 0.1
    even = 0.4 + SPEED * time_s
    found = crank_with(RIPPLE, cosine, 0.0, time_s=time_s)
    np.testing.assert_allclose(found - even, cosine / 0.8 * (np.sin(2 * even) - np.sin(0.8)) / 2, atol=2e-3)


def test_a_late_motor_rests_and_then_turns_as_it_would_have() -> None:
    time_s, delay = np.linspace(0.0, 2.0, 81), 0.4
    found = crank_with(DELAY, delay, time_s=time_s)
    np.testing.assert_allclose(found[time_s <= 0.75 * delay], 0.4, atol=1e-3)
    late = time_s >= 1.25 * delay
    np.testing.assert_allclose(found[late], 0.4 + SPEED * (time_s[late] - delay), atol=0.01)


def test_effects_act_on_a_measured_turn_too() -> None:
    """A late, rippled turn is the rippled one, later."""
    rippled = RIPPLE.drive(EVEN, np.array([0.3, 0.0]))
    assert rippled.turn is not None
    late = turn_with(DELAY, 0.2, drive=rippled)
    np.testing.assert_allclose(late.angle(TIME_S[200:]), rippled.turn.angle(TIME_S[200:] - 0.2), atol=1e-12)
