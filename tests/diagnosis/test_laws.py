"""Forces that go with how a place moves are what the simulation makes of them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from diagnosis.discrepancy import discrepancy_for
from diagnosis.evidence import Belief
from diagnosis.explaining import explained
from diagnosis.ground import Ground
from diagnosis.laws import Law, laws
from diagnosis.pushes import Responses, responses
from diagnosis.strangers import strangers
from fitting.signatures import signature_of
from session.create import FISHSIM_MARKERS
from session.session_file import TrialKind
from swimmer.effects import Effect, Parameter, StepForce, StepState
from swimmer.effects.structure import JointDamping
from swimmer.mjcf import Scene
from swimmer.robot import RobotSpec
from tests.diagnosis.grounds import AT, CAMERA, dry_run, ground, trials
from tests.fitting.exact_swims import ROBOT

HINGE, FIRST_HINGE = 1, 4  # of the hinges; after surge, sway, yaw and crank
STRONG = {  # N m/rad, N m s/rad, N s2/m2; of each of twelve places N s2/m2, kg
    ("hinge tail_2", "its angle"): -0.006,
    ("hinge tail_2", "its rate"): 0.002,
    ("head", "the square of its speed across"): 2.0,
    ("whole tail", "the square of the speed of its parts"): 0.2,
    ("whole tail", "the acceleration of its parts"): 0.001,
}


class OfALaw(Effect):
    """One force that goes with the state, told by a hand that knows nothing of harmonics."""

    name = "of_a_law"
    family = "structure"
    stage = "tail"
    physics = "One force."
    source = "This test."
    parameters = (Parameter("strength", "-", -10.0, 10.0, 1.0),)
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"swim", "dry"})

    def __init__(self, goes_with: str) -> None:
        self.goes_with = goes_with

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        """On the second hinge, on all of them, or across the head."""

        def force(state: StepState) -> np.ndarray:
            result = np.zeros_like(state.velocity)
            if self.goes_with == "its angle":
                result[:, FIRST_HINGE + HINGE] = values[:, 0] * state.position[:, FIRST_HINGE + HINGE]
            elif self.goes_with == "all angles":
                result[:, FIRST_HINGE:] = values[:, :1] * state.position[:, FIRST_HINGE:]
            elif self.goes_with == "its rate":
                result[:, FIRST_HINGE + HINGE] = values[:, 0] * state.velocity[:, FIRST_HINGE + HINGE]
            elif self.goes_with in TAIL:
                on_places = values[:, :1] * TAIL[self.goes_with](state)
                result = np.einsum("nvp,np->nv", jacobian(state.position)[0].conj(), on_places).real
            else:
                cos, sin = np.cos(state.position[:, 2]), np.sin(state.position[:, 2])
                across = cos * state.velocity[:, 1] - sin * state.velocity[:, 0]
                push = values[:, 0] * across * np.abs(across)
                result[:, 0], result[:, 1] = -sin * push, cos * push
            return result

        return force


def jacobian(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How twelve places along the bent tail move with each coordinate (n, v, 12), and how these head (n, 12).

    In the plane as complex numbers; the crank moves none.
    """
    hinge_m = ROBOT.hinge_x_m
    place_m = np.linspace(hinge_m[0], ROBOT.fin_root_x_m + ROBOT.caudal_fin.centre_m, 12)
    heading = np.cumsum(np.column_stack([position[:, 2], position[:, FIRST_HINGE:]]), axis=1)  # of head and segments
    starts = np.concatenate([[0.0], hinge_m])
    joint = np.cumsum(np.exp(1j * heading[:, :-1]) * np.diff(starts), axis=1)
    joint = np.column_stack([np.zeros(len(joint)), joint])  # (n, 1 + h)
    last = np.searchsorted(hinge_m, place_m, side="left")  # number of the part that a place is on
    place = joint[:, last] + np.exp(1j * heading[:, last]) * (place_m - starts[last])
    ahead = np.arange(len(starts))[:, None] <= last
    turned = np.where(ahead, 1j * (place[:, None] - joint[:, :, None]), 0.0)
    moved = np.zeros((*position.shape, 12), complex)
    moved[:, 0], moved[:, 1], moved[:, 2], moved[:, FIRST_HINGE:] = 1.0, 1j, turned[:, 0], turned[:, 1:]
    return moved, heading[:, last]


