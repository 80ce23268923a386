"""Scores of finished clips, kept beside the videos: a benchmark that broke off goes on where it was."""

import json
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TypeVar

import cv2

import tracking
from session import fingerprint_of, sha256_of, write_whole

Score = TypeVar("Score")


def kept(folder: Path, name: str, truth: Path, measure: Callable[[], Score], make: Callable[..., Score]) -> Score:
    """The score that stands there, or a new one; one of another clip or of other code is not used.

    Args:
        folder: for the file.
        name: of the file, without its ending.
        truth: the file that the clip was rendered with.
        measure: gives the score where none stands.
        make: takes a kept score's fields by name.
    """
    path, fingerprint = folder / f"{name}.json", fingerprint_of({"truth": sha256_of(truth)}, {"code": _code()})
    with suppress(OSError, ValueError, KeyError, TypeError):
        stands = json.loads(path.read_text())
        if stands["fingerprint"] == fingerprint:
            return make(**stands["score"])
    score = measure()
    write_whole(path, json.dumps({"fingerprint": fingerprint, "score": vars(score)}))
    return score


@cache
def _code() -> dict[str, str]:
    """What a score depends on beside the clip: the tracker, how it is scored, and OpenCV."""
    roots = (Path(tracking.__file__).parent, Path(__file__).parent)
    files = sorted(path for root in roots for path in root.rglob("*.py"))
    return {"opencv": cv2.__version__} | {f"{path.parent.name}/{path.name}": sha256_of(path) for path in files}
