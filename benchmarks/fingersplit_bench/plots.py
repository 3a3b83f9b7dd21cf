"""The paper's figures as PNG files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fingersplit.recording.pictures import shade_phases
from fingersplit.splitting.trace import PHASE_NAMES, Trace
from fingersplit_bench.profiles import METRICS, mean_and_deviation

__all__ = ["draw_metrics", "draw_quality_profile", "draw_reliability"]

RED, BLUE = "#c1121f", "#1d4ed8"
LABELS = {"Q": "$Q$", "Q_iso": "$Q_{iso}$", "Q_vol": "$Q_{vol}$", "Ferrari-Canny": "Ferrari-Canny"}


def draw_quality_profile(path: Path, traces: Mapping[str, Trace]) -> None:
    """Q against iteration with CPO shaded yellow and PPO blue, a panel for every trace, titled by its name."""
    figure = _figure(width=4.6 * len(traces), height=3.4)
    panels = figure.subplots(1, len(traces), squeeze=False)[0]
    for axes, (title, trace) in zip(panels, traces.items(), strict=True):
        patches = shade_phases(axes, [PHASE_NAMES[phase] for phase in trace.phases])
        (curve,) = axes.plot(trace.scores[:, 0], color=RED, lw=2, label="Q")
        axes.set(xlabel="iteration", title=title, xlim=(-0.5, max(len(trace) - 0.5, 0.5)))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3))
        axes.set_ylim(_common_range([trace.scores[:, 0] for trace in traces.values()]))
    panels[0].set_ylabel("quality Q")
    figure.legend(handles=[curve, *patches], loc="outside lower center", ncols=3)
    figure.savefig(path, format="png", facecolor="white")


def draw_metrics(path: Path, profiles: Sequence[Mapping[str, NDArray[np.float64]]]) -> None:
    """Mean (red) and standard deviation (blue bars) of every metric over grasps, normalised and of equal length."""
    figure = _figure(width=9.2, height=6.2)
    for panel, axes, metric in zip("abcd", figure.subplots(2, 2, sharex=True).flat, METRICS, strict=True):
        mean, deviation, count = mean_and_deviation([profile[metric] for profile in profiles])
        _draw_mean(axes, mean, deviation)
        axes.set_title(f"({panel}) {LABELS[metric]}, {count} of {len(profiles)} grasps", fontsize=11)
        axes.set(ylim=(-0.25, 1.25))
    figure.supxlabel("progress of the finger splitting [% of its iterations]", fontsize=10)
    figure.supylabel("normalised measurement", fontsize=10)
    figure.savefig(path, format="png", facecolor="white")


def draw_reliability(
    path: Path, curves: Mapping[str, Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]]]
) -> None:
    """Share that happened against predicted probability in ten bins, a panel for each condition, a line a predictor.

    The size of a mark goes with the number of grasps in its bin.
    """
    figure = _figure(width=4.6 * len(curves), height=4.4)
    panels = figure.subplots(1, len(curves), squeeze=False, sharey=True)[0]
    for axes, (title, predictors) in zip(panels, curves.items(), strict=True):
        axes.plot([0, 1], [0, 1], color="0.6", lw=1, ls="--")
        for color, (name, (predicted, happened)) in zip(
            ("#1d4ed8", "#9ca3af", "#c1121f"), predictors.items(), strict=False
        ):
            bins = np.minimum((10 * predicted).astype(int), 9)
            filled = np.unique(bins)
            x, y = ([values[bins == k].mean() for k in filled] for values in (predicted, happened))
            axes.plot(x, y, color=color, lw=1.5, label=name)
            axes.scatter(x, y, s=[12 + 300 * float(np.mean(bins == k)) for k in filled], color=color, alpha=0.6)
        axes.set(title=title, xlabel="predicted probability of holding", xlim=(0, 1), ylim=(0, 1))
        axes.grid(alpha=0.25)
        axes.legend(loc="upper left", fontsize=9)
    panels[0].set_ylabel("share of executions that held")
    figure.savefig(path, format="png", facecolor="white")


def _draw_mean(axes: Axes, mean: NDArray[np.float64], deviation: NDArray[np.float64]) -> None:
    progress = np.linspace(0, 100, len(mean))
    bars = slice(0, None, 2)
    axes.errorbar(
        progress[bars], mean[bars], yerr=deviation[bars], fmt="none", ecolor=BLUE, elinewidth=1, capsize=2, label="SD"
    )
    axes.plot(progress, mean, color=RED, lw=2, label="mean")
    axes.grid(alpha=0.25)
    axes.legend(loc="lower right", fontsize=9)


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _common_range(curves: Sequence[NDArray[np.float64]]) -> tuple[float, float]:
    low, high = float(min(curve.min() for curve in curves)), float(max(curve.max() for curve in curves))
    margin = 0.06 * (high - low) or 1e-3
    return low - margin, high + margin
