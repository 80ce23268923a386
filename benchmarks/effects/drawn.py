"""Withheld session before anything acts in it: a robot, its water, a camera, and the trials that were made."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.effects.filming import Filming
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.reality import Mechanism, Nuisances, Recording, Trial, World
from benchmarks.reality.mechanism import worn
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimsynth.plan import trial_name

KNOWN_TO = {"hinge_stiffness": 0.02, "hinge_damping": 0.05, "mass": 0.02}
"""Relative standard deviation of a robot from its description: that of dry experiments."""
GLUED_SD_M = 0.001  # A marker is off its place on the body by this, each way.
FLOATS_SD_M = 0.002
"""Standard deviation of how deep a robot floats, as trimmed that day; 8 to 10 cm of its tail are under water."""
_COEFFICIENTS = ((0.2, 1.5), (1.0, 6.0), (3.0, 9.0), (2.5, 6.0), (0.2, 3.0))  # Most such robots swim forward.
_HEADING_RAD = 0.35  # Headings are at most this far off the picture's long side, so that no swim leaves it.
TRIES = 12  # At most this many robots are drawn for a session.
_SLOWEST_M_S = 0.01  # A swim of the base state is at least this fast.
_TAIL_BENT_RAD = 0.2  # A free decay is held with this bend at each hinge.
_RELEASED_S = 0.4  # A free decay is let go at this time.
_DRY_S = 5.0  # A dry run lasts this long.
_DECAY_S = 4.0  # The film of a free decay lasts this long.


@dataclass(frozen=True, eq=False)
class DrawnTrial:
    """One trial of a session."""

    name: str  # name of the trial
    role: str  # "fit" or "holdout"
    trial: Trial  # trial as the second simulator makes it

    @property
    def commanded_hz(self) -> float | None:
        """Commanded speed of the crank; None where it does not turn."""
        return self.trial.frequency_hz or None


@dataclass(frozen=True, eq=False)
class DrawnWorld:
    """A session before anything acts in it."""

    plan: SessionPlan  # plan of what the session is to hold
    world: World  # world in its base state
    trials: tuple[DrawnTrial, ...]  # trials that are made in it

    def swims(self, role: str) -> tuple[DrawnTrial, ...]:
        """Return the swims that are fitted, or held out."""
        return tuple(each for each in self.trials if each.trial.kind == "swim" and each.role == role)

    def recorded(
        self, mechanisms: tuple[Mechanism, ...] = (), trials: Sequence[DrawnTrial] | None = None
    ) -> Filming[dict[str, Recording]]:
        """Film trials, and end with them by name, without any error of a tracker.

        Args:
            mechanisms: mechanisms that act.
            trials: some of the session's trials; default all.

        Raises:
            SimulationDiverged: the mechanisms are too strong.
        """
        trials = self.trials if trials is None else trials
        worlds = [replace(self.world, mechanisms=worn(mechanisms, self._sum_use_s(each))) for each in trials]
        recordings = yield [(world, each.trial) for world, each in zip(worlds, trials, strict=True)]
        return {each.name: recording for each, recording in zip(trials, recordings, strict=True)}

    def _sum_use_s(self, trial: DrawnTrial) -> float:
        """Return the time that the robot was in use before a trial, s."""
        return float(sum(each.trial.duration_s for each in self.trials[: self.trials.index(trial)]))


def draw_world(plan: SessionPlan) -> Filming[DrawnWorld]:
    """Draw robot, water and trials until every swim of the base state goes forward.

    Raises:
        ValueError: no draw swims forward.
    """
    sunk_m = FLOATS_SD_M * float(np.random.default_rng([plan.seed, 6]).standard_normal())
    return draw_until(plan, lambda random: sample_world(random, sunk_m), _draw_trials, swims_forward)


def draw_until(
    plan: SessionPlan,
    sample: Callable[[np.random.Generator], World],
    trials: Callable[[Recorded, np.random.Generator], tuple[DrawnTrial, ...]],
    plausible: Callable[[Recording], bool],
) -> Filming[DrawnWorld]:
    """Draw a world and trials until every swim of the base state is plausible.

    Raises:
        ValueError: no draw is.
    """
    random = np.random.default_rng([plan.seed, 2])
    for _ in range(TRIES):
        drawn = DrawnWorld(plan, sample(random), trials(plan.recorded, random))
        recordings = yield [(drawn.world, each.trial) for each in drawn.trials if each.trial.kind == "swim"]
        if all(map(plausible, recordings)):
            return drawn
    raise ValueError(f"session {plan.name}: found no robot that swims as fish do in {TRIES} draws, expected one in two")


def drawn_nuisances(random: np.random.Generator, sunk_m: float = 0.0) -> Nuisances:
    """Draw how a robot departs from its description."""

    def about_one(quantity: str) -> float:
        return float(1 + KNOWN_TO[quantity] * random.standard_normal())

    shift = GLUED_SD_M * random.standard_normal((len(FISHSIM_MARKERS), 2))
    return Nuisances(
        head_mass=about_one("mass"),
        tail_mass=about_one("mass"),
        hinge_stiffness=about_one("hinge_stiffness"),
        hinge_damping=about_one("hinge_damping"),
        sunk_m=sunk_m,
        marker_shift_m={name: (float(x), float(y)) for name, (x, y) in zip(FISHSIM_MARKERS, shift, strict=True)},
    )


def sample_world(random: np.random.Generator, sunk_m: float | None = None) -> World:
    """Draw a robot, its water and how deep it floats, unless that is given."""
    sunk_m = FLOATS_SD_M * float(random.standard_normal()) if sunk_m is None else sunk_m
    nuisances, (low, high) = drawn_nuisances(random, sunk_m), np.transpose(_COEFFICIENTS)
    blunt, slender, angular, kutta, magnus = map(float, random.uniform(low, high))
    return World(coefficients=(blunt, slender, angular, kutta, magnus), nuisances=nuisances)


def _draw_trials(recorded: Recorded, random: np.random.Generator) -> tuple[DrawnTrial, ...]:
    swims = [
        DrawnTrial(trial_name("f", hz), role, draw_swim(hz, recorded.seconds, random)) for hz, role in recorded.swims
    ]
    others = []
    if (hz := recorded.dry_hz) is not None:
        dry = Trial("dry", _DRY_S, hz, phase_rad=float(random.uniform(0, 2 * np.pi)))
        others.append(DrawnTrial(trial_name("dry", hz), "fit", dry))
    if recorded.free_decay:  # All hinges are bent equally, to either side.
        bent = (float(random.choice([-1.0, 1.0]) * _TAIL_BENT_RAD),) * len(load_robot().hinges)
        others.append(DrawnTrial("decay", "fit", Trial("free_decay", _DECAY_S, bent_rad=bent, release_s=_RELEASED_S)))
    return (*swims, *others)


def draw_swim(hz: float, seconds: float, random: np.random.Generator) -> Trial:
    """Draw a swim along the picture, half a fish longer than its course."""
    heading = float(random.uniform(-_HEADING_RAD, _HEADING_RAD) + np.pi * random.integers(2))
    return swim_past_middle(hz, seconds, heading, 0.2, random)


def swim_past_middle(hz: float, seconds: float, heading: float, more_m: float, random: np.random.Generator) -> Trial:
    """Place a swim so that its middle, a little before or behind, is about the middle of the picture."""
    start_speed = 0.1 * hz
    way = start_speed * (seconds + 1.0) / 2 + more_m
    place = -way * np.exp(1j * heading) + complex(*random.uniform(-0.1, 0.1, 2))
    return Trial(
        "swim",
        seconds,
        hz,
        phase_rad=float(random.uniform(0, 2 * np.pi)),
        start_speed_m_s=start_speed,
        place_m=complex(place),
        heading_rad=heading,
    )


def swims_forward(recording: Recording) -> bool:
    """Tell whether a swim's second half goes on as it began, no slower than is plausible."""
    half = recording.head[len(recording.head) // 2 :]
    way = np.exp(1j * recording.trial.heading_rad)
    moved = complex(*(half[-1, :2] - half[0, :2]))
    seconds = recording.time_s[-1] - recording.time_s[len(recording.head) // 2]
    return bool((moved * np.conj(way)).real / seconds > _SLOWEST_M_S)
