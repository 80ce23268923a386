"""Opening a video file, with one clear error for whatever is not a video."""

from pathlib import Path

import av

from session.errors import Fault, InputError

EXPECTED = "a video file (MP4, MOV, MKV, AVI, WebM, ...)"
MP4_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
"""Names of boxes an MP4 or MOV file begins with (ISO/IEC 14496-12, table 1)."""
REPAIR = (
    "If the recording was cut short, put the card back into the camera, which may repair it (GoPro: SOS), or copy the "
    "file again; a repair tool with an intact video of the same camera can rebuild the index."
)


def open_video(file: Path) -> tuple[av.container.InputContainer, av.VideoStream]:
    """Opens a file and picks its main picture stream.

    Raises:
        InputError: if there is no such file, it is no video, has no pictures, or none this FFmpeg can decode.
    """
    _check_file(file)
    try:
        container = av.open(str(file))
    except (av.FFmpegError, OSError) as error:
        raise _unreadable(file, error) from error
    try:
        return container, _picture_stream(file, container)
    except BaseException:
        container.close()
        raise


def _check_file(file: Path) -> None:
    """Refuses what is no file, or an empty one."""
    if not file.exists():
        raise fault(file, "no such file", "", EXPECTED)
    if file.is_dir():
        raise fault(file, "not a file", "a folder", EXPECTED)
    if file.stat().st_size == 0:
        raise fault(file, "empty file", "0 bytes", EXPECTED, "Copy it again from the camera's card.")


def _unreadable(file: Path, error: Exception) -> InputError:
    """The error of a file that FFmpeg does not open."""
    try:
        with file.open("rb") as stream:
            head = stream.read(8)
    except OSError as denied:
        return fault(file, "cannot be read", denied.strerror or str(denied), EXPECTED, "Check the file's permissions.")
    size_mb = f"{file.stat().st_size / 1e6:.1f} MB"
    if head[4:8] in MP4_BOXES:
        what = "the index of this MP4 or MOV file (its moov atom) is missing or damaged"
        return fault(file, what, f"{size_mb} without a readable index", "a file the camera has closed", REPAIR)
    reason = getattr(error, "strerror", None) or str(error)
    return fault(file, "not a readable video", f"{size_mb} of something else ({reason})", EXPECTED)


def _picture_stream(file: Path, container: av.container.InputContainer) -> av.VideoStream:
    """The main picture stream of a container."""
    stream = container.streams.best("video")
    if stream is None:
        kinds = ", ".join(stream.type for stream in container.streams) or "no stream at all"
        raise fault(file, "no pictures in this file", kinds, "a video stream")
    if stream.codec_context is None:
        next_step = "Convert it to H.264 with a full FFmpeg."
        raise fault(file, "no decoder for this video", "an unknown codec", "H.264, HEVC, VP9, FFV1, ...", next_step)
    assert isinstance(stream, av.VideoStream)
    return stream


def fault(file: Path, what: str, found: str, expected: str, next_step: str = "") -> InputError:
    """An `InputError` with one fault of the whole file."""
    return InputError([Fault(str(file), "", what, found, expected, next_step=next_step)])
