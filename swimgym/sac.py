"""Training with soft actor-critic (Haarnoja et al., ICML 2018) of stable-baselines3, on the batched twin.

The network chooses a beat, its frequency and how much it is to one side, and keeps it for some intervals: seconds ahead
are then tens of choices instead of hundreds. Training needs the extra ``swimcal[policies]``; the trained policy does
not.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from swimgym.course import Course, beat_action, make_course
from swimgym.policy import Policy, Progress, card_of, features
from swimgym.swimmers import Fish

_PROGRESS_WEIGHT = 5.0  # reward for each metre (or rad along the circle) of progress
_TIME_COST = 0.05  # cost of each choice
_GOAL = 5.0  # reward for a goal, and cost of a simulation that diverges
_OFF_WEIGHT = 3.0  # cost of each metre off the path, in each interval


@dataclass(frozen=True)
class SacPlan:
    """The settings with which a network is trained.

    Attributes:
        steps: choices in all, over all swimmers.
        hold: intervals of the course for which a choice is kept.
        updates: updates of the networks after every choice of all swimmers.
        learning_rate, discount, batch, warmup: of the algorithm; `warmup` choices are random.
        every: choices after which the state is written.
    """

    steps: int = 400_000
    swimmers: int = 64
    hold: int = 10
    updates: int = 16
    layers: tuple[int, ...] = (128, 128)
    learning_rate: float = 1e-3
    discount: float = 0.99
    batch: int = 256
    warmup: int = 10_000
    seed: int = 0
    every: int = 50_000


def train_sac(
    fish: Fish,
    task: str,
    plan: SacPlan | None = None,
    *,
    state_file: Path | None = None,
    workers: int = 0,
    progress: Progress = lambda _message, _share: None,
    **options: Any,
) -> Policy:
    """Train a network for a task.

    Args:
        fish: the robot; several models are dealt out to the swimmers.
        task: "target" or "circle".
        plan: settings of the training.
        state_file: a zip of stable-baselines3, written now and then, with the replay buffer next to it; where there is
            one, training continues from it.
        workers: threads; 0 for all cores.
        progress: called with a message and the share done.
        options: options of `make_course`.
    """
    plan = plan or SacPlan()
    course = make_course(task, plan.swimmers, fish=fish, workers=workers, **options)
    pool, began = BeatPool(course, plan.hold, plan.seed), monotonic()
    if state_file is not None and state_file.is_file():
        model = SAC.load(state_file, pool)
        model.load_replay_buffer(state_file.with_suffix(".buffer"))
    else:
        model = SAC(
            "MlpPolicy",
            pool,
            learning_rate=plan.learning_rate,
            buffer_size=300_000,
            learning_starts=plan.warmup,
            batch_size=plan.batch,
            gamma=plan.discount,
            train_freq=1,
            gradient_steps=plan.updates,
            policy_kwargs={"net_arch": list(plan.layers)},
            seed=plan.seed,
            device="cpu",
        )
    reporter = _Reporter(plan, pool, state_file, progress)
    model.learn(max(plan.steps - model.num_timesteps, 0), callback=reporter, reset_num_timesteps=False)
    reporter.write()
    card = card_of(task, "sac", fish, course, plan.seed)
    training = {**asdict(plan), "trained_s": monotonic() - began}
    return Policy(replace(card, training=training), _arrays(model))


class BeatPool(VecEnv):
    """A course as stable-baselines3 needs it, with beats for actions, each kept for some intervals.

    The reward is what shortens the way: progress (m), less time and distance from the path, and a goal. Its sum ranks
    whole episodes as their duration does; the paper's reward is that of the environments.
    """

    def __init__(self, course: Course, hold: int, seed: int) -> None:
        self.course, self.hold, self._rng = course, hold, np.random.default_rng(seed)
        count = len(course.swimmers)
        seen = Box(-np.inf, np.inf, (len(course.names) + 2,), np.float32)
        super().__init__(count, seen, Box(-1.0, 1.0, (2,), np.float32))
        self._chosen = np.zeros((count, 2))
        self.hits, self.ends = 0, 0

    def reset(self) -> np.ndarray:
        """Begin all episodes, and return (n, o) what the swimmers see."""
        return features(self.course.begin(np.arange(self.num_envs), self._rng))

    def step_async(self, actions: np.ndarray) -> None:
        """Take note of beats (n, 2): frequency and side, each from -1 to 1."""
        self._chosen = np.asarray(actions, float)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Swim for as long as a choice is kept; a swimmer whose episode is over waits."""
        course, rules = self.course, self.course.rules
        seen, before, _ = course.look()
        live, reward = np.arange(self.num_envs), np.zeros(self.num_envs)
        over, cut = np.zeros(self.num_envs, bool), np.zeros(self.num_envs, bool)
        start = getattr(course.task, "progress", -before).copy()
        hz = rules.fastest_hz * (1 + self._chosen[:, 0]) / 2
        for _ in range(self.hold):
            moment = course.act(beat_action(rules, seen, hz, self._chosen[:, 1]), live)
            seen = moment.seen
            reward[live] -= _OFF_WEIGHT * np.nan_to_num(moment.off_path_m[live])
            ended = moment.over & ~over
            ended[np.setdiff1d(np.arange(self.num_envs), live)] = False
            over |= ended
            cut |= ended & moment.timed_out
            reward += _GOAL * (ended & moment.reached) - _GOAL * (ended & moment.diverged)
            live = live[~moment.over[live]]
        end = getattr(course.task, "progress", -moment.distance_m)
        reward += np.nan_to_num(_PROGRESS_WEIGHT * (end - start)) - _TIME_COST
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        told = features(seen)
        for row in np.flatnonzero(over):
            infos[row] = {"terminal_observation": told[row], "TimeLimit.truncated": bool(cut[row])}
        self.hits, self.ends = self.hits + int((over & moment.reached).sum()), self.ends + int(over.sum())
        if over.any():
            told = features(course.begin(np.flatnonzero(over), self._rng))
        return told, reward.astype(np.float32), over, infos

    def close(self) -> None:
        """Do nothing: nothing is held open."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the pool, once for each swimmer."""
        return [getattr(self, attr_name, None)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:  # noqa: ARG002
        """Set an attribute of the pool."""
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **options: Any) -> list[Any]:
        """Raise `NotImplementedError`: there are no single environments."""
        raise NotImplementedError(f"{method_name}{args}{options} of {indices}")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002
        """Return False for each swimmer."""
        return [False] * len(list(self._get_indices(indices)))


