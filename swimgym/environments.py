"""Gymnasium environments of one swimmer and of many.

`SwimEnv` is one swimmer, `swimgym/Target-v0` or `swimgym/Circle-v0`; `SwimVectorEnv` is many of them, all stepped at
once on all cores.
"""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from swimgym.aquarium import view_from_above
from swimgym.course import Course, Moment, Targets, checked_action, checked_seeds, checked_target, make_course


def spaces_of(course: Course) -> tuple[Box, Box]:
    """Build the spaces of what one swimmer sees and does: SI units without bounds, and an acceleration from -1 to 1."""
    seen = Box(-np.inf, np.inf, (len(course.names),), np.float32)
    return seen, Box(-1.0, 1.0, (1,), np.float32)


def step_info(moment: Moment) -> dict[str, np.ndarray]:
    """Collect the infos (n,) of n swimmers: `distance_m`, `is_success`, `diverged` and, with a path, `off_path_m`."""
    infos = {"distance_m": moment.distance_m, "is_success": moment.reached, "diverged": moment.diverged}
    return infos if np.isnan(moment.off_path_m).all() else {**infos, "off_path_m": moment.off_path_m}


class SwimEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A fish that is to reach a target or to follow a circle; see `swimgym.course` for what it sees and is given.

    Args:
        task: "target" or "circle".
        render_mode: "rgb_array" or None.
        options: options of `make_course`: `session`, `mjcf`, `fish`, those of the task and of the rules.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012 (gymnasium's)

    def __init__(self, task: str = "target", render_mode: str | None = None, **options: Any) -> None:
        self.course = make_course(task, 1, **{"workers": 1, **options})
        self.observation_space, self.action_space = spaces_of(self.course)
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; the option "target_m" (x, y) places its target.

        Raises:
            ValueError: another option, or another shape.
        """
        target_m = checked_target(options, self.course.task)
        super().reset(seed=seed)
        if isinstance(self.course.task, Targets):
            self.course.task.given_m = target_m
        seen = self.course.begin(np.zeros(1, int), self.np_random)
        return seen[0].astype(np.float32), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Take one action, (1,); see `step_info` for the last entry of the result.

        Raises:
            ValueError: an action of another shape, or not finite.
        """
        moment = self.course.act(checked_action(action, (1,)))
        ended = bool(moment.reached[0] or moment.diverged[0])
        seen, infos = moment.seen[0].astype(np.float32), {name: value[0] for name, value in step_info(moment).items()}
        return seen, float(moment.reward[0]), ended, bool(moment.timed_out[0]), infos

    def render(self) -> np.ndarray | None:
        """Draw the pool from above, (p, p, 3) RGB."""
        return view_from_above(self.course) if self.render_mode == "rgb_array" else None


class SwimVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """A batch of n fish. Where an episode ends, the next begins in the same step (gymnasium's same-step mode).

    `infos` holds the arrays of `step_info`; where episodes ended also `final_obs` (n, o), what was seen last, and
    `_final_obs` (n,), where. Fish with several models (posterior draws) deal them out to the swimmers.

    Args:
        num_envs: n.
        task: "target" or "circle".
        render_mode: "rgb_array" or None.
        options: options of `make_course`: `session`, `mjcf`, `fish`, `workers`, those of the task and of the rules.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (gymnasium declares it so)
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self, num_envs: int = 64, task: str = "target", render_mode: str | None = None, **options: Any
    ) -> None:
        self.course = make_course(task, num_envs, **options)
        self.num_envs, self.render_mode = num_envs, render_mode
        self._own: list[np.random.Generator] | None = None  # a generator for each swimmer
        self.single_observation_space, self.single_action_space = spaces_of(self.course)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin all episodes.

        Args:
            seed: one that draws all goals, or a list of one for each, with which each is as a `SwimEnv` of that seed.
            options: "target_m" (2,) or (n, 2) places the targets of these episodes.

        Raises:
            ValueError: another number of seeds, another option, or another shape.
        """
        seeds, task = checked_seeds(seed, self.num_envs), self.course.task
        target_m = checked_target(options, task, self.num_envs)
        if seeds is not None:
            self._own = [np_random(each)[0] for each in seeds]
        elif seed is not None:
            self._own = None
        super().reset(seed=None if seeds is not None else seed, options=options)  # type: ignore[arg-type]
        if isinstance(task, Targets):
            task.given_m = target_m
        seen = self._begin(np.arange(self.num_envs))
        if isinstance(task, Targets):
            task.given_m = None  # it holds for these episodes, not for those that follow them
        return seen, {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take actions (n, 1).

        Raises:
            ValueError: actions of another shape, or not finite.
        """
        moment = self.course.act(checked_action(actions, (self.num_envs, 1)))
        infos: dict[str, Any] = dict(step_info(moment))
        seen = moment.seen.astype(np.float32)
        if (ended := np.flatnonzero(moment.over)).size:
            infos |= {"final_obs": seen, "_final_obs": moment.over}
            seen = self._begin(ended)
        return seen, moment.reward, moment.reached | moment.diverged, moment.timed_out, infos

    def _begin(self, rows: np.ndarray) -> np.ndarray:
        """Begin the episodes of some swimmers (r,), drawn by their own generators where they have them.

        Returns:
            (n, o) what all swimmers see.
        """
        if self._own is None:
            return self.course.begin(rows, self.np_random).astype(np.float32)
        for row in rows:
            seen = self.course.begin(np.array([row]), self._own[row])
        return seen.astype(np.float32)

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Draw the pool from above with all swimmers, (p, p, 3) RGB."""
        return (view_from_above(self.course),) if self.render_mode == "rgb_array" else None
