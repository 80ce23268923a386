"""Damaged and odd files drawn at random from one rendered clip: what is refused, set aside and believed.

A clip is packed anew in containers that people use, with pictures dropped, repeated, stamped anew, turned or gray, and
then bytes are zeroed, overwritten or cut off. Each file is tracked as a session's video is; the right place of a marker
is the one at the time that the file itself says.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple, cast

import av
import numpy as np

from benchmarks.cases import Progress
from benchmarks.scores import Table
from benchmarks.video.camera import Optics
from benchmarks.video.plan import ClipPlan, Swim
from benchmarks.video.scene import PoolScene
from benchmarks.video.truth import ClipTruth
from calib.pipeline import Pipeline, open_session
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import SwimcalError
from swimcal.tracks import pixels_of
from tracking.boxes import save_boxes

PLAN = ClipPlan(
    frames=48,
    swim=Swim(frequency_hz=1.2, drift_m_s=(0.03, 0.0)),
    optics=Optics(width_px=640, height_px=360, px_per_m=600.0, fps=50.0),
)
WRONG_PX = 10.0
"""Distance from its place at the time that the file says, from which on a sample is wrong."""
FAULTS = {
    "packed": ("as it is",),
    "picture": ("gray", "turned"),
    "timing": ("dropped", "dropped, closed up", "repeated", "jittered", "late", "slow"),
    "bytes": ("zeroed", "overwritten", "cut off"),
}
"""The kinds of faults of a file, one of each at most, and the faults of each kind."""
_SECOND_SHARE = 0.4  # probability of a second fault
_TURN_DEG = 90
_TICK_S = Fraction(1, 50_000)  # unit of the stamps
_LATE_S = 3.2


class Container(NamedTuple):
    """Way to pack a file: its suffix, its codec, and what it cannot hold."""

    suffix: str
    codec: str = "libx264"
    format: str | None = None
    cannot: tuple[str, ...] = ()


CONTAINERS = {
    "MP4": Container(".mp4"),
    "MOV": Container(".mov"),
    "MKV": Container(".mkv", cannot=("turned",)),
    "AVI": Container(".avi", "mpeg4", cannot=("turned", "jittered", "late")),
    "raw H.264": Container(".h264", format="h264", cannot=("turned", "dropped", "jittered", "late", "slow")),
    "GIF": Container(".gif", "gif", cannot=("turned", "jittered", "late")),
}


@dataclass(frozen=True)
class OddFile:
    """Damaged or odd file.

    Attributes:
        container: key of `CONTAINERS`.
        faults: keys of `FAULTS`, of different kinds.
        seed: seed of what is drawn at random in them.
    """

    container: str
    faults: tuple[str, ...]
    seed: int

    def write(self, folder: Path, pictures: Sequence[np.ndarray]) -> Path:
        """Pack pictures (h, w, 3), RGB, and do the damage; return the file."""
        container, random = CONTAINERS[self.container], np.random.default_rng(self.seed)
        path = folder / f"film{container.suffix}"
        shown = self._list_shown(len(pictures), random)
        with av.open(str(path), "w", format=container.format, options={"fflags": "+bitexact"}) as out:
            added = out.add_stream(container.codec, rate=round(PLAN.optics.fps), options={"g": "12"})
            stream = cast(av.VideoStream, added)
            turned = "turned" in self.faults
            height, width = pictures[0].shape[:2]
            stream.width, stream.height = (height, width) if turned else (width, height)
            stream.pix_fmt = self._pixels
            stream.codec_context.time_base = _TICK_S
            if turned:
                stream.set_display_rotation(_TURN_DEG)
            for number, time_s in shown:
                stored = np.rot90(pictures[number], -(_TURN_DEG // 90)) if turned else pictures[number]
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(stored), format="rgb24")
                if "gray" in self.faults:
                    frame = frame.reformat(format="gray")
                frame = frame.reformat(format=self._pixels)
                frame.pts, frame.time_base = round(time_s / _TICK_S), _TICK_S
                out.mux(stream.encode(frame))
            out.mux(stream.encode(None))
        path.write_bytes(self._harm(path.read_bytes(), random))
        return path

    @property
    def _pixels(self) -> str:
        if CONTAINERS[self.container].codec == "gif":
            return "gray" if "gray" in self.faults else "rgb8"
        return "gray" if "gray" in self.faults and CONTAINERS[self.container].codec == "libx264" else "yuv420p"

    def _list_shown(self, frames: int, random: np.random.Generator) -> list[tuple[int, float]]:
        """List the pictures of the file, by number, with the time each is stamped with, s."""
        numbers, spacing_s = np.arange(frames), 1 / PLAN.optics.fps
        time_s = numbers * spacing_s
        for fault in self.faults:
            if fault == "dropped":
                kept = np.setdiff1d(numbers, random.choice(numbers[1:], random.integers(1, 8), replace=False))
                numbers, time_s = kept, time_s[kept]
            elif fault == "dropped, closed up":
                first = int(random.integers(5, frames - 12))
                numbers = np.delete(numbers, slice(first, first + int(random.integers(1, 8))))
                time_s = time_s[: len(numbers)]
            elif fault == "repeated":
                every = int(random.integers(2, 7))
                numbers = numbers - (numbers % every == every - 1)
            elif fault == "jittered":
                time_s = time_s + np.abs(random.uniform(0, 0.5, frames)) * spacing_s
            elif fault == "late":
                time_s = time_s + _LATE_S
            elif fault == "slow":
                time_s = 2 * time_s
        return list(zip(numbers.tolist(), time_s.tolist(), strict=True))

    def _harm(self, data: bytes, random: np.random.Generator) -> bytes:
        harmed = bytearray(data)
        if "cut off" in self.faults:
            return data[: int(random.uniform(0.05, 0.98) * len(data))]
        for fault in set(self.faults) & {"zeroed", "overwritten"}:
            for _ in range(random.integers(1, 6)):
                at, length = int(random.integers(len(data))), int(10 ** random.uniform(0.5, 3.3))
                length = min(length, len(data) - at)
                harmed[at : at + length] = bytes(length) if fault == "zeroed" else random.bytes(length)
        return bytes(harmed)


def draw_files(seed: int, count: int) -> list[OddFile]:
    """Draw files, each fault about as often, some with a second one."""
    random = np.random.default_rng(seed)
    every = [(kind, fault) for kind, faults in FAULTS.items() for fault in faults]
    return [_draw(random, *every[k % len(every)]) for k in range(count)]


def _draw(random: np.random.Generator, kind: str, fault: str) -> OddFile:
    faults = [fault]
    if kind != "packed" and random.random() < _SECOND_SHARE:
        others = [second for other, names in FAULTS.items() if other not in (kind, "packed") for second in names]
        faults.append(str(random.choice(others)))
    names = [name for name, each in CONTAINERS.items() if not set(faults) & set(each.cannot)]
    return OddFile(str(random.choice(names)), tuple(faults), int(random.integers(2**31)))


@dataclass(frozen=True)
class Outcome:
    """Outcome of one file.

    Attributes:
        refused: message where it is not tracked; empty where it is.
        traceback: traceback of an error that is no sentence for the user; empty without.
        samples: number of samples that count.
        wrong: number of these that are more than 10 px off.
        unflagged: number of the wrong ones that are in no flagged frame.
    """

    refused: str = ""
    traceback: str = ""
    samples: int = 0
    wrong: int = 0
    unflagged: int = 0


class Filmed(NamedTuple):
    """Clip on film: its pictures (h, w, 3), RGB, and its truth."""

    pictures: Sequence[np.ndarray]
    truth: ClipTruth


def film_clip(plan: ClipPlan = PLAN) -> Filmed:
    """Render the clip that the files are made of."""
    scene = PoolScene(plan)
    data = [scene.picture(number).data for number in range(plan.frames)]
    pictures = [av.VideoFrame.from_ndarray(each, format="yuv420p").to_ndarray(format="rgb24") for each in data]
    return Filmed(pictures, scene.truth)


def track_file(file: OddFile, filmed: Filmed, folder: Path) -> Outcome:
    """Track one file as the video of a session in an empty folder, and compare it with the truth."""
    path = file.write(folder, filmed.pictures)
    save_boxes(folder / "film.boxes.json", filmed.truth.start_boxes())
    names = ", ".join(f'"{name}"' for name in FISHSIM_MARKERS)
    (folder / "session.toml").write_text(
        f'[session]\nname = "odd"\n[camera]\nfps = {PLAN.optics.fps}\nscale_length_m = 0.142\n'
        f'[markers]\nnames = [{names}]\n[[trial]]\nname = "film"\nkind = "swim"\nvideo = "{path.name}"\n'
        'boxes = "film.boxes.json"\n'
    )
    try:
        pipeline = Pipeline(open_session(folder, needs_commands=False))
        tracked = pipeline.recordings.videos.tracks(pipeline.session.trial("film"))
    except SwimcalError as problem:
        return Outcome(refused=str(problem))
    except Exception:
        return Outcome(traceback=traceback.format_exc())
    counts, place = tracked.weight.values > 0, pixels_of(tracked)
    wrong = counts & (_measure_off_px(place, counts, tracked.time.values, filmed.truth) > WRONG_PX)
    flagged = np.zeros(len(counts), bool)
    for flag in tracked.flags:
        if flag.frames is not None:
            flagged[flag.frames[0] : flag.frames[1] + 1] = True
    return Outcome(samples=int(counts.sum()), wrong=int(wrong.sum()), unflagged=int((wrong & ~flagged[:, None]).sum()))


def _measure_off_px(place: np.ndarray, counts: np.ndarray, time_s: np.ndarray, truth: ClipTruth) -> np.ndarray:
    """Measure how far samples (n, m, 2) are from the truth at their times, from whichever frame the file begins at."""
    best = np.full(counts.shape, np.inf)
    for start_s in truth.time_s:
        own_s = time_s + start_s
        true = [
            np.stack([np.interp(own_s, truth.time_s, truth.shown_px[:, k, axis]) for axis in (0, 1)], axis=1)
            for k in range(len(truth.markers))
        ]
        off = np.linalg.norm(place - np.stack(true, axis=1), axis=2)
        if not counts.any() or off[counts].mean() < best[counts].mean():
            best = off
    return best


def follow_files(files: Sequence[OddFile], filmed: Filmed, folder: Path, progress: Progress) -> list[Outcome]:
    """Track each file in a folder of its own."""
    outcomes = []
    for number, file in enumerate(files):
        progress("damaged and odd files", number / len(files))
        own = folder / f"{number:03d}"
        own.mkdir(parents=True)
        outcomes.append(track_file(file, filmed, own))
    return outcomes


def damaged_table(folder: Path, count: int, progress: Progress) -> Table:
    """Build a row a fault and one a container, over files drawn at random; a file of two faults is in both rows."""
    files = draw_files(seed=0, count=count)
    outcomes = dict(zip(files, follow_files(files, film_clip(), folder, progress), strict=True))
    rows = [_build_row(fault, outcomes, fault) for faults in FAULTS.values() for fault in faults]
    rows += [_build_row(name, outcomes, name) for name in CONTAINERS]
    columns = ("files", "number", "refused", "tracebacks", "samples", "10 px off", "of these not flagged")
    return Table("Damaged and odd files", columns, (*rows, _build_row("all", outcomes, "")))


def _build_row(name: str, outcomes: Mapping[OddFile, Outcome], having: str) -> tuple[str, ...]:
    own = [each for file, each in outcomes.items() if not having or having in (*file.faults, file.container)]
    numbers = (
        len(own),
        sum(bool(each.refused) for each in own),
        sum(bool(each.traceback) for each in own),
        *(sum(getattr(each, key) for each in own) for key in ("samples", "wrong", "unflagged")),
    )
    return name, *map(str, numbers)
