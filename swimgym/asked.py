"""Checks of what a caller gives to an environment: actions, seeds and the options of a reset."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from swimgym.course import Targets, Task


def checked_action(action: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Check actions of this shape and return them as one array (n,).

    Raises:
        ValueError: of another shape, or not finite numbers.
    """
    given = _numbers("action", action, "an array of numbers from -1 to 1")
    if given.shape != shape:
        raise ValueError(f"action: found the shape {given.shape}, expected {shape}")
    if not np.isfinite(given).all():
        where = np.argwhere(~np.isfinite(given))[0].tolist()
        raise ValueError(f"action: found {given[tuple(where)]} at {where}, expected finite numbers from -1 to 1")
    return given.reshape(-1)


def checked_target(options: dict[str, Any] | None, task: Task, count: int = 1) -> np.ndarray | None:
    """Check the option "target_m" and return it, m: (2,) or, of several swimmers, (n, 2); None where it is not given.

    Args:
        options: options of a reset.
        task: the task of the environment.
        count: number of swimmers.

    Raises:
        ValueError: another option, another shape, or a task whose target cannot be given.
    """
    options = options or {}
    if strange := sorted(set(options) - {"target_m"}):
        raise ValueError(f"options: found {', '.join(map(repr, strange))}, expected 'target_m' or nothing")
    if options.get("target_m") is None:
        return None
    if not isinstance(task, Targets):
        raise ValueError("options: found 'target_m' on a circle, expected it with the task 'target' only")
    target = _numbers("target_m", options["target_m"], "x and y in m")
    shapes = [(2,)] if count == 1 else [(2,), (count, 2)]
    if target.shape not in shapes or not np.isfinite(target).all():
        found = f"the shape {target.shape}" if target.shape not in shapes else target.tolist()
        raise ValueError(f"target_m: found {found}, expected finite x and y in m, {' or '.join(map(str, shapes))}")
    return target


def checked_seeds(seed: int | Sequence[int | None] | None, count: int) -> Sequence[int | None] | None:
    """Check the seeds of n environments and return them; None where one seed, or none, is for all of them.

    Raises:
        ValueError: another number of seeds.
    """
    if seed is None or isinstance(seed, int | np.integer):
        return None
    seeds = [None if each is None else int(each) for each in seed]
    if len(seeds) != count:
        raise ValueError(
            f"seed: found {len(seeds)} seeds, expected one number, or one for each of {count} environments"
        )
    return seeds


def _numbers(name: str, value: Any, expected: str) -> np.ndarray:
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: found {value!r}, expected {expected}") from None
