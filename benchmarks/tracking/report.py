"""All parts of `python -m benchmarks tracking` in one run."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.cases import Progress
from benchmarks.scores import Scores, Table
from benchmarks.tracking.accuracy import SPEED_CLIP, Clip, accuracy_table, clips_of, measure_accuracy, render_clips
from benchmarks.tracking.damaged import damaged_table
from benchmarks.tracking.fast_starts import fast_starts_table
from benchmarks.tracking.from_video import cost_table
from benchmarks.tracking.speed import speed_table
from benchmarks.video.clips import BENCHMARK_CLIPS
from benchmarks.video.render import Encoding
from swimcal.errors import Fault, InputError

SPEED_ENCODINGS = (Encoding("h264", 23), Encoding("hevc", 23))
FIT_CRF = 23.0
STARTS = 200  # number of clips that begin in full beat
DAMAGED = 100  # number of damaged files


def measure_tracking(folder: Path, part: str, clips: Sequence[str], progress: Progress) -> Scores:
    """Measure accuracy, speed and the cost in the coefficients ("fit"), or one part of that.

    Args:
        folder: folder in which rendered videos are kept and found again.
        part: "accuracy", "starts", "damaged", "speed", "fit" or "all".
        clips: names of clips, none for all of them.
        progress: called with a message and the share done.

    Raises:
        InputError: no clip has such a name.
    """
    if unknown := sorted(set(clips) - set(BENCHMARK_CLIPS)):
        raise InputError([Fault("--clips", "", "no such clip", ", ".join(unknown), "", tuple(BENCHMARK_CLIPS))])
    tables: list[Table] = []
    if part in ("all", "accuracy"):
        todo = clips_of(clips)
        render_clips(todo, folder, progress)
        tables.append(accuracy_table(measure_accuracy(todo, folder, progress)))
    if part in ("all", "starts"):
        tables.append(fast_starts_table(STARTS, progress))
    if part in ("all", "damaged"):
        with TemporaryDirectory() as files:
            tables.append(damaged_table(Path(files), DAMAGED, progress))
    if part in ("all", "speed"):
        videos = [Clip(SPEED_CLIP, encoding) for encoding in SPEED_ENCODINGS]
        render_clips(videos, folder, progress)
        progress("timing the tracker at 4K", None)
        tables.append(speed_table([clip.file(folder) for clip in videos]))
    if part in ("all", "fit"):
        tables.append(cost_table(folder, FIT_CRF, ("hybrid", "csrt"), progress))
    command = "python -m benchmarks tracking" + (f" --part {part}" if part != "all" else "")
    return Scores("Tracking", "synthetic: rendered videos with known truth", command, tuple(tables))
