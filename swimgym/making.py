"""Courses from what a user names: a session, an MJCF or the built-in robot, a task and its options."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from swimgym.course import Circle, Course, Rules, Targets
from swimgym.source import Fish, load_fish
from swimgym.swimmers import Swimmers

TASKS: dict[str, Any] = {"target": Targets, "circle": Circle}


def make_course(
    task: str,
    count: int,
    *,
    session: str | Path | None = None,
    mjcf: str | Path | None = None,
    fish: Fish | None = None,
    rules: Rules | None = None,
    workers: int = 0,
    **options: Any,
) -> Course:
    """Make a course of n swimmers with a task, "target" or "circle".

    Args:
        task: name of the task.
        count: n.
        session: folder of a session with a fit, see `load_fish`; without session and MJCF: the built-in robot.
        mjcf: instead, an MJCF, see `load_fish`.
        fish: instead of these, one that was loaded.
        rules: rules of action, reward and episode; default: the paper's, see `swimgym.course`.
        workers: threads; 0 for all cores.
        options: options of the task, see `Targets` and `Circle`; fields of `Rules` change these.

    Raises:
        InputError, ModelMismatch: see `load_fish`.
        TypeError: an option that neither the task nor the rules have.
    """
    rules, own = rules or Rules(), {name: options.pop(name) for name in RULES if name in options}
    rules = replace(rules, **own)
    fish = fish or load_fish(session, mjcf=mjcf)
    swimmers = Swimmers(fish.models, count, interval_s=rules.interval_s, workers=workers)
    return Course(swimmers, TASKS[task](count, **options), rules)


RULES = tuple(Rules.__dataclass_fields__)
