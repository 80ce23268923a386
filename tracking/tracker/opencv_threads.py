"""OpenCV's own threads, which would double those on which several trackers run side by side."""

from collections.abc import Iterator
from contextlib import contextmanager

import cv2


@contextmanager
def opencv_on_one_thread() -> Iterator[None]:
    """OpenCV uses no threads of its own within; the setting, which is the whole process's, is put back afterwards."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
