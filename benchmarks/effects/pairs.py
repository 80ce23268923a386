"""Pairs of sessions of one robot in one water: a healthy reference, and one in which an effect may be present.

`make_pairs` draws robot, water, camera and commands once for a pair, and every launch anew: heading, place, phase and,
in a wake, trim.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.effects.changes import CHANGED, REFERENCE, ChangeAnswer, ChangePlan, missing, plan_changes
from benchmarks.effects.drawn import TRIES, DrawnTrial, DrawnWorld
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.making import GENERATORS, Generator, write_session
from benchmarks.effects.suite import SLOWEST_HZ, WARMUP_S, Recorded, SessionPlan, apart
from benchmarks.reality import Recording
from swimcal.effects.catalogue import catalogue
from swimcal.errors import SimulationDiverged
from swimsynth.plan import trial_name

_SWIMS = 5  # fitted swims of either session
_FASTEST_HZ = 1.5
_BEATS = 4.0  # beats of the slowest swims after the warm-up
_LEAST_S = 5.0  # A swim is at least this long.
_WEAKEST, _STRONGEST = 1.0, 4.0  # strengths of mechanisms, log-uniform between these
_HALVINGS = 4  # A strength that cannot be simulated is halved at most this often.


def plan_pairs(generator: str, seed: int, healthy: int, changed: int) -> tuple[ChangePlan, ...]:
    """Plan pairs of a generator, with effects that it can make."""
    known = catalogue()
    makeable = [name for name in GENERATORS[generator].mechanisms if name in known]
    return plan_changes((seed, 41), "p", healthy, makeable, changed)


def make_pairs(folder: Path, generator: str, plans: Sequence[ChangePlan]) -> int:
    """Make the pairs that are missing: `folder/<name>/{reference,changed}` and their answers; return how many.

    Raises:
        ValueError: no robot was drawn that swims forward.
    """
    making, todo = GENERATORS[generator], missing(folder, plans)
    film_together([_make(folder, generator, making, plan) for plan in todo], 16, making.simulate)
    return len(todo)


def _make(folder: Path, name: str, generator: Generator, plan: ChangePlan) -> Filming[None]:
    random = np.random.default_rng([plan.seed, 43])
    drawn, films = yield from _draw(generator, plan, random)
    recordings = [
        {each.name: film for each, film in zip(own.trials, filmed, strict=True)}
        for own, filmed in zip(drawn, films, strict=True)
    ]
    strength = 0.0
    if plan.change is not None:
        strong = generator.mechanisms[plan.change](random)
        strength = float(np.exp(random.uniform(*np.log((_WEAKEST, _STRONGEST)))))
        for _ in range(_HALVINGS):
            try:
                recordings[1] = yield from drawn[1].recorded(strong(strength))
                break
            except SimulationDiverged:
                strength /= 2
    for label, own, filmed in zip((REFERENCE, CHANGED), drawn, recordings, strict=True):
        write_session(folder / plan.name / label, own, filmed)
    right = () if plan.change is None else (plan.change,)
    ChangeAnswer(plan.name, name, plan.change, right, strength, plan.seed).write(folder)


def _draw(
    generator: Generator, plan: ChangePlan, random: np.random.Generator
) -> Filming[tuple[tuple[DrawnWorld, DrawnWorld], tuple[list[Recording], list[Recording]]]]:
    """Draw a robot in its water until every swim of both sessions is plausible, and film these without the effect."""
    for _ in range(TRIES):
        world = generator.world(random)
        speeds = apart(_SWIMS + 1, SLOWEST_HZ, _FASTEST_HZ, random)
        held_out = int(random.integers(1, _SWIMS))
        fit = tuple(float(hz) for i, hz in enumerate(speeds) if i != held_out)
        worlds, films = [], []
        for number, (label, extra) in enumerate(((REFERENCE, ()), (CHANGED, (float(speeds[held_out]),)))):
            recorded = Recorded(fit, extra, 0.0, None, False, False)
            own = SessionPlan(label, int(plan.seed + number), recorded, "null")
            trials = []
            for hz, role in recorded.swims:
                seconds = float(np.round(max(_LEAST_S, WARMUP_S + _BEATS / hz), 1))
                trials.append(DrawnTrial(trial_name("f", hz), role, generator.swim(hz, seconds, random)))
            worlds.append(DrawnWorld(own, world, tuple(trials)))
        films = yield [(each.world, trial.trial) for each in worlds for trial in each.trials]
        if all(map(generator.plausible, films)):
            count = len(worlds[0].trials)
            return (worlds[0], worlds[1]), (films[:count], films[count:])
    raise ValueError(f"pair {plan.name}: found no robot that swims as fish do in {TRIES} draws")
