"""A page on which a person clicks the markers: one file that asks for nothing from the network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import cv2
import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from tracking.boxes.blobs import Blob
from tracking.boxes.find_boxes import BOX_DIAMETERS
from tracking.boxes.start_boxes import StartBoxes

JPEG_QUALITY = 92
USUAL_SIDE_PX = 25.0


@dataclass(frozen=True, eq=False)
class ClickBoxes:
    """A frame with its markers to be clicked; `load_boxes` reads what the page saves.

    Attributes:
        rgb: (h, w, 3) the frame, bytes; `frame` is its number in the video.
        markers: the markers to click, in the order in which they are asked for.
        suggested: boxes to begin with; the person only has to check and save them.
        blobs: places that a click snaps to (`find_blobs`); elsewhere it snaps to what stands out under it.
        layout_m: (m, 2) places on the straight robot, m, for the little map of the markers.
        place: where the saved file belongs in the session folder; None: ``trials/<trial>.boxes.json``.
    """

    rgb: np.ndarray
    markers: Sequence[str]
    trial: str = "trial"
    frame: int = 0
    suggested: StartBoxes | None = None
    blobs: Sequence[Blob] = ()
    layout_m: np.ndarray | None = None
    place: str | None = None

    def html(self) -> str:
        """Render the whole page."""
        folder = files("tracking.boxes") / "templates"
        style, script, page = (
            (folder / name).read_text("utf-8") for name in ("click.css", "click.js", "click.html.j2")
        )
        environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
        return environment.from_string(page).render(
            trial=self.trial,
            frame=self.frame,
            place=self.place or f"trials/{self.trial}.boxes.json",
            style=Markup(style),  # our own file
            script=Markup(script),
            data=self._data(),
        )

    def _data(self) -> dict[str, Any]:
        height, width = self.rgb.shape[:2]
        suggested = self.suggested.to_json()["boxes"] if self.suggested else {}
        return {
            "image": _as_jpeg(self.rgb),
            "width": width,
            "height": height,
            "markers": list(self.markers),
            "trial": self.trial,
            "frame": self.frame,
            "suggested": {name: suggested[name] for name in self.markers if name in suggested},
            "blobs": [[round(value, 2) for value in blob[:3]] for blob in self.blobs],
            "side_px": self._side_px(),
            "layout": None if self.layout_m is None else np.asarray(self.layout_m, dtype=float).tolist(),
        }

    def _side_px(self) -> int:
        """Return the side of new boxes: that of the suggested ones, or one that fits the diameter of the blobs."""
        if self.suggested:
            return round(float(np.median([box.width for box in self.suggested.boxes.values()])))
        if self.blobs:
            diameters = [blob.diameter_px for blob in self.blobs[: len(self.markers)]]
            return round(BOX_DIAMETERS * float(np.median(diameters)))
        return round(USUAL_SIDE_PX)


def _as_jpeg(rgb: np.ndarray) -> str:
    """Encode the picture (h, w, 3) as a data URL."""
    ok, data = cv2.imencode(".jpg", np.ascontiguousarray(rgb[:, :, ::-1]), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not ok:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be stored as JPEG")
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
