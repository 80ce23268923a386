"""Small clips whose every frame says its own number in blocks that survive compression."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

WIDTH, HEIGHT, BLOCK = 160, 96, 16
BITS = WIDTH // BLOCK


def picture(number: int, width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    """(h, w) gray: the number's bits in the top row, their opposites in the second, a moving pattern below."""
    bits = (number >> np.arange(BITS)) & 1
    code = np.kron(np.stack([bits, 1 - bits]), np.ones((BLOCK, BLOCK))) * 200 + 28
    y, x = np.mgrid[: HEIGHT - 2 * BLOCK, :WIDTH]
    waves = 128 + 60 * np.sin(0.3 * x + 0.4 * number) * np.cos(0.2 * y - 0.3 * number)
    return np.vstack([code, waves])[:height, :width].astype(np.uint8)


def number_in(luma: np.ndarray) -> int:
    """The number a picture carries; fails on a picture that is turned or spoilt."""
    usable = luma[: 2 * BLOCK, : luma.shape[1] // BLOCK * BLOCK].astype(float)
    means = usable.reshape(2, BLOCK, -1, BLOCK).mean(axis=(1, 3))
    bits, opposites = means > 128
    assert (bits != opposites).all(), "the picture is turned or spoilt"
    return int(np.sum(bits << np.arange(len(bits))))


@dataclass(frozen=True)
class Clip:
    """How to make a clip.

    `stamps_ms` gives the frames times of their own; `turned_deg` stores the pictures turned clockwise and says so.
    """

    suffix: str
    codec: str
    frames: int = 40
    rate: Fraction = Fraction(30)
    pixels: str = "yuv420p"
    options: dict[str, str] = field(default_factory=dict)
    container: dict[str, str] = field(default_factory=dict)
    format: str | None = None
    stamps_ms: Sequence[int] | None = None
    first: int = 0
    turned_deg: int = 0
    size: tuple[int, int] = (WIDTH, HEIGHT)

    def write(self, folder: Path) -> Path:
        """Writes the clip and gives its path."""
        path = folder / f"clip{self.suffix}"
        unit = 1 / self.rate if self.stamps_ms is None else Fraction(1, 1000)
        with av.open(str(path), "w", format=self.format, options=self.container) as container:
            stream = container.add_stream(self.codec, rate=self.rate, options=self.options)
            stream.width, stream.height = self.size if self.turned_deg % 180 == 0 else self.size[::-1]
            stream.pix_fmt = self.pixels
            stream.codec_context.time_base = unit
            if self.turned_deg:
                stream.set_display_rotation(self.turned_deg)
            for number in range(self.frames):
                stored = np.rot90(picture(number, *self.size), -(self.turned_deg // 90))
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(stored), format="gray")
                frame = frame.reformat(format=self.pixels)
                frame.pts = self.first + (number if self.stamps_ms is None else self.stamps_ms[number])
                frame.time_base = unit
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
        return path


GOP = {"g": "12", "bf": "2"}
X265 = {"x265-params": "log-level=none:keyint=12:min-keyint=12:bframes=3"}
CLIPS = {
    "h264-mp4": Clip(".mp4", "libx264", options=GOP),
    "h264-mp4-fragments": Clip(".mp4", "libx264", options=GOP, container={"movflags": "frag_keyframe+empty_moov"}),
    "h264-mkv-open-gop": Clip(".mkv", "libx264", options=GOP | {"x264-params": "open-gop=1"}),
    "h264-ts": Clip(".ts", "libx264", options=GOP),
    "h264-avi-b-frames": Clip(".avi", "libx264", options=GOP),
    "h264-raw": Clip(".264", "libx264", options=GOP, format="h264"),
    "hevc-mov": Clip(".mov", "libx265", options={"x265-params": X265["x265-params"] + ":open-gop=0"}),
    "hevc-mp4-open-gop": Clip(".mp4", "libx265", options={"x265-params": X265["x265-params"] + ":open-gop=1"}),
    "mpeg4-avi": Clip(".avi", "mpeg4", options={"g": "12"}),
    "mpeg4-avi-b-frames": Clip(".avi", "mpeg4", options=GOP),
    "mpeg4-mp4-b-frames": Clip(".mp4", "mpeg4", options=GOP),
    "mpeg2-ts-b-frames": Clip(".ts", "mpeg2video", options=GOP),
    "vp9-webm": Clip(".webm", "libvpx-vp9", options={"g": "12", "deadline": "realtime", "cpu-used": "8"}),
    "ffv1-mkv": Clip(".mkv", "ffv1", options={"g": "12"}),
    "ffv1-mkv-rgb": Clip(".mkv", "ffv1", pixels="bgr0"),
    "mjpeg-avi": Clip(".avi", "mjpeg", pixels="yuvj420p"),
    "mjpeg-mov": Clip(".mov", "mjpeg", pixels="yuvj420p"),
}
