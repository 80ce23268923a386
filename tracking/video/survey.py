"""What opening a video finds out: its frames, and from the first readable one its size and which way is up."""

from pathlib import Path
from typing import NamedTuple

from tracking.video.damage import missing_at_the_end
from tracking.video.decoding import Decoder
from tracking.video.index import FrameIndex, index_frames, read_packets
from tracking.video.info import VideoInfo
from tracking.video.opening import fault


class Survey(NamedTuple):
    """A video before its frames are read.

    Attributes:
        info: what its users are told.
        frames: which packet stamp is which frame.
        stored_size_px: width and height of a picture as it is stored.
    """

    info: VideoInfo
    frames: FrameIndex
    stored_size_px: tuple[int, int]


def survey(file: Path) -> Survey:
    """Opens a video, goes through its packets and decodes one frame.

    Raises:
        InputError: if the file is missing, is no video or has no frame that can be decoded.
    """
    with Decoder(file, threads=1) as decoder:  # one thread: nothing beyond the first picture is decoded
        container, stream = decoder.container, decoder.stream
        read = read_packets(container, stream)
        picture = read.picture
        if picture is None:
            found = f"{len(read.packets)} packets of {stream.codec_context.name}, none of them readable"
            raise fault(file, "no frame of this video can be decoded", found, "at least one", "Copy the file again.")
        index = index_frames(read, container, stream)
        stored = picture.width, picture.height
        turns = round(picture.rotation / 90) % 4
        info = VideoInfo(
            file,
            *(stored if turns % 2 == 0 else stored[::-1]),
            codec=stream.codec_context.codec.canonical_name,
            time_s=index.time_s,
            time_source=index.source,
            rotation_deg=90 * turns,
            pixel_aspect=float(stream.sample_aspect_ratio or 1),
            damage=missing_at_the_end(index, container, stream),
        )
    return Survey(info, index, stored)
