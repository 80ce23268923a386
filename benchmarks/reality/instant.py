"""One instant of n simulations, as mechanisms see it, and the forces they may answer with."""

from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any, TypeVar

import numpy as np

from benchmarks.reality.body import Chain, Pose
from benchmarks.reality.fluid import Flow, StripForces
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Pull, Turn

_Rows = TypeVar("_Rows")


@dataclass(frozen=True, eq=False)
class Instant:
    """State that is known before the mechanisms add their part."""

    time_s: np.ndarray  # (n, 1) time since the first frame, s; negative in the run-in
    pose: Pose  # places of the links, and how they move
    turn: Turn  # angle and speed of the crank
    pull: Pull  # stretch and tension of the tendons
    flow: Flow  # motion of the strips through the water
    water: StripForces  # quasi-steady forces on the strips
    layout: Layout  # layout of the fish, common to all
    chain: Chain  # dynamics of its links
    parameters: Parameters  # parameters of these simulations

    def bend(self, torque_n_m: np.ndarray) -> np.ndarray:
        """Return the (n, N) generalised force of torques (n, h) that bend the hinges."""
        torque = np.zeros_like(self.pose.angle_rad)
        torque[:, 1:] += torque_n_m
        torque[:, :-1] -= torque_n_m
        return np.concatenate([np.zeros((len(torque), 2)), torque], axis=1)

    def tighten(self, tension_n: np.ndarray) -> np.ndarray:
        """Return the (n, N) generalised force of tension (n, 2) added to that of the tendons."""
        return -(tension_n[:, None] @ self.pull.gradient_m)[:, 0]

    def push(self, link: int, place: complex | np.ndarray, force_n: np.ndarray) -> np.ndarray:
        """Return the (n, N) generalised force of forces (n,), complex, pool axes, at a place in a link's axes, m."""
        force_n = np.reshape(force_n, (-1, 1))
        force, torque = np.zeros(self.pose.direction.shape, complex), np.zeros(self.pose.direction.shape)
        force[:, [link]] = force_n
        torque[:, [link]] = (np.conj(place * self.pose.direction[:, [link]]) * force_n).imag
        return self.chain.generalised(self.pose, force, torque)


def rows_of(record: _Rows, index: np.ndarray | slice, **known: Any) -> _Rows:
    """Return some rows of a dataclass of arrays, and of those in it, but for fields known; what has none stays.

    Of rows side by side it is a view: nobody writes into what is shown.
    """
    kind: Any = type(record)
    names = _list_field_names(kind)
    return kind(**{n: known[n] if n in known else _select_rows(getattr(record, n), index) for n in names})


def _select_rows(value: Any, index: np.ndarray | slice) -> Any:
    if isinstance(value, np.ndarray):
        return value[index]
    kind: Any = type(value)
    return rows_of(value, index) if _list_field_names(kind) and not isinstance(value, Layout) else value


@cache
def _list_field_names(kind: type) -> tuple[str, ...]:
    """Return the names of a dataclass's fields; none of anything else."""
    return tuple(each.name for each in fields(kind)) if is_dataclass(kind) else ()
