"""Many swimmers as one vector environment of gymnasium, all stepped at once on all cores."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from swimgym.environment import spaces_of, told
from swimgym.making import make_course
from swimgym.picture import view_from_above


class SwimVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """n fish in one batch. Where an episode ends, the next begins in the same step (gymnasium's same-step mode).

    `infos` holds the arrays of `told`; where episodes ended also `final_obs` (n, o), what was seen last, and
    `_final_obs` (n,), where. Fish with several models (posterior draws) deal them out to the swimmers.

    Args:
        num_envs: n.
        task: "target" or "circle".
        options: of `make_course`: `session`, `mjcf`, `fish`, `workers`, those of the task and of the rules.
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
        self.single_observation_space, self.single_action_space = spaces_of(self.course)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins all episodes; one seed draws all goals."""
        super().reset(seed=seed, options=options)
        return self.course.begin(np.arange(self.num_envs), self.np_random).astype(np.float32), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Actions (n, 1)."""
        moment = self.course.act(np.asarray(actions, float).reshape(self.num_envs))
        infos: dict[str, Any] = dict(told(moment))
        seen = moment.seen.astype(np.float32)
        if (ended := np.flatnonzero(moment.over)).size:
            infos |= {"final_obs": seen, "_final_obs": moment.over}
            seen = self.course.begin(ended, self.np_random).astype(np.float32)
        return seen, moment.reward, moment.reached | moment.diverged, moment.timed_out, infos

    def render(self) -> tuple[np.ndarray, ...] | None:
        """The pool from above with all of them, RGB (p, p, 3)."""
        return (view_from_above(self.course),) if self.render_mode == "rgb_array" else None
