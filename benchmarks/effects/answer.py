"""What is true of a withheld session, in a file apart from it."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from session.records import from_plain, to_plain
from session.results import plain_json, write_whole

Kind = Literal["null", "single", "double", "many", "outside"]


@dataclass(frozen=True)
class Answer:
    """Of one session.

    Attributes:
        session: its name.
        kind: no effect, one, two or many of the catalogue, or one that the catalogue does not hold.
        effects: names of the catalogue that are present.
        outside: name of what is present and not in the catalogue; None where all is.
        alike: for each of the effects, those that these data cannot tell from it (two-way error above 5 %).
        detectability: whitened distance from the nearest rival, each refitted; of the weakest of several, 0 of null.
        stage: where the effect acts; None for null and for effects at several stages.
        oracle_shrinkage: share by which the twin's own form of the true effects, refitted on the fit trials, shrinks
            the gap of the held-out ones, both without noise: what can be reached, and what an interval should hold;
            None for null and outside.
        seed: of all that was drawn for the session.
        strengths: that each of what is present was made with.
    """

    session: str
    kind: Kind
    effects: tuple[str, ...] = ()
    outside: str | None = None
    alike: tuple[tuple[str, ...], ...] = ()
    detectability: float = 0.0
    stage: str | None = None
    oracle_shrinkage: float | None = None
    seed: int = 0
    strengths: tuple[float, ...] = ()

    def present(self, name: str) -> bool:
        """Whether an effect of this name is."""
        return name in self.effects

    @classmethod
    def read(cls, path: Path) -> Self:
        """The answer in a file.

        Raises:
            KeyError, TypeError, ValueError: it holds none.
        """
        answer: Self = from_plain(cls, json.loads(path.read_text()))
        return answer

    def write(self, path: Path) -> None:
        """As plain JSON: nothing that diagnoses imports this package or looks into the folder of answers.

        Raises:
            ResultsNotWritable: the folder is not writable.
        """
        write_whole(path, json.dumps(plain_json(to_plain(self)), indent=1) + "\n")
