"""Figures in a page: small, in the page's colours, with ids of their own."""

import re

from matplotlib.figure import Figure

from reports.forecasts import speed_sweep_figure
from reports.page import inline_svg
from reports.style import INKS, TWIN, styled
from tests.reports.sample import made_calibration


@styled
def labelled() -> Figure:
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=TWIN)
    axes.text(0.5, 0.5, "12.375 <b> & $x_1$ #0a6ebd")
    return figure


def test_every_colour_is_left_to_the_page_and_stands_without_it() -> None:
    svg = inline_svg(speed_sweep_figure(made_calibration()), "sweep", "Speed")
    bare = re.sub(r"var\(--([\w-]+), (#[0-9a-f]{6})\)", "", svg)

    assert re.findall(r"#[0-9a-f]{6}\b(?!\w)", re.sub(r'(id|href)="[^"]*"|url\([^)]*\)', "", bare)) == []
    assert (
        dict(re.findall(r"var\(--([\w-]+), (#[0-9a-f]{6})\)", svg)).items()
        <= {name: ink.light for name, ink in INKS.items()}.items()
    )


def test_ids_belong_to_the_figure() -> None:
    svg = inline_svg(labelled(), "first", "A line")

    assert set(re.findall(r'\bid="(\w+)-', svg)) == {"first"}
    assert set(re.findall(r'url\(#(\w+)-|href="#(\w+)-', svg)) <= {("first", ""), ("", "first")}


def test_text_keeps_its_digits_and_is_escaped() -> None:
    svg = inline_svg(labelled(), "first", 'a "quoted" <name>')

    assert "12.375 &lt;b&gt; &amp; $x_1$ #0a6ebd</text>" in svg
    assert 'aria-label="a &#34;quoted&#34; &lt;name&gt;"' in svg


def test_inks_are_reported_apart_by_their_light_colour() -> None:
    lights = [ink.light for ink in INKS.values()]

    assert len(set(lights)) == len(lights)


def test_text_colours_can_be_read_on_their_ground() -> None:
    for name in ("ink", "muted", "twin", "ebt", "ebt-large", "warn"):
        for ink, ground in zip(INKS[name], INKS["surface"], strict=True):
            assert contrast(ink, ground) > 4.5, (name, ink, ground)
    for ink, ground in zip(INKS["warn"], INKS["warn-ground"], strict=True):
        assert contrast(ink, ground) > 4.5


def contrast(one: str, other: str) -> float:
    """The contrast ratio of two colours (WCAG 2.1)."""
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
