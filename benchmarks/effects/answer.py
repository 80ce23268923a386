"""What is true of a withheld session, sealed apart from it until every diagnosis is written."""

import base64
import json
import zlib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from hashlib import sha256, shake_256
from pathlib import Path
from typing import Any, Literal

from session import FaultCollector, plain_json, write_whole

Kind = Literal["null", "single", "double", "many", "outside"]
_PER_LINE = 120
_BLOCK = 1024  # bytes that every sealed file is filled up to: how long an answer is would tell how much there is to say


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


def seal(answers: Iterable[Answer], path: Path) -> str:
    """Writes answers so that nobody reads them by chance; returns the sha256 of the file, to be published beside it.

    Sealed is not secret: it keeps an eye, a search or a classifier off, not somebody who wants to know.

    Raises:
        ResultsNotWritable: the folder is not writable.
    """
    plain = json.dumps([plain_json(asdict(answer)) for answer in answers]).encode()
    packed = zlib.compress(plain, 9)
    text = base64.b64encode(packed + shake_256(packed).digest(-len(packed) % _BLOCK)).decode()
    lines = [text[i : i + _PER_LINE] for i in range(0, len(text), _PER_LINE)]
    write_whole(path, "\n".join(lines) + "\n")
    return checksum(path)


def unseal(path: Path, expected: str) -> tuple[Answer, ...]:
    """Answers whose file has the checksum that was published.

    Raises:
        InputError: it has another, or holds no answers.
    """
    faults = FaultCollector(str(path))
    if (found := checksum(path)) != expected:
        faults.add(
            "",
            "not the answers of these sessions: another checksum",
            found=found,
            expected=expected,
            next_step="Take sessions and answers from the same suite.",
        )
    faults.raise_if_any()
    stands: list[dict[str, Any]] = json.loads(zlib.decompressobj().decompress(base64.b64decode(path.read_text())))
    return tuple(answer_of(each) for each in stands)


def checksum(path: Path) -> str:
    """Of a file."""
    return sha256(path.read_bytes()).hexdigest()


def answer_of(stands: dict[str, Any]) -> Answer:
    """From its fields as JSON.

    Raises:
        KeyError, TypeError: these are no fields of an answer.
    """
    alike = tuple(tuple(names) for names in stands["alike"])
    strengths = tuple(stands.get("strengths", ()))
    return Answer(**stands | {"effects": tuple(stands["effects"]), "alike": alike, "strengths": strengths})