def moving(position: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """(n, 12) velocities of the places."""
    return np.einsum("nvp,nv->np", jacobian(position)[0], speed)


def drag(state: StepState) -> np.ndarray:
    """(n, 12) complex, the square of the speed across itself of each place, across it."""
    normal = 1j * np.exp(1j * jacobian(state.position)[1])
    across = (moving(state.position, state.velocity) * normal.conj()).real
    return np.asarray(across * np.abs(across) * normal)


def inertia(state: StepState) -> np.ndarray:
    """(n, 12) complex, the acceleration of each place."""
    before, after = (moving(state.position + step * state.velocity, state.velocity) for step in (-1e-5, 1e-5))
    return np.asarray(moving(state.position, state.acceleration) + (after - before) / 2e-5)


TAIL = {"the square of the speed of its parts": drag, "the acceleration of its parts": inertia}


@pytest.fixture(scope="module")
def known(pushed: Responses) -> dict[tuple[str, str], Law]:
    return {(law.place, law.goes_with): law for law in laws(ground(), pushed)}


def shown(goes_with: str, strength: float) -> np.ndarray:
    """(k,) what a force of a law does to the row, over its strength."""
    at = ground()
    return signature_of(OfALaw(goes_with), at.model, CAMERA, at.at, np.array([[strength]])).rows[0] / strength


@pytest.mark.parametrize(("place", "goes_with"), list(STRONG))
def test_a_law_does_to_the_row_what_its_force_does_in_the_simulation(
    known: dict[tuple[str, str], Law], place: str, goes_with: str
) -> None:
    law = known[place, goes_with].columns.sum(axis=1)[:, 0]
    space = ground().space
    told, simulated = space.freed(law), space.freed(shown(goes_with, STRONG[place, goes_with]))
    cosine = told @ simulated / (np.linalg.norm(told) * np.linalg.norm(simulated))
    assert cosine > (0.94 if goes_with == "the acceleration of its parts" else 0.95)
    assert np.linalg.norm(told) == pytest.approx(np.linalg.norm(simulated), rel=0.25)


def test_air_drags_no_tail_but_mass_acts_in_it_too() -> None:
    twin = ground().twin
    at = Ground.of(trials(), twin, CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), AT, [dry_run()])
    found = {law.goes_with: law.columns[:, -1, 0] for law in laws(at, responses(at)) if law.place == "whole tail"}
    assert at.model.trials[-1].twin.scene.head_clamped
    assert not found["the square of the speed of its parts"].any()
    assert found["the acceleration of its parts"].any()


@pytest.mark.parametrize(
    ("weaker", "told"),
    [("its angle", ("hinge tail_2", "its angle")), ("all angles", ("whole tail", "its angle"))],
)
def test_hinges_whose_springs_are_weaker_are_told_as_that(weaker: str, told: tuple[str, str]) -> None:
    assert likeliest_of(shown(weaker, 0.02)) == told


def likeliest_of(gap: np.ndarray) -> tuple[str, str]:
    """Where a gap (k,) surely is that is clearly seen, and what it goes with, by a catalogue that does not hold it."""
    at = ground()
    gap = gap * 12.0 / np.linalg.norm(at.space.freed(gap))
    here = type(at)(**{name: getattr(at, name) for name in at.__dataclass_fields__})
    here.__dict__.update(left=at.left + gap, slopes=at.slopes, generic=at.generic)
    elsewhere = strangers(here, responses(at))
    effects = [signature_of(JointDamping(), at.model, CAMERA, at.at)]
    found = explained(here, effects, Belief(), elsewhere).probabilities
    likeliest = elsewhere[int(np.argmax(found.at_place))]
    assert found.with_other > 0.98
    return likeliest.place, likeliest.goes_with
