"""An effect that no catalogue holds is placed at the stage where it acts, whatever the form of its law."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from diagnosis.places import ForceResponses
from diagnosis.unknown_effects import all_faster, stage_probabilities, unknown_effects
from diagnosis.where import decompose
from fitting.signatures import signature_of
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.effect import Effect, Parameter, Plates, StepForce, StepState
from swimcal.effects.measurement import MarkerOffset
from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec
from swimcal.session_file import TrialKind
from tests.cases import later
from tests.diagnosis.linear_models import CAMERA, linear

pytestmark = pytest.mark.filterwarnings("error")


class _Unheard(Effect):
    """An effect in no catalogue, with one strength."""

    stage = "body"
    physics = source = "A test."
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"swim"})
    parameters = (Parameter("strength", "1", 0.0, 10.0, 1.0),)


class RootDrag(_Unheard):
    """Water that resists by the root of the speed across each plate of the tail."""

    name, family = "root_drag", "fluid"

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:
        plates = Plates(robot, scene)

        def force(state: StepState) -> np.ndarray:
            motion = plates.motion(state.position, state.velocity)
            across = np.imag(motion.along.conj() * motion.velocity)
            drag = -0.05 * values * np.sign(across) * np.sqrt(np.abs(across))
            drag[:, 0] = 0.0
            return plates.generalised(1j * drag * motion.along, motion)

        return force


class StopInAHinge(_Unheard):
    """A stop that the third hinge runs into."""

    name, family = "stop_in_a_hinge", "structure"

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        at = 4 + list(robot.hinges).index("tail_3")

        def force(state: StepState) -> np.ndarray:
            angle, torque = state.position[:, at], np.zeros_like(state.velocity)
            torque[:, at] = -values[:, 0] * (angle - np.clip(angle, -0.05, 0.05))
            return torque

        return force


class JerkyPull(_Unheard):
    """Tendons that pull at once when the crank passes the middle, in all hinges alike."""

    name, family = "jerky_pull", "tendons"

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        def force(state: StepState) -> np.ndarray:
            torque = np.zeros_like(state.velocity)
            torque[:, 4:] = 0.01 * values * np.tanh(np.sin(state.position[:, 3]) / 0.2)[:, None]
            return torque

        return force


def placed(effect: Effect, values: np.ndarray, pushed: ForceResponses, length: float) -> tuple[dict[str, float], str]:
    """The probability of each stage, and that with most of the gap."""
    row = signature_of(effect, linear().model, CAMERA, linear().at, values).rows[0]
    other = replace(linear())
    row = length * row / np.linalg.norm(other.space.projected(row))
    other.__dict__["residual"] = linear().residual + row
    members = unknown_effects(other, pushed, [])
    chances = stage_probabilities(other, members)
    likeliest = max(chances, key=lambda stage: chances[stage])
    shares = dict(decompose(other, pushed, [], unknown=members[likeliest]).shares.by_stage)
    shares.pop("floor")
    return chances, max(shares, key=lambda stage: shares[stage])


@pytest.mark.parametrize("length", [15.0, *later(40.0)])
@pytest.mark.parametrize(
    ("effect", "stage", "of_gap"),
    [
        (RootDrag(), "water", "body"),
        (StopInAHinge(), "structure", "tail"),
        (JerkyPull(), "tendons", "tail"),
    ],
    ids=lambda each: each.name if isinstance(each, Effect) else "",
)
def test_it_is_placed_where_it_acts(
    effect: Effect, stage: str, of_gap: str, length: float, pushed: ForceResponses
) -> None:
    chances, most = placed(effect, np.array([[1.0]]), pushed, length)
    assert chances[stage] == max(chances.values()) > 0.6
    assert most == of_gap


def test_beats_that_are_all_slower_than_commanded_do_not_hide_where_the_rest_acts(pushed: ForceResponses) -> None:
    row = signature_of(RootDrag(), linear().model, CAMERA, linear().at, np.array([[1.0]])).rows[0]
    other = replace(linear())
    slower = -25.0 * all_faster(other)[:, 0]
    assert np.linalg.norm(other.space.projected(slower)) > 80.0
    other.__dict__["residual"] = linear().residual + 20.0 * row / np.linalg.norm(other.space.projected(row)) + slower
    assert stage_probabilities(other, unknown_effects(other, pushed, []))["water"] > 0.6


def test_a_clock_moves_beats_alone_and_a_crank_its_log_too() -> None:
    trials = [SimpleNamespace(frequency=SimpleNamespace(hz=hz)) for hz in (1.0, 2.0)]
    model = SimpleNamespace(logged=(1,), measured=np.zeros(3))
    clock, crank = all_faster(SimpleNamespace(trials=trials, model=model, residual=np.zeros(6))).T  # type: ignore[arg-type]
    assert clock.tolist() == [0, 0, 0, 0.01, 0.02, 0]
    assert crank.tolist() == [0, 0, 0, 0.01, 0.02, 0.02]


def test_a_marker_that_sits_elsewhere_is_the_cameras(pushed: ForceResponses) -> None:
    effect = MarkerOffset(FISHSIM_MARKERS)
    values = np.zeros((1, len(effect.parameters)))
    values[0, [parameter.name for parameter in effect.parameters].index("tail_3_across")] = 0.03
    chances, most = placed(effect, values, pushed, 20.0)
    assert chances["camera"] > 0.9
    assert most == "camera"


def test_where_noise_is_all_no_stage_is_likely(pushed: ForceResponses) -> None:
    chances = stage_probabilities(linear(), unknown_effects(linear(), pushed, []))
    assert sum(chances.values()) < 0.5
