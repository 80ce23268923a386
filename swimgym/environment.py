"""One swimmer as an environment of gymnasium: `swimgym/Target-v0` and `swimgym/Circle-v0`."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from swimgym.asked import checked_action, checked_target
from swimgym.course import Course, Moment, Targets
from swimgym.making import make_course
from swimgym.picture import view_from_above


def spaces_of(course: Course) -> tuple[Box, Box]:
    """Build the spaces of what one swimmer sees and does: SI units without bounds, and an acceleration from -1 to 1."""
    seen = Box(-np.inf, np.inf, (len(course.names),), np.float32)
    return seen, Box(-1.0, 1.0, (1,), np.float32)


def told(moment: Moment) -> dict[str, np.ndarray]:
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
        """Take one action, (1,); see `told` for the last entry of the result.

        Raises:
            ValueError: an action of another shape, or not finite.
        """
        moment = self.course.act(checked_action(action, (1,)))
        ended = bool(moment.reached[0] or moment.diverged[0])
        seen, infos = moment.seen[0].astype(np.float32), {name: value[0] for name, value in told(moment).items()}
        return seen, float(moment.reward[0]), ended, bool(moment.timed_out[0]), infos

    def render(self) -> np.ndarray | None:
        """Draw the pool from above, (p, p, 3) RGB."""
        return view_from_above(self.course) if self.render_mode == "rgb_array" else None
