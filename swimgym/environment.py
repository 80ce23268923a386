"""One swimmer as an environment of gymnasium: `swimgym/Target-v0` and `swimgym/Circle-v0`."""

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from swimgym.course import Circle, Course, Moment, Rules, Targets
from swimgym.picture import view_from_above
from swimgym.source import Fish, load_fish
from swimgym.swimmers import Swimmers

TASKS = {"target": Targets, "circle": Circle}


def make_course(  # noqa: PLR0913
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
    """n swimmers with a task.

    Args:
        task: "target" or "circle".
        count: n.
        session, mjcf: see `load_fish`; neither: the built-in robot.
        fish: instead of these, one that was loaded.
        rules: of action, reward and episode; default: the paper's, see `swimgym.course`.
        workers: threads; 0 for all cores.
        options: of the task, see `Targets` and `Circle`; fields of `Rules` change these.

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


def spaces_of(course: Course) -> tuple[Box, Box]:
    """What one swimmer sees and does: SI units without bounds; an acceleration from -1 to 1."""
    seen = Box(-np.inf, np.inf, (len(course.names),), np.float32)
    return seen, Box(-1.0, 1.0, (1,), np.float32)


def told(moment: Moment) -> dict[str, np.ndarray]:
    """(n,) `distance_m`, `is_success` and `diverged` of n swimmers; where there is a path `off_path_m`, too."""
    infos = {"distance_m": moment.distance_m, "is_success": moment.reached, "diverged": moment.diverged}
    return infos if np.isnan(moment.off_path_m).all() else {**infos, "off_path_m": moment.off_path_m}


class SwimEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A fish that is to reach a target or to follow a circle; see `swimgym.course` for what it sees and is given.

    Args:
        task: "target" or "circle".
        render_mode: "rgb_array" or None.
        options: of `make_course`: `session`, `mjcf`, `fish`, those of the task and of the rules.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(self, task: str = "target", render_mode: str | None = None, **options: Any) -> None:
        self.course = make_course(task, 1, **{"workers": 1, **options})
        self.observation_space, self.action_space = spaces_of(self.course)
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins an episode; the option "target_m" (x, y) places its target."""
        super().reset(seed=seed)
        seen = self.course.begin(np.zeros(1, int), self.np_random)
        if options and "target_m" in options:
            self.course.task.places[0] = options["target_m"]  # type: ignore[attr-defined]
            seen = self.course.look()[0]
        return seen[0].astype(np.float32), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One action, (1,); see `told` for the last entry."""
        moment = self.course.act(np.asarray(action, float).reshape(1))
        ended = bool(moment.reached[0] or moment.diverged[0])
        seen, infos = moment.seen[0].astype(np.float32), {name: value[0] for name, value in told(moment).items()}
        return seen, float(moment.reward[0]), ended, bool(moment.timed_out[0]), infos

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """(p, p, 3) the pool from above, RGB."""
        return view_from_above(self.course) if self.render_mode == "rgb_array" else None
