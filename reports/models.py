"""The labels of models as the reader meets them."""

_LABELS = {
    "twin": "twin",
    "published": "EBT, published",
    "smoothed": "EBT, smoothed",
    "large": "EBT, large amplitude",
}


def model_label(name: str) -> str:
    """Return the label of a key of `CalibratedTrial.speeds`: `EBT, large amplitude (twin's tail)`."""
    form, _, tail = name.partition(", ")
    label = _LABELS.get(form, form.replace("_", " "))
    return f"{label} ({tail.replace(chr(39), '’')})" if tail else label
