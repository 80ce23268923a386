"""Tracked markers of one video: how each sample came about, what of them counts, and the files on disk.

`with_states` adds states and sizes to tracks. `save_tracked` writes them with their flags: the tracks in the form that
the documentation promises, the states and the flags beside them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from swimcal.errors import Fault, FaultCollector, InputError, shown
from swimcal.flags import Flag
from swimcal.results import writing_whole
from swimcal.tables import RawTable, read_table, read_text
from swimcal.tracks import as_tracks, load_tracks, markers_of, pixels_of, save_tracks
from tracking.harmed_frames import LONGEST, stretches

INDISTINCT = "indistinct"
"""The flag of a marker that counts in no frame."""
UNTRUSTED = ("lost_marker", "drift", "size", "swap", "damaged_video", INDISTINCT)
"""Flags of the tracker's own judgement, and of the reader's, whose samples count nowhere."""
REPEATED = "repeated_frames"
"""The flag of a film in which pictures repeat the one before."""
ONLY_CSRT = "only_csrt"

SAMPLE = np.dtype(
    [("position_px", float, 2), ("confidence", float), ("state", np.int8), ("size_px", float), ("by_csrt", bool)]
)
"""All that is known of one sample, as in `with_states`; `by_csrt`: only CSRT saw it."""

AGAIN = "Make it again with `calib track`."


class SampleState(IntEnum):
    """Origin of a sample."""

    MISSING = 0
    """There is no sample."""
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
        """State as files write it: ``by_hand``."""
        return self.name.lower()


STATE_WORDS = {state.word: state for state in SampleState}
"""The states by the words that files use."""
STATE_MEANINGS = {  # what the states' numbers mean, in the form of the CF conventions (section 3.5, flags)
    "flag_values": np.array(list(SampleState), dtype=np.int8),
    "flag_meanings": " ".join(state.word for state in SampleState),
}
SEEN = (SampleState.MEASURED, SampleState.BY_HAND)
"""The states of samples that somebody or something saw; the others are guesses."""
NO_SAMPLE = np.array(((np.nan, np.nan), 0.0, SampleState.MISSING, np.nan, False), SAMPLE)


def with_states(tracks: xr.Dataset, state: np.ndarray, size_px: np.ndarray, flags: Sequence[Flag] = ()) -> xr.Dataset:
    """Add to tracks (n frames of m markers) how each sample came about.

    Args:
        tracks: the tracks.
        state: (n, m) int8 of `SampleState`, MISSING exactly where the position is nan.
        size_px: (n, m) apparent diameter of the marker, px, nan where not measured.
        flags: the doubts about them.

    Returns:
        The same with the variables ``state`` and ``size`` (time, keypoint), and the attributes ``flags``,
        ``first_frame``, that of the boxes, and ``picture_px``, width and height of the video, None where the tracks
        come from elsewhere. `tracking.judgement.trusted` adds the variable ``weight`` in [0, 1], what each sample
        counts in a fit.
    """
    expected = tracks.confidence.shape
    for name, values in (("state", state), ("size_px", size_px)):
        if (found := np.shape(values)) != expected:
            raise ValueError(f"{name}: found shape {found}, expected {expected}, one for each sample")
    if unknown := set(np.unique(state).tolist()) - set(SampleState):
        raise ValueError(f"state: found {sorted(unknown)}, expected values of SampleState, 0 to {max(SampleState)}")
    wrong = np.argwhere((state == SampleState.MISSING) != np.isnan(pixels_of(tracks)).any(axis=2))
    if len(wrong):
        row, k = wrong[0].tolist()
        raise ValueError(
            f"{len(wrong)} samples are MISSING with a position, or have none without being MISSING; "
            f"the first: {markers_of(tracks)[k]} in frame {row}"
        )
    of_samples = ("time", "keypoint")
    variables = {
        "state": (of_samples, state, STATE_MEANINGS),
        "size": (of_samples, size_px, {"units": "px", "long_name": "apparent diameter"}),
    }
    own = {"first_frame": 0, "picture_px": None} | tracks.attrs | {"flags": tuple(flags)}
    return tracks.assign(variables).assign_attrs(own)


def as_tracked(tracks: xr.Dataset, flags: Sequence[Flag] = ()) -> xr.Dataset:
    """Add states to tracks from elsewhere: measured where there is a position, of unknown size."""
    present = np.isfinite(pixels_of(tracks)).all(axis=2)
    state = np.where(present, SampleState.MEASURED, SampleState.MISSING).astype(np.int8)
    return with_states(tracks, state, np.full(state.shape, np.nan), flags)


def seen_in(tracked: xr.Dataset) -> np.ndarray:
    """Tell for each sample (n, m) whether it was measured or set by hand."""
    return np.isin(tracked.state.values, SEEN)


def repeated_frames(tracked: xr.Dataset) -> np.ndarray:
    """Tell for each frame (n,) whether it was left out because it repeats the one before.

    No marker is seen or lost in such a frame.
    """
    seen = np.asarray(seen_in(tracked).any(axis=1))
    left_out = np.zeros(len(seen), bool)
    if any(flag.kind == REPEATED for flag in tracked.flags):
        for first, last in stretches(~seen):
            left_out[first : last + 1] = last - first < LONGEST
    return left_out


def drop_repeat_flags(tracked: xr.Dataset, flags: Iterable[Flag]) -> tuple[Flag, ...]:
    """Drop the flags for samples missing in frames that repeat the one before: one flag tells of all of them."""
    left_out = repeated_frames(tracked)
    return tuple(
        flag
        for flag in flags
        if flag.kind != "gap" or flag.frames is None or not left_out[flag.frames[0] : flag.frames[1] + 1].all()
    )


def mask_untrusted(tracked: xr.Dataset) -> xr.Dataset:
    """Return the tracks alone, with confidence 0 where a sample was not seen or is flagged by the tracker."""
    counts, names = seen_in(tracked), markers_of(tracked)
    for flag in tracked.flags:
        if flag.kind in UNTRUSTED and (flag.frames is not None or flag.kind == INDISTINCT):
            columns = [names.index(name) for name in flag.markers or names]
            first, last = flag.frames or (0, len(counts))
            counts[first : last + 1, columns] = False
    confidence = np.where(counts, tracked.confidence.values, 0.0)
    return as_tracks(names, tracked.time.values, pixels_of(tracked), confidence, tracked.source)


def samples_of(tracked: xr.Dataset) -> np.ndarray:
    """Return all samples as an (n, m) array of `SAMPLE`, a copy to work on."""
    samples, names = np.empty(tracked.state.shape, SAMPLE), markers_of(tracked)
    samples["position_px"], samples["confidence"] = pixels_of(tracked), tracked.confidence.values
    samples["state"], samples["size_px"], samples["by_csrt"] = tracked.state.values, tracked["size"].values, False
    for flag in tracked.flags:
        if flag.kind == ONLY_CSRT and flag.frames is not None:
            columns = [names.index(name) for name in flag.markers]
            samples["by_csrt"][flag.frames[0] : flag.frames[1] + 1, columns] = True
    return samples


def with_samples(tracked: xr.Dataset, samples: np.ndarray, flags: Sequence[Flag]) -> xr.Dataset:
    """Return the same frames and markers with other samples; weights are dropped.

    Args:
        tracked: the tracks.
        samples: (n, m) of `SAMPLE`.
        flags: the flags of the result.
    """
    position, confidence, state, size = (samples[name].copy() for name in (SAMPLE.names or ())[:4])
    tracks = as_tracks(markers_of(tracked), tracked.time.values, position, confidence)
    return with_states(tracks.assign_attrs(tracked.attrs), state, size, flags)


def only_csrt_flags(by_csrt: np.ndarray, markers: Sequence[str]) -> tuple[Flag, ...]:
    """Return one flag for each stretch of each marker that only CSRT saw.

    Args:
        by_csrt: (n, m) samples that only CSRT saw.
        markers: names of the m markers.
    """
    return tuple(
        Flag(ONLY_CSRT, (name,), span, f"no spot answers, only CSRT sees {name}")
        for k, name in enumerate(markers)
        for span in stretches(by_csrt[:, k])
    )


class TrackedFiles(NamedTuple):
    """The three files of a tracked trial.

    Attributes:
        tracks: ``<trial>.csv``, the tracks of the public contract.
        states: ``<trial>.states.csv``, header ``time_s,<marker>_state,<marker>_size_px,…``.
        flags: ``<trial>.flags.json``, a list of flags in the form of the public contract.
    """

    tracks: Path
    states: Path
    flags: Path

    @classmethod
    def of(cls, folder: Path, trial: str) -> TrackedFiles:
        """Return the files of a trial in a folder."""
        return cls(*(folder / f"{trial}{suffix}" for suffix in (".csv", ".states.csv", ".flags.json")))


def save_tracked(folder: Path, trial: str, tracked: xr.Dataset) -> TrackedFiles:
    """Write the three files of a tracked trial; none of them appears before all are written.

    The tracks come last: where they are, so are the others.

    Args:
        folder: the folder of the files.
        trial: name of the trial.
        tracked: the tracks with states, sizes and flags.

    Raises:
        ResultsNotWritable: a file cannot be written; what stood there is unchanged.
    """
    files = TrackedFiles.of(folder, trial)
    flags = [flag.to_json() for flag in tracked.flags]
    with (
        writing_whole(files.tracks) as tracks,
        writing_whole(files.states) as states,
        writing_whole(files.flags) as part,
    ):
        save_tracks(tracks, tracked)
        states.write_text(_states_csv(tracked), encoding="utf-8", newline="\n")
        part.write_text(json.dumps(flags, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n")
    return files


def load_tracked(folder: Path, trial: str) -> xr.Dataset:
    """Read a trial that `save_tracked` wrote, every number as it was.

    Args:
        folder: the folder of the files.
        trial: name of the trial.

    Raises:
        InputError: every fault of the three files at once.
    """
    files = TrackedFiles.of(folder, trial)
    faults = FaultCollector()
    tracks, state, size_px = None, np.zeros(0), np.zeros(0)
    flags: tuple[Flag, ...] = ()
    with faults.nested():
        tracks = load_tracks(files.tracks, _markers(read_table(files.tracks)), fps=1.0, minimum=1)
    with faults.nested():
        flags = _load_flags(files.flags)
    if tracks is not None:
        with faults.nested():
            state, size_px = _load_states(files.states, tracks)
    faults.raise_if_any()
    assert tracks is not None
    return with_states(tracks, state, size_px, flags)


def _markers(table: RawTable) -> tuple[str, ...]:
    markers = tuple(name.removesuffix("_x") for name in table.header or () if name.endswith("_x"))
    if not markers:
        first = ",".join(table.header or table.rows[0].cells)
        expected = "a header time_s,<marker>_x,<marker>_y,<marker>_confidence,…"
        raise InputError([Fault(table.file, "line 1", "no header of tracks", shown(first), expected, (), AGAIN)])
    return markers


def _states_csv(tracked: xr.Dataset) -> str:
    words = np.array([state.word for state in SampleState])[tracked.state.values]  # (n, m)
    columns = [tracked.time.values]
    for word, size_px in zip(words.T, tracked["size"].values.T, strict=True):
        columns += [word, size_px]
    return pd.DataFrame(dict(zip(_names(markers_of(tracked)), columns, strict=True))).to_csv(index=False)


def _names(markers: tuple[str, ...]) -> tuple[str, ...]:
    return ("time_s", *(f"{marker}{suffix}" for marker in markers for suffix in ("_state", "_size_px")))


def _load_states(path: Path, tracks: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Read the states and sizes, both (n, m), and check that they fit the tracks."""
    table = read_table(path)
    absent = np.isnan(pixels_of(tracks)[..., 0])  # (n, m)
    try:
        cells = np.array([row.cells for row in table.rows])  # (n, 1 + 2 m)
        time_s, words, sizes = cells[:, 0].astype(float), cells[:, 1::2], cells[:, 2::2]
        state = np.array([[STATE_WORDS[word] for word in row] for row in words.tolist()], np.int8)
        size_px = np.where(sizes == "", "nan", sizes).astype(float)
        fit = table.header == _names(markers_of(tracks)) and np.array_equal(time_s, tracks.time.values)
        fit = fit and np.array_equal(state == SampleState.MISSING, absent)
    except (ValueError, KeyError, IndexError):
        fit = False
    if not fit:
        expected = f"a row for each of {len(absent)} frames, missing where there is no position"
        found = f"{len(table.rows)} rows of {shown(table.header)}"
        raise InputError([Fault(table.file, "", "not the states of the tracks next to it", found, expected, (), AGAIN)])
    return state, size_px


def _load_flags(path: Path) -> tuple[Flag, ...]:
    try:
        return tuple(Flag.from_json(flag) for flag in json.loads(read_text(path)))
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        found, expected = f"{type(error).__name__}: {error}", '[{"kind": "…", …}, …]'
        raise InputError([Fault(str(path), "", "not a list of flags", found, expected, (), AGAIN)]) from error
