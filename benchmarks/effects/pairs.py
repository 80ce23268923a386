"""Pairs of sessions of one robot in one water: a healthy reference, and one in which an effect may be present.

`make_pairs` draws robot, water, camera and commands once for a pair, and every launch anew: heading, place, phase and,
in a wake, trim. The answers lie apart from the sessions; only the scorer opens them. With each lies what the swims of
the second session would show without noise, with and without the effect, for the detectability of the difference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from benchmarks.cases import write_record
from benchmarks.effects.drawn import DrawnTrial, DrawnWorld
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.generators import GENERATORS, Generator
from benchmarks.effects.making import write_session
from benchmarks.effects.suite import SLOWEST_HZ, WARMUP_S, Recorded, SessionPlan, apart, in_turn
from benchmarks.reality import Recording
from swimcal.effects.catalogue import catalogue
from swimcal.errors import SimulationDiverged
from swimsynth.plan import trial_name

REFERENCE, CHANGED = "reference", "changed"
"""Names of the two sessions in the folder of a pair."""
_SWIMS = 5  # fitted swims of either session
_FASTEST_HZ = 1.5
_BEATS = 4.0  # beats of the slowest swims after the warm-up
_LEAST_S = 5.0  # A swim is at least this long.
_TRIES = 12  # At most this many robots are drawn for a pair.
_WEAKEST, _STRONGEST = 1.0, 4.0  # strengths of mechanisms, log-uniform between these
_HALVINGS = 4  # A strength that cannot be simulated is halved at most this often.

GeneratorName = Literal["reality", "wake", "real"]


class PairPlan(NamedTuple):
    """Plan of one pair: its name, seed, and the effect of the second session; None in a healthy pair."""

    name: str
    seed: int
    effect: str | None


@dataclass(frozen=True)
class PairAnswer:
    """Answer of one pair: the effect of its second session, None in a healthy pair, and its strength."""

    pair: str
    generator: GeneratorName
    effect: str | None
    strength: float
    seed: int


def plan_pairs(generator: GeneratorName, seed: int, healthy: int, changed: int) -> tuple[PairPlan, ...]:
    """Plan pairs in random order, the effects in turn; names carry no information."""
    random = np.random.default_rng([seed, 41])
    known = catalogue()
    makeable = [name for name in GENERATORS[generator].mechanisms if name in known]
    effects: list[str | None] = [None] * healthy
    effects += in_turn(makeable, changed, random)
    seeds = random.integers(2**31, size=len(effects))
    order = random.permutation(len(effects))
    return tuple(PairPlan(f"p{n:03d}", int(seeds[i]), effects[i]) for n, i in enumerate(order))


def make_pairs(folder: Path, generator: GeneratorName, plans: Sequence[PairPlan]) -> tuple[PairAnswer, ...]:
    """Make the pairs that are missing: `folder/<name>/{reference,changed}` and `folder/answers/<name>.json`.

    Raises:
        ValueError: no robot was drawn that swims forward.
    """
    todo = [plan for plan in plans if not (folder / "answers" / f"{plan.name}.json").exists()]
    making = GENERATORS[generator]
    return tuple(film_together([_make(folder, generator, making, plan) for plan in todo], 16, making.simulate))


def _make(folder: Path, name: GeneratorName, generator: Generator, plan: PairPlan) -> Filming[PairAnswer]:
    random = np.random.default_rng([plan.seed, 43])
    drawn, films = yield from _draw(generator, plan, random)
    reference, changed = drawn
    clean = with_effect = {each.name: film for each, film in zip(changed.trials, films[1], strict=True)}
    strength = 0.0
    if plan.effect is not None:
        strong = generator.mechanisms[plan.effect](random)
        strength = float(np.exp(random.uniform(*np.log((_WEAKEST, _STRONGEST)))))
        for _ in range(_HALVINGS):
            try:
                with_effect = yield from changed.recorded(strong(strength))
                break
            except SimulationDiverged:
                strength /= 2
    write_session(folder / plan.name / REFERENCE, reference, dict(zip(_names(reference), films[0], strict=True)))
    write_session(folder / plan.name / CHANGED, changed, with_effect)
    truth = {
        f"{kind}/{trial}": film.position_px
        for kind, films_of in (("clean", clean), ("true", with_effect))
        for trial, film in films_of.items()
    }
    (folder / "answers").mkdir(exist_ok=True)
    np.savez_compressed(folder / "answers" / f"{plan.name}.npz", allow_pickle=False, **truth)
    answer = PairAnswer(plan.name, name, plan.effect, strength, plan.seed)
    write_record(folder / "answers" / f"{plan.name}.json", answer)
    return answer


def _draw(
    generator: Generator, plan: PairPlan, random: np.random.Generator
) -> Filming[tuple[tuple[DrawnWorld, DrawnWorld], tuple[list[Recording], list[Recording]]]]:
    """Draw a robot in its water until every swim of both sessions is plausible, and film these without the effect."""
    for _ in range(_TRIES):
        world = generator.world(random)
        speeds = apart(_SWIMS + 1, SLOWEST_HZ, _FASTEST_HZ, random)
        held_out = int(random.integers(1, _SWIMS))
        fit = tuple(float(hz) for i, hz in enumerate(speeds) if i != held_out)
        worlds, films = [], []
        for number, (label, extra) in enumerate(((REFERENCE, ()), (CHANGED, (float(speeds[held_out]),)))):
            recorded = Recorded(fit, extra, 0.0, None, False, False)
            own = SessionPlan(label, int(plan.seed + number), recorded, "null")
            trials = tuple(
                DrawnTrial(trial_name("f", hz), role, generator.swim(hz, _seconds(hz), random))
                for hz, role in sorted([*((hz, "fit") for hz in fit), *((hz, "holdout") for hz in extra)])
            )
            worlds.append(DrawnWorld(own, world, trials))
        films = yield [(each.world, trial.trial) for each in worlds for trial in each.trials]
        if all(map(generator.plausible, films)):
            count = len(worlds[0].trials)
            return (worlds[0], worlds[1]), (films[:count], films[count:])
    raise ValueError(f"pair {plan.name}: found no robot that swims as fish do in {_TRIES} draws")


def _seconds(hz: float) -> float:
    return float(np.round(max(_LEAST_S, WARMUP_S + _BEATS / hz), 1))


def _names(drawn: DrawnWorld) -> list[str]:
    return [each.name for each in drawn.trials]
