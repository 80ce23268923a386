"""A policy as a file: plain arrays (npz) and a card (json). It needs neither torch nor gymnasium."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from session.errors import Fault, InputError, ModelMismatch
from session.results import is_incomplete, plain_json, program_version, write_whole, writing_whole
from swimgym.beat import beat_action
from swimgym.course import Course, Rules
from swimgym.source import Fish
from swimgym.steering import steered
from swimmer.engine import ENGINE

SCHEMA = 1
SHIPPED = Path(__file__).parent / "policies"
"""Policies `target` and `circle` that were trained on `datasets/sample`, fitted at quick effort."""


@dataclass(frozen=True)
class Card:
    """The origin of a policy.

    Attributes:
        task: "target" or "circle".
        method: "search" or "sac".
        robot, origin, model_sha256: of the fish that it was trained on.
        observations: names of what it sees, in order.
        rules: rules that it was trained under.
        training: how it was trained: seconds, steps, last cost.
        scores: scores of `swimgym.evaluation`; empty before.
        mujoco, program, schema: versions.
    """

    task: str
    method: str
    robot: str
    origin: str
    model_sha256: str
    observations: tuple[str, ...]
    rules: Rules
    seed: int
    training: Mapping[str, Any] = field(default_factory=dict)
    scores: Mapping[str, Any] = field(default_factory=dict)
    mujoco: str = ENGINE
    program: str = field(default_factory=program_version)
    schema: int = SCHEMA


def card_of(task: str, method: str, fish: Fish, course: Course, seed: int) -> Card:
    """Make the card of a policy that is trained on this fish."""
    return Card(task, method, fish.robot, fish.origin, fish.sha256, course.names, course.rules, seed)


@dataclass(frozen=True, eq=False)
class Policy:
    """A function from what swimmers see to what they do.

    Its arrays are "law" (p,) of a steering law; or "weight_0", "bias_0", … of a network from `features` to frequency
    and side of the beat.
    """

    card: Card
    arrays: Mapping[str, np.ndarray]

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Compute the (n,) accelerations in [-1, 1], given what n swimmers see (n, o)."""
        rules = self.card.rules
        if "law" in self.arrays:
            return steered(self.arrays["law"], rules, seen)
        beat = np.tanh(self._through(features(seen)))
        return beat_action(rules, seen, rules.fastest_hz * (1 + beat[:, 0]) / 2, beat[:, 1])

    def _through(self, values: np.ndarray) -> np.ndarray:
        layers = sum(name.startswith("weight_") for name in self.arrays)
        for layer in range(layers):
            values = values @ self.arrays[f"weight_{layer}"].T + self.arrays[f"bias_{layer}"]
            values = np.maximum(values, 0.0) if layer < layers - 1 else values
        return values

    def save(self, file: Path) -> None:
        """Write FILE.npz and its card FILE.json.

        Raises:
            ResultsNotWritable: one of them cannot be written.
        """
        with writing_whole(file.with_suffix(".npz")) as part:
            np.savez_compressed(part, allow_pickle=False, **self.arrays)
        write_whole(file.with_suffix(".json"), json.dumps(plain_json(asdict(self.card)), indent=1) + "\n")

    def scored(self, scores: Mapping[str, Any]) -> "Policy":
        """Return the same policy with scores on its card."""
        return replace(self, card=replace(self.card, scores=scores))

    def check(self, fish: Fish, course: Course, file: str = "the policy") -> None:
        """Refuse a policy for another engine, another robot or other rules of action.

        Raises:
            ModelMismatch: it was trained with another.
        """
        pairs = {
            "MuJoCo": (self.card.mujoco, ENGINE),
            "robot": (self.card.robot, fish.robot),
            "observations": (len(self.card.observations), len(course.names)),
            "interval between actions, s": (self.card.rules.interval_s, course.rules.interval_s),
            "acceleration, rad/s^2": (self.card.rules.acceleration_rad_s2, course.rules.acceleration_rad_s2),
        }
        differ = [f"{what}: trained with {then}, here {now}" for what, (then, now) in pairs.items() if then != now]
        if differ:
            raise ModelMismatch(
                f"{file}: a policy of another robot or engine ({'; '.join(differ)}). What it would do here means "
                "nothing. Train one with `calib policy train`."
            )


def features(seen: np.ndarray) -> np.ndarray:
    """Compute the (n, o + 2) inputs of a network from observations (n, o).

    They are the observations scaled to numbers about 1, and the direction of the target.
    """
    hinges = (seen.shape[1] - 12) // 2
    scale = np.concatenate([[1, 1, 30, 1, 1, 1], np.full(hinges, 0.5), np.full(hinges, 15), [2, 2, 2, 0.5, 0.5, 1]])
    towards = seen[:, -5:-3] / (np.linalg.norm(seen[:, -5:-3], axis=1, keepdims=True) + 0.02)
    return np.hstack([seen / scale, towards]).astype(np.float32)


def load_policy(file: Path) -> Policy:
    """Read what `Policy.save` wrote.

    Raises:
        InputError: it is not there, incomplete, or no policy of this version.
    """
    step = "Train one with `calib policy train`."
    for part in (file.with_suffix(".json"), file.with_suffix(".npz")):
        if is_incomplete(part):
            found, expected = f"{part.name}, whose end is missing or damaged", "the whole file as it was written"
            raise InputError([Fault(str(file), "", "it is incomplete", found, expected, (), step)])
    try:
        data = json.loads(file.with_suffix(".json").read_bytes())
        if data["schema"] != SCHEMA:
            raise ValueError(f"schema {data['schema']}")
        card = Card(**{**data, "observations": tuple(data["observations"]), "rules": Rules(**data["rules"])})
        with np.load(file.with_suffix(".npz"), allow_pickle=False) as arrays:
            return Policy(card, dict(arrays))
    except FileNotFoundError as error:
        fault = Fault(str(file), "", "there is no such policy", "nothing", "a policy: npz and json", (), step)
        raise InputError([fault]) from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        expected = f"a policy with a card of schema {SCHEMA}"
        raise InputError([Fault(str(file), "", "it cannot be read", str(error), expected, (), step)]) from error
