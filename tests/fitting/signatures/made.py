"""An effect that does what it is given, and nothing else."""

from __future__ import annotations

from typing import ClassVar

from swimcal.effects.effect import Effect, Parameter
from swimcal.session_file import TrialKind


class Made(Effect):
    """Only what its signature says, with parameters between bounds."""

    family = "structure"
    stage = "tail"
    physics = source = "made up"
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"swim"})

    def __init__(self, name: str, *bounds: tuple[float, float], sd: float = 1.0) -> None:
        self.name = name  # type: ignore[misc]
        self.parameters = tuple(Parameter(f"strength_{i}", "1", low, high, sd) for i, (low, high) in enumerate(bounds))
