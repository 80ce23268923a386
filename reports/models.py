"""Models as the reader meets them: a label each, and a colour for models whose speeds are compared."""

from reports.colours import EBT, EBT_LARGE, EBT_SMOOTHED, MUTED, TWIN

_LABELS = {
    "twin": "twin",
    "published": "EBT, published",
    "smoothed": "EBT, smoothed",
    "large": "EBT, large amplitude",
}
_COLOURS = {"twin": TWIN, "published": EBT, "smoothed": EBT_SMOOTHED, "large": EBT_LARGE}


def model_label(name: str) -> str:
    """What a key of `CalibratedTrial.speeds` is called: `EBT, large amplitude (twin's tail)`."""
    form, _, tail = name.partition(", ")
    label = _LABELS.get(form, form.replace("_", " "))
    return f"{label} ({tail.replace(chr(39), '’')})" if tail else label


def model_colour(name: str) -> str:
    """Its colour in every figure; those that only tables compare are grey."""
    return _COLOURS.get(name.partition(", ")[0], MUTED)
