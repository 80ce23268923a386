"""Models as the reader meets them: a label each."""

_LABELS = {
    "twin": "twin",
    "published": "EBT, published",
    "smoothed": "EBT, smoothed",
    "large": "EBT, large amplitude",
}


def model_label(name: str) -> str:
    """What a key of `CalibratedTrial.speeds` is called: `EBT, large amplitude (twin's tail)`."""
    form, _, tail = name.partition(", ")
    label = _LABELS.get(form, form.replace("_", " "))
    return f"{label} ({tail.replace(chr(39), '’')})" if tail else label
