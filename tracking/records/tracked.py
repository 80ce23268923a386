"""A tracked trial: tracks, and for every sample how it came about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from session import Flag, Tracks
from tracking.stretches import stretches


class SampleState(IntEnum):
    """How a sample came about."""

    MISSING = 0
    """There is none."""
    MEASURED = 1
    """The tracker found the marker in the picture."""
    PREDICTED = 2
    """The tracker carried the motion on without seeing the marker."""
    INTERPOLATED = 3
    """Filled in afterwards, from samples before and after."""
    BY_HAND = 4
    """Set by a person."""

    @property
    def word(self) -> str:
        """The state as files write it: ``by_hand``."""
        return self.name.lower()


STATE_WORDS = {state.word: state for state in SampleState}
"""The states by the words that files use."""
SEEN = (SampleState.MEASURED, SampleState.BY_HAND)
"""The states of samples that somebody or something saw; the others are guesses."""
UNTRUSTED = ("lost_marker", "drift", "size", "swap")
"""Flags of the tracker's own judgement whose samples count nowhere."""
ONLY_CSRT = "only_csrt"

SAMPLE = np.dtype(
    [("position_px", float, 2), ("confidence", float), ("state", np.int8), ("size_px", float), ("by_csrt", bool)]
)
"""All that is known of one sample, as in `TrackedTrial`; `by_csrt`: only CSRT saw it."""
NO_SAMPLE = np.array(((np.nan, np.nan), 0.0, SampleState.MISSING, np.nan, False), SAMPLE)


@dataclass(frozen=True, eq=False)
class TrackedTrial:
    """What the tracker measures in n frames of m markers.

    Attributes:
        tracks: positions and confidences.
        state: (n, m) int8 of `SampleState`; MISSING exactly where the position is nan.
        size_px: (n, m) apparent diameter of the marker, px; nan where not measured.
        flags: what is doubtful.
        weight: (n, m) in [0, 1], what each sample counts in a fit (`tracking.tracker.trusted`); None: not judged yet.
        first_frame: that of the boxes.
        picture_px: width and height of the video; None where the tracks come from elsewhere.
    """

    tracks: Tracks
    state: np.ndarray
    size_px: np.ndarray
    flags: tuple[Flag, ...] = ()
    weight: np.ndarray | None = None
    first_frame: int = 0
    picture_px: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        expected = self.tracks.confidence.shape
        for name in ("state", "size_px"):
            if (found := np.shape(getattr(self, name))) != expected:
                raise ValueError(f"{name}: found shape {found}, expected {expected}, one for each sample")
        if unknown := set(np.unique(self.state).tolist()) - set(SampleState):
            raise ValueError(f"state: found {sorted(unknown)}, expected values of SampleState, 0 to {max(SampleState)}")
        wrong = np.argwhere((self.state == SampleState.MISSING) != np.isnan(self.tracks.position_px).any(axis=2))
        if len(wrong):
            row, k = wrong[0].tolist()
            raise ValueError(
                f"{len(wrong)} samples are MISSING with a position, or have none without being MISSING; "
                f"the first: {self.tracks.markers[k]} in frame {row}"
            )

    @classmethod
    def of(cls, tracks: Tracks, flags: tuple[Flag, ...] = ()) -> TrackedTrial:
        """Tracks from elsewhere: measured where there is a position, of unknown size."""
        present = np.isfinite(tracks.position_px).all(axis=2)
        state = np.where(present, SampleState.MEASURED, SampleState.MISSING).astype(np.int8)
        return cls(tracks, state, np.full(state.shape, np.nan), flags)

    @property
    def seen(self) -> np.ndarray:
        """(n, m) True where the sample is measured or set by hand."""
        return np.isin(self.state, SEEN)

    @property
    def counting(self) -> Tracks:
        """The tracks with confidence 0 where a sample was not seen, or is flagged by the tracker's judgement."""
        counts = self.seen
        for flag in self.flags:
            if flag.kind in UNTRUSTED and flag.frames is not None:
                columns = [self.tracks.markers.index(name) for name in flag.markers]
                counts[flag.frames[0] : flag.frames[1] + 1, columns] = False
        return replace(self.tracks, confidence=np.where(counts, self.tracks.confidence, 0.0))

    @property
    def samples(self) -> np.ndarray:
        """(n, m) of `SAMPLE`, a copy to work on."""
        samples = np.empty(self.state.shape, SAMPLE)
        samples["position_px"], samples["confidence"] = self.tracks.position_px, self.tracks.confidence
        samples["state"], samples["size_px"], samples["by_csrt"] = self.state, self.size_px, False
        for flag in self.flags:
            if flag.kind == ONLY_CSRT and flag.frames is not None:
                columns = [self.tracks.markers.index(name) for name in flag.markers]
                samples["by_csrt"][flag.frames[0] : flag.frames[1] + 1, columns] = True
        return samples

    def with_samples(self, samples: np.ndarray, flags: tuple[Flag, ...]) -> TrackedTrial:
        """The same frames and markers with other samples (n, m) of `SAMPLE`."""
        position, confidence, state, size = (samples[name].copy() for name in (SAMPLE.names or ())[:4])
        tracks = replace(self.tracks, position_px=position, confidence=confidence)
        return replace(self, tracks=tracks, state=state, size_px=size, flags=flags)


def only_csrt_flags(by_csrt: np.ndarray, markers: Sequence[str]) -> tuple[Flag, ...]:
    """One flag for each stretch of each marker in (n, m) bool."""
    return tuple(
        Flag(ONLY_CSRT, (name,), span, f"no spot answers, only CSRT sees {name}")
        for k, name in enumerate(markers)
        for span in stretches(by_csrt[:, k])
    )
