"""An effect that gives an array of another shape than it should is named, with what was found and expected."""

import numpy as np
import pytest

from swimcal.effects.effect import Effect, Observation, StepForce, StepState
from swimcal.effects.tendons import CrankArmError
from swimcal.errors import InputError
from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec
from tests.swimcal.effects.swims import COUNT, PLAIN, TIME_S, plain_runs, with_effect

FRAMES, MARKERS = len(TIME_S), len(PLAIN.markers)


class CutsFrames(CrankArmError):
    name = "cuts_frames"

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:  # noqa: ARG002
        return seen.marker_m[1:]


class ForgetsToReturn(CrankArmError):
    name = "forgets_to_return"

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:  # type: ignore[return]
        seen.marker_m + values[0]


class OneTime(CrankArmError):
    name = "one_time"

    def clock(self, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:  # noqa: ARG002
        return time_s[:1]


class OneForAll(CrankArmError):
    name = "one_for_all"

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        def push(state: StepState) -> np.ndarray:
            return 0 * state.velocity[0]

        return push


VELOCITIES = PLAIN.start(plain_runs())[1].shape[1]


@pytest.mark.parametrize(
    ("kind", "way", "found", "expected"),
    [
        (CutsFrames, "observe", f"({FRAMES - 1}, {MARKERS}, 2)", f"({FRAMES}, {MARKERS}, 2)"),
        (ForgetsToReturn, "observe", "None", f"({FRAMES}, {MARKERS}, 2)"),
        (OneTime, "clock", "(1,)", f"({FRAMES},)"),
        (OneForAll, "force", f"({VELOCITIES},)", f"({COUNT}, {VELOCITIES})"),
    ],
)
def test_an_effect_that_gives_another_shape_is_named(kind: type[Effect], way: str, found: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        with_effect(kind(), np.zeros(1))
    message = str(caught.value)
    assert message.startswith(f"effect {kind.name} ({__name__}.{kind.__name__}): {way}: it gives ")
    assert f"found {found}; expected an array of shape {expected}. Mend {kind.__name__}.{way}" in message
