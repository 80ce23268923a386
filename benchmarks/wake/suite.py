"""Suite of this generator: which sessions it holds, and how robot, water, camera and trials are drawn for one."""

from itertools import cycle

import numpy as np

from benchmarks.effects.drawn import DrawnTrial, DrawnWorld, draw_until, drawn_nuisances, swim_past_middle
from benchmarks.effects.filming import Filming
from benchmarks.effects.suite import WARMUP_S, Present, Recorded, SessionPlan, SuiteSize, apart, in_turn, plans_of
from benchmarks.reality import Recording
from benchmarks.wake.mechanisms import CATALOGUED
from benchmarks.wake.world import SharedNoise, TiltedCamera, TrimmedTrial, WakeWorld
from swimsynth.plan import trial_name

DETECTABILITIES = (2.0, 5.0, 10.0)
"""Fewer levels than of a large suite, so that there are some sessions of each."""
SLOWEST_HZ = 0.4
FASTEST_HZ = 1.7
_HELD_OUT = 2  # number of held-out swims
# Swims have so many beats after warm-up; of a held-out swim half may be looked at.
_BEATS = {"fit": (1.4, 4.0), "holdout": (2.6, 4.0)}
_TILT_SD_RAD = 0.02  # standard deviation of the camera's tilt
_TRIM_SD_RAD = 0.015  # standard deviation of the bend of a hinge at rest
# Another robot is drawn where a swim of the base state leaves these bounds.
_SLOWEST_M_S = 0.015
_FASTEST_M_S = 0.3
_FOLDED_RAD = 0.75


def plan_wake_suite(seed: int, size: SuiteSize) -> tuple[SessionPlan, ...]:
    """Plan the sessions, in the order of their names: some with nothing in them, all others with one effect."""
    random = np.random.default_rng([seed, 8])
    levels = cycle(random.permutation(DETECTABILITIES))
    present: list[Present] = [("null", (), 0.0)] * size.null
    singles = in_turn(tuple(CATALOGUED), size.sessions - size.null, random)
    present += [("single", (name,), float(next(levels))) for name in singles]
    return plans_of(present, _draw_recorded, random)


def _draw_recorded(random: np.random.Generator) -> Recorded:
    """Draw five or six swims, two of them held out; how long each is, is drawn with it."""
    swims = int(random.integers(5, 7))
    speeds = apart(swims, SLOWEST_HZ, FASTEST_HZ, random)
    held_out = set(random.choice(swims, _HELD_OUT, replace=False).tolist())
    fit = tuple(float(speed) for i, speed in enumerate(speeds) if i not in held_out)
    return Recorded(fit, tuple(float(speeds[i]) for i in sorted(held_out)), 0.0, None, False, False)


def draw_wake_world(plan: SessionPlan) -> Filming[DrawnWorld]:
    """Draw robot, water and trials until every swim of the base state is plausible.

    Raises:
        ValueError: no draw is.
    """
    return draw_until(plan, sample_wake_world, _draw_trials, is_plausible)


def sample_wake_world(random: np.random.Generator) -> WakeWorld:
    """Draw a robot, its water and the camera."""
    tilt = _TILT_SD_RAD * random.standard_normal(2)
    return WakeWorld(
        nuisances=drawn_nuisances(random),
        camera=TiltedCamera(about_x_rad=float(tilt[0]), about_y_rad=float(tilt[1])),
        noise=SharedNoise(shared=float(random.uniform(0.7, 0.8))),
        drag_area_m2=float(np.exp(random.uniform(*np.log((0.05, 0.11))))),
        cross_drag=float(random.uniform(1.2, 2.4)),
        roughness=float(random.uniform(1.0, 2.0)),
        suction=float(random.uniform(0.0, 0.15)),
    )


def _draw_trials(recorded: Recorded, random: np.random.Generator) -> tuple[DrawnTrial, ...]:
    trials = []
    for hz, role in recorded.swims:
        seconds = float(np.round(WARMUP_S + random.uniform(*_BEATS[role]) / hz, 1))
        trials.append(DrawnTrial(trial_name("f", hz), role, draw_wake_swim(hz, seconds, random)))
    return tuple(trials)


def draw_wake_swim(hz: float, seconds: float, random: np.random.Generator) -> TrimmedTrial:
    """Draw a swim to anywhere; less half a fish, whose origin is near its nose."""
    swim = swim_past_middle(hz, seconds, float(random.uniform(0.0, 2 * np.pi)), -0.2, random)
    return TrimmedTrial(**vars(swim), trim_rad=_TRIM_SD_RAD * float(random.standard_normal()))


def is_plausible(recording: Recording) -> bool:
    """Return whether it goes forward, no faster than fish of this size, and its tail does not fold."""
    half = recording.head[len(recording.head) // 2 :]
    moved = complex(*(half[-1, :2] - half[0, :2]))
    speed = (moved * np.exp(-1j * (half[:, 2].mean() + np.pi))).real / (len(half) / recording.trial.fps)
    folded = np.abs(recording.hinges_rad).max() > _FOLDED_RAD
    return bool(_SLOWEST_M_S < speed < _FASTEST_M_S and not folded)
