"""Start boxes: read from a file, found in the picture, or clicked by a person."""

from tracking.boxes.blobs import find_blobs
from tracking.boxes.click_page import ClickBoxes
from tracking.boxes.find_boxes import find_boxes
from tracking.boxes.preview import write_preview
from tracking.boxes.start_boxes import Box, StartBoxes, load_boxes, save_boxes

__all__ = [
    "Box",
    "ClickBoxes",
    "StartBoxes",
    "find_blobs",
    "find_boxes",
    "load_boxes",
    "save_boxes",
    "write_preview",
]
