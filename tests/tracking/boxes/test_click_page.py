"""The click page: one file that asks for nothing; clicking all markers gives boxes that load, a pixel off at most."""

import json
import re
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest

from tests.cases import later
from tests.reports.page import Page
from tests.reports.test_browser import CHROMIUM, opened, requested
from tests.tracking.boxes.drawn import NINE, Scene, draw, layout
from tracking.body_chain import find_blobs
from tracking.boxes import Box, StartBoxes, load_boxes
from tracking.find_boxes import click_page

in_a_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here (chromium, chromium-browser, or set SWIMCAL_CHROMIUM)"
)
SCENE = Scene(size=(640, 360), centre=(320.0, 180.0), px_per_m=700, diameter=11, bend_deg=(10, 12, 8, -6, -10))
DRAWN = draw(SCENE)
RGB = np.repeat(DRAWN.luma[:, :, None], 3, axis=2)
BLOBS = find_blobs(DRAWN.luma, "bright")


def click(**more: object) -> str:
    return click_page(RGB, NINE, **{"trial": "f1_00", "layout_m": layout(), **more})  # type: ignore[arg-type]


def test_names_cannot_break_the_page() -> None:
    page = Page(click(trial="</script><b>"))

    assert "b" not in page.tags[page.tags.index("script") :]


def driven(folder: Path, page: str, script: str) -> str:
    """What is saved when a script plays the hand: `press(x, y)`, `drag(from, to)` in px of the picture, `key(name)`."""
    (folder / "click.html").write_text(page)
    (folder / "hand.html").write_text(
        """<iframe src="click.html" style="width:1100px;height:640px;border:0"></iframe><script>
        onload = () => {
          const page = document.querySelector("iframe").contentWindow, doc = page.document;
          const all = (id) => doc.getElementById(id);
          page.HTMLAnchorElement.prototype.click = function () { document.title = `${this.download} ${this.href}` };
          const go = () => {
            if (!page.startBoxes) return setTimeout(go, 20);
            const send = (type, at) => {
              const [clientX, clientY] = page.startBoxes.toCanvas(at), where = { clientX, clientY, pointerId: 1 };
              all("picture").dispatchEvent(new page.PointerEvent(type, { ...where, bubbles: true }));
            };
            const press = (...at) => { send("pointermove", at); send("pointerdown", at); send("pointerup", at) };
            const drag = (from, to) => { send("pointerdown", from); send("pointermove", to); send("pointerup", to) };
            const key = (key, more) =>
              doc.body.dispatchEvent(new page.KeyboardEvent("keydown", { key, bubbles: true, ...more }));
            SCRIPT
          };
          go();
        };</script>""".replace("SCRIPT", script)
    )
    shown = opened(folder / "hand.html", "--allow-file-access-from-files", "--virtual-time-budget=9000", "--dump-dom")
    assert "CONSOLE" not in shown.stderr, shown.stderr
    match = re.search("<title>(.*?)</title>", shown.stdout, re.DOTALL)
    assert match, "nothing was saved"
    return match[1]


def saved(folder: Path, title: str) -> StartBoxes:
    name, _, content = title.partition(" data:application/json;charset=utf-8,")
    (folder / name).write_text(unquote(content))
    return load_boxes(folder / name, NINE)


@pytest.mark.long
@in_a_browser
@pytest.mark.parametrize("blobs", [BLOBS, *later(((),))], ids=["blobs", "without"])
def test_clicking_every_marker_a_little_off_gives_its_centre(tmp_path: Path, blobs: tuple) -> None:
    places = json.dumps(np.add(DRAWN.centre_px, [2.0, -2.0]).tolist())
    title = driven(tmp_path, click(blobs=blobs), f"for (const at of {places}) press(...at); all('save').click()")

    boxes = saved(tmp_path, title)

    assert title.startswith("f1_00.boxes.json ")
    assert np.abs(boxes.centres_px(NINE) - DRAWN.centre_px).max() < 1.0
    assert boxes.frame == 0
    assert all(1.2 * SCENE.diameter < box.width < 1.6 * SCENE.diameter for box in boxes.boxes.values())


@in_a_browser
def test_drag_keys_undo_and_size_do_what_they_say(tmp_path: Path) -> None:
    start = StartBoxes(12, {name: Box.around(at, 15) for name, at in zip(NINE, DRAWN.centre_px, strict=True)})
    x, y = DRAWN.centre_px[0]
    title = driven(
        tmp_path,
        click(suggested=start, frame=12),
        f"drag([{x}, {y}], [{x + 9}, {y - 4}]); key('ArrowLeft'); key('ArrowDown', {{ shiftKey: true }});"
        "key(']'); key(']'); key('Backspace'); key('s')",
    )

    boxes = saved(tmp_path, title)

    assert boxes.frame == 12
    assert boxes.boxes["nose"].centre_px == pytest.approx((x + 8, y - 3.9), abs=0.02)
    assert boxes.boxes["neck"].width == 17
    assert boxes.centres_px(NINE[1:]) == pytest.approx(DRAWN.centre_px[1:], abs=0.02)


@in_a_browser
def test_nothing_can_be_saved_before_every_marker_has_a_box(tmp_path: Path) -> None:
    title = driven(tmp_path, click(), "press(100, 100); all('save').click(); key('s'); document.title ||= 'nothing'")

    assert title == "nothing"


@in_a_browser
def test_the_page_asks_for_nothing(tmp_path: Path) -> None:
    (tmp_path / "click.html").write_text(click())
    shown = opened(tmp_path / "click.html", f"--log-net-log={tmp_path / 'net.json'}", "--dump-dom")

    assert "CONSOLE" not in shown.stderr, shown.stderr
    assert requested(tmp_path / "net.json") == []
