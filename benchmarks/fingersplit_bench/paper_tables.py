"""Tables I and II of [Fan2018] in Markdown, and what the splitting gains in each metric."""

from collections.abc import Mapping, Sequence
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit_bench.calls import FIDELITIES
from fingersplit_bench.profiles import METRICS
from fingersplit_bench.suite import table

__all__ = ["PUBLISHED_STAGES", "STAGES", "gain_table", "table_one", "table_two"]

STAGES = ("tangent search", "projection and test", "collision")
PUBLISHED_STAGES = {"CPO": (37.0, 326.9, 29.0), "PPO": (102.9, 76.3, 10.0)}
"""Table II of [Fan2018], [ms]."""


def table_one(rows: list[dict[str, Any]]) -> str:
    """Markdown of Table I at paper fidelity, published figures in brackets; the last row is the mean of the rows."""
    lines = [
        _row(row["case"], f"{row['object']}, {row['side']}", row["paper"], row["vertices"], row["published"])
        for row in rows
    ]
    means = {key: mean(row["paper"][key] for row in rows) for key in ("rounds", "cpo", "ppo", "run_ms")}
    totals = {key: sum(row["paper"][key] for row in rows) for key in ("feasible", "runs")}
    published = [row["published"] for row in rows if row["published"]]
    published_means = {key: mean(each[key] for each in published) for key in published[0]} if published else None
    vertices = round(mean(row["vertices"] for row in rows))
    return table(
        ["paper's object", "stand-in, side", "#iters", "#CPO/PPO", "run [ms]", "feasible", "#vertices"],
        [*lines, _row("**mean**", "", means | totals, vertices, published_means)],
        left=2,
    )


def _row(name: str, stand_in: str, run: dict[str, Any], vertices: int, published: dict[str, Any] | None) -> list[str]:
    cells = [
        f"{run['rounds']:.1f}",
        f"{run['cpo']:.0f}/{run['ppo']:.0f}",
        f"{run['run_ms']:.2f}",
        f"{run['feasible']}/{run['runs']}",
        f"{vertices:,}",
    ]
    if published:
        cells[0] += f" ({published['rounds']:.1f})"
        cells[1] += f" ({published['cpo']:.0f}/{published['ppo']:.0f})"
        cells[2] += f" ({published['run_ms']:.0f})"
        cells[4] += f" ({published['vertices']:,.0f})"
    return [name, stand_in, *cells]


def gain_table(profiles: Sequence[Mapping[str, NDArray[np.float64]]]) -> str:
    """Markdown of every metric at the start and at the end: medians over the grasps, and how many rose."""
    rows = []
    for metric in METRICS:
        ends = [(float(profile[metric][0]), float(profile[metric][-1])) for profile in profiles]
        first, last = (median(values) for values in zip(*ends, strict=True))
        rose = sum(end > start for start, end in ends)
        rows.append([metric, f"{first:.4g}", f"{last:.4g}", f"{rose} of {len(ends)}"])
    return table(["metric", "at the start", "at the end", "rose"], rows)


def table_two(rows: list[dict[str, Any]]) -> str:
    """Markdown of Table II: time of a run by stage, mean over the cases, at both fidelities and as published."""
    lines = []
    for fidelity in FIDELITIES:
        stages = {
            phase: [mean(row[fidelity]["stage_ms"][phase][stage] for row in rows) for stage in range(len(STAGES))]
            for phase in PUBLISHED_STAGES
        }
        lines += _stage_rows(fidelity, stages, digits=3)
    lines += _stage_rows("published", PUBLISHED_STAGES, digits=1)
    return table(["time [ms]", *STAGES, "total"], lines)


def _stage_rows(name: str, stages: Mapping[str, Sequence[float]], digits: int) -> list[list[str]]:
    """A row for CPO, for PPO and for both."""
    both = {**stages, "both": [sum(times) for times in zip(*stages.values(), strict=True)]}
    return [
        [f"{name}, {phase}", *(f"{time:.{digits}f}" for time in (*times, sum(times)))] for phase, times in both.items()
    ]