def _arrays(model: SAC) -> dict[str, np.ndarray]:
    actor = model.policy.actor
    layers = [layer for layer in (*actor.latent_pi, actor.mu) if hasattr(layer, "weight")]
    arrays = {}
    for number, layer in enumerate(layers):
        arrays[f"weight_{number}"] = layer.weight.detach().numpy().copy()
        arrays[f"bias_{number}"] = layer.bias.detach().numpy().copy()
    return arrays


class _Reporter(BaseCallback):
    def __init__(self, plan: SacPlan, pool: BeatPool, file: Path | None, progress: Progress) -> None:
        super().__init__()
        self._plan, self._pool, self._file, self._progress, self._next = plan, pool, file, progress, plan.every

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps + self._plan.every

    def _on_step(self) -> bool:
        if self.num_timesteps >= self._next:
            self._next += self._plan.every
            share = self._pool.hits / max(self._pool.ends, 1)
            self._pool.hits = self._pool.ends = 0
            self._progress(f"{self.num_timesteps} choices, {share:.0%} reached", self.num_timesteps / self._plan.steps)
            self.write()
        return True

    def write(self) -> None:
        """Write the state, if it is to be kept."""
        if self._file is not None:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            model: Any = self.model
            model.save(self._file)
            model.save_replay_buffer(self._file.with_suffix(".buffer"))
