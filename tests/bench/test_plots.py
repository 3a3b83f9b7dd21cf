"""The pictures, read back from their files."""

import numpy as np
from matplotlib.image import imread

from fingersplit.splitting.trace import Trace
from fingersplit.splitting.trace_kernel import CPO, MAP, PPO
from fingersplit_bench.plots import draw_metrics, draw_quality_profile
from fingersplit_bench.profiles import METRICS


def made_up_trace(phases: list[int]) -> Trace:
    count = len(phases)
    scores = np.zeros((count, 4))
    scores[:, 0] = np.linspace(-1e-3, 5e-3, count)
    rest = {name: np.zeros((count, 3)) for name in Trace.__dataclass_fields__ if name not in ("phases", "scores")}
    return Trace(phases=np.array(phases), scores=scores, **rest)


def share_of(picture: np.ndarray, looks_like) -> float:
    """Share of the pixels whose red, green and blue fulfil a condition."""
    return float(np.mean(looks_like(*np.moveaxis(picture[..., :3], -1, 0))))


def yellow(red, green, blue):
    return (red > 0.9) & (green > 0.85) & (blue < 0.8)


def light_blue(red, green, blue):
    return (blue > 0.9) & (red < 0.85)


def curve_red(red, green, blue):
    return (red > 0.6) & (green < 0.3) & (blue < 0.3)


def test_quality_profile_is_shaded_by_phase(tmp_path):
    traces = {"long CPO": made_up_trace([MAP, *[CPO] * 30, *[PPO] * 5]), "PPO only": made_up_trace([MAP, *[PPO] * 9])}
    pictures = []
    for name, trace in traces.items():
        draw_quality_profile(tmp_path / f"{name}.png", {name: trace})
        pictures.append(imread(tmp_path / f"{name}.png"))
    assert share_of(pictures[0], yellow) > 3 * share_of(pictures[0], light_blue) > 0
    assert share_of(pictures[1], light_blue) > 0.4
    assert share_of(pictures[1], yellow) < 0.02  # the legend
    assert all(share_of(picture, curve_red) > 0.002 for picture in pictures)


def test_panels_stand_side_by_side(tmp_path):
    trace = made_up_trace([MAP, CPO, PPO])
    draw_quality_profile(tmp_path / "one.png", {"one": trace})
    draw_quality_profile(tmp_path / "two.png", {"one": trace, "two": trace})
    assert imread(tmp_path / "two.png").shape[1] == 2 * imread(tmp_path / "one.png").shape[1]


def test_metrics_show_a_red_mean_and_blue_bars(tmp_path):
    rng = np.random.default_rng(0)
    profiles = [{metric: rng.normal(size=20 + k).cumsum() for metric in METRICS} for k in range(4)]
    draw_metrics(tmp_path / "metrics.png", profiles)
    picture = imread(tmp_path / "metrics.png")
    assert share_of(picture, curve_red) > 0.004
    assert share_of(picture, lambda r, g, b: (b > 0.6) & (r < 0.3)) > 0.004
