"""A page that shows a data set: counts, plots, objects and failures; one file without anything from elsewhere."""

import base64
import io
from collections import Counter
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from fingersplit.dataset.folder import write_whole
from fingersplit.dataset.reading import Dataset, Shard
from fingersplit.dataset.request import SPLITS
from fingersplit.extras import extra

__all__ = ["write_summary"]

PAGE = "summary.html"
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .8rem .2rem 0;text-align:left;"
    "border-bottom:1px solid #ddd}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}img{max-width:100%}"
)
MAX_OBJECTS = 500
"""Rows of the table of objects."""
COLOR, GOOD = "#4a7dbd", "#3a9a5c"


@dataclass
class _Counts:
    """What is counted over all shards."""

    grasps: Counter[str] = field(default_factory=Counter)
    splits: dict[str, Counter[str]] = field(default_factory=lambda: {split: Counter() for split in SPLITS})
    causes: Counter[str] = field(default_factory=Counter)
    terminations: Counter[str] = field(default_factory=Counter)
    objects: list[tuple[str, str, int, int, int, int]] = field(default_factory=list)
    values: dict[str, list[Any]] = field(default_factory=dict)

    def add(self, shard: Shard) -> dict[str, int]:
        columns = shard.columns
        counts = {
            "kept": len(shard),
            "feasible": int(columns["feasible"].sum()),
            "verified": int((columns["held"] >= 0).sum()),
            "held": int((columns["held"] == 1).sum()),
            "asked for": int(columns["selected"].sum()),
        }
        self.grasps.update(counts)
        self.causes.update(cause.partition(":")[0] for cause in columns["cause"].tolist())
        self.terminations.update(shard.attributes["terminations"])
        chosen = columns["selected"]
        for name, unit in (("slip", 1e3), ("turn", 180 / np.pi)):
            self.values.setdefault(name, []).append(unit * columns[name][chosen])
        if "holding_margin" in shard.metric_names:
            margin = columns["metrics"][chosen, shard.metric_names.index("holding_margin")]
            self.values.setdefault("holding margin", []).append(margin)
        axes = shard.object_from_palm[chosen] @ np.array([0.0, 0.0, 1.0, 0.0])
        self.values.setdefault("palm axis", []).append(axes[:, :3])
        return counts


def write_summary(folder: Path) -> Path:
    """Write ``summary.html`` into a data set's folder; also while it is being filled.

    Raises:
        DatasetError: The folder holds no data set.
        MissingExtraError: matplotlib is not installed.
    """
    dataset, counted = Dataset(folder), _Counts()
    for item in dataset.objects:
        each = Counter[str]()
        for shard in dataset.of(item):
            each.update(counted.add(shard))
        counted.splits[item.split].update(each | Counter(objects=1))
        row = (item.name, item.split, each["asked for"], each["feasible"], each["verified"], each["held"])
        counted.objects.append(row)
    path = folder / PAGE
    write_whole(path, _page(dataset, counted))
    return path


def _page(dataset: Dataset, counted: _Counts) -> str:
    request, failures = dataset.request, dataset.failures()
    wanted = request.per_object * len(dataset.objects)
    what = "grasps that held" if request.verified else "feasible grasps"
    said = {
        "hand": request.hand,
        "asked for": f"{request.per_object} {what} of each of {len(dataset.objects)} objects: {wanted}",
        "there": counted.grasps["asked for"],
        "protocol": f"{request.protocol}, controller {request.controller}" if request.verified else "none",
        "scene": ", ".join(request.constraints) or "none",
        "seed": request.seed,
        "licence": request.licence,
    }
    splits = [
        (name, counts["objects"], counts["asked for"], counts["feasible"], counts["held"])
        for name, counts in counted.splits.items()
    ]
    failed = [(one["file"], one["code"], one["message"]) for one in failures.values()]
    parts = [
        f"<h1>Data set {escape(dataset.path.resolve().name)}</h1>",
        _table((), said.items()),
        f'<img alt="Plots of the data set" src="data:image/png;base64,{_plots(counted)}">',
        "<h2>Splits</h2>",
        _table(("split", "objects", "grasps asked for", "feasible", "held"), splits),
        "<h2>What became of grasps</h2>",
        "<p>Every distinct grasp that a round returned; grasps that do not count are kept with their cause.</p>",
        _table(("cause", "grasps"), counted.causes.most_common()),
        "<h2>How searches ended</h2>",
        _table(("termination", "starts"), counted.terminations.most_common()),
        "<h2>Objects with too few grasps</h2>" + _table(("file", "cause", "message"), failed) if failed else "",
        "<h2>Objects</h2>",
        _table(("object", "split", "asked for", "feasible", "verified", "held"), counted.objects[:MAX_OBJECTS]),
        f"<p>{len(counted.objects) - MAX_OBJECTS} more.</p>" if len(counted.objects) > MAX_OBJECTS else "",
    ]
    head = f"<!doctype html><html lang=en><meta charset=utf-8><title>Data set</title><style>{STYLE}</style>"
    return f"{head}{''.join(parts)}</html>\n"


def _table(headings: tuple[str, ...], rows: Any) -> str:
    def cell(value: Any, kind: str = "td") -> str:
        number = " class=n" if isinstance(value, int) else ""
        return f"<{kind}{number}>{escape(str(value))}</{kind}>"

    body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    return f"<table><tr>{''.join(cell(heading, 'th') for heading in headings)}</tr>{body}</table>"


def _plots(counted: _Counts) -> str:
    """Six plots as PNG, base64."""
    with extra("pictures"):
        from matplotlib.figure import Figure
    figure = Figure(figsize=(11, 6.4), layout="constrained", dpi=110)
    axes = figure.subplots(2, 3).ravel()
    per_object = np.array([row[2] for row in counted.objects])
    _histogram(axes[0], per_object, "grasps asked for", "objects")
    causes = counted.causes.most_common(8)[::-1]
    colors = [GOOD if name == "held" else COLOR for name, _ in causes]
    axes[1].barh([name.replace("_", " ") for name, _ in causes], [count for _, count in causes], color=colors)
    axes[1].set(xlabel="grasps", title="what became of them")
    joined = {name: np.concatenate(parts) if parts else np.empty(0) for name, parts in counted.values.items()}
    for place, name, unit in ((2, "holding margin", "N"), (3, "slip", "mm"), (4, "turn", "degrees")):
        values = joined.get(name, np.empty(0))
        _histogram(axes[place], values[np.isfinite(values)], f"{name} [{unit}]", "grasps")
    directions = joined.get("palm axis", np.empty((0, 3))).reshape(-1, 3)
    longitude = np.degrees(np.arctan2(directions[:, 1], directions[:, 0]))
    axes[5].scatter(longitude, np.degrees(np.arcsin(np.clip(directions[:, 2], -1, 1))), s=4, alpha=0.5, color=COLOR)
    axes[5].set(
        xlabel="longitude [degrees]",
        ylabel="latitude [degrees]",
        xlim=(-180, 180),
        ylim=(-90, 90),
        title="palm z axis, object frame",
    )
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return base64.b64encode(stream.getvalue()).decode()


def _histogram(axes: Any, values: Any, what: str, count: str) -> None:
    if len(values):
        axes.hist(values, bins=min(30, max(5, len(values) // 4)), color=COLOR)
    else:
        axes.text(0.5, 0.5, "none", ha="center", transform=axes.transAxes)
    axes.set(xlabel=what, ylabel=count)
