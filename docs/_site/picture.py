"""The README's picture, from a finished session: how far off, how sure, what is missing.

python docs/_site/picture.py SESSION docs/real_robot/summary.png        # needs a Chromium
"""

import base64
import io
import subprocess
import sys
import tempfile
from pathlib import Path

import calib
from reports.blocks import Plot
from reports.forecast_words import MODELS
from reports.numbers import in_mm, in_words, listed, spanned, whole_percent

PAGE = """<!doctype html><meta charset="utf-8"><style>
body {{ font: 19px "DejaVu Sans", sans-serif; color: #1b1f24; margin: 34px 40px; width: 1520px }}
h1 {{ font-size: 32px; margin: 0 0 4px }} p {{ margin: 0; color: #59636e; line-height: 1.4 }}
.three {{ display: grid; grid-template-columns: 1fr 1fr 1fr; gap: 36px; margin: 26px 0 30px }}
h2 {{ font-size: 19px; margin: 0; color: #59636e; border-top: 3px solid #1b1f24; padding-top: 10px }}
b {{ display: block; font-size: 46px; line-height: 1.25 }} .three p {{ min-height: 112px }}
img {{ width: 100%; margin-top: 14px }} .fish {{ display: block; width: 1180px; margin: 8px auto 0 }}
</style><h1>{title}</h1><p>{about}</p><div class="three">{columns}</div>
<h2>Where the gap comes from (red) and where it shows (blue)</h2><img class="fish" src="{fish}">"""


def page(session: str) -> str:
    """The picture as HTML."""
    fit, posterior, gap = (step(session, progress=False) for step in (calib.fit, calib.posterior, calib.diagnose))
    errors = {name: in_mm(fit.forecasts.mean(name, "speed_error")) for name in MODELS}
    inside, count, _ = posterior.data.inside("holdout")
    determined = sum(one.determined for one in posterior.coefficients.values())
    best, size = fit.forecasts.best_baseline, gap.size
    groups = [" or ".join(map(in_words, group)) for group in gap.groups]
    columns = [
        _column(
            "How far off",
            f"{errors['given_frequency']} mm/s",
            f"mean speed error on {count} held-out trials, given the frequency (best baseline, {MODELS[best]}: "
            f"{errors[best]}); {errors['after_two_beats']} after two beats",
            fit.plot.forecasts(),
        ),
        _column(
            "How sure",
            f"{determined} of {len(posterior.coefficients)}",
            "coefficients determined, if the form of the twin is right (90 % intervals below); "
            f"{inside} of {count} held-out speeds within their 90 % bands",
            posterior.plot.intervals(),
        ),
        _column(
            "What is missing",
            f"−{whole_percent(size.shrinkage)}",
            f"of the held-out gap ({spanned(*size.shrinkage_ci95, whole_percent)}) with {listed(groups, len(groups))}",
            gap.plot.effects(),
        ),
    ]
    trials = {role: [name for name, each in fit.trials.items() if each.role == role] for role in ("fit", "holdout")}
    about = f"fitted to {listed(trials['fit'])}, scored on {listed(trials['holdout'])}; {fit.name.split(' to ')[0]}"
    title = f"A robot fish and its MuJoCo twin: {len(fit.trials)} public trials"
    return PAGE.format(title=title, about=about, columns="".join(columns), fish=_image(gap.plot.fish()))


def _column(question: str, number: str, meaning: str, plot: Plot) -> str:
    return f'<div><h2>{question}</h2><b>{number}</b><p>{meaning}</p><img src="{_image(plot)}"></div>'


def _image(plot: Plot) -> str:
    content = io.BytesIO()
    plot.figure.savefig(content, format="svg")
    return f"data:image/svg+xml;base64,{base64.b64encode(content.getvalue()).decode()}"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        html = Path(folder, "picture.html")
        html.write_text(page(sys.argv[1]), encoding="utf-8")
        options = ("--headless=new", "--no-sandbox", "--hide-scrollbars", "--window-size=1600,1385")
        subprocess.run(["chromium", *options, f"--screenshot={sys.argv[2]}", html.as_uri()], check=True)
