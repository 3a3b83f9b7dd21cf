"""Section `holding`: how well the probability of holding is known, and how often the first grasp holds under noise."""

from dataclasses import replace
from statistics import mean
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.robustness.executions import Executor
from fingersplit.robustness.features import CLOSING_FEATURES, ESTIMATE_FEATURES
from fingersplit.robustness.judging import estimate_holding, simulate_closings
from fingersplit.robustness.noise import NoiseModel
from fingersplit.robustness.probability_model import COEFFICIENTS, HoldModels, LogisticModel
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit_bench.holding_labels import LEVELS, SEED, Labels, collect_labels, executed, judged
from fingersplit_bench.objects import measured_masses
from fingersplit_bench.plots import draw_reliability
from fingersplit_bench.suite import Bench, Chapter, Figure, table

__all__ = ["area_under_curve", "calibration_error", "holding_chapter", "left_out_predictions"]

EXECUTIONS, LOOKED_AT = 16, 6
"""Executions of a grasp at a level; those that the simulated tier may look at, the others judge it."""
PRIOR_STRENGTH = 6.0
BUDGET, THREADS, DRAWS = 0.5, 2, 20
BINS = 10
_JUDGED = ("auc", "calibration", "brier", "ceiling")


def holding_chapter(bench: Bench) -> Chapter:
    """Execute grasps under noise and compare with what was predicted; fit the coefficients anew if asked."""
    labels = collect_labels(bench, EXECUTIONS)
    predicted = left_out_predictions(labels)
    rows = _judged(labels, predicted)
    draw_reliability(bench.folder / "p_hold.png", _curves(labels, predicted))
    if bench.refit:
        _fit(labels, np.ones(len(labels.names), np.bool_), _provenance(labels, rows)).write(
            COEFFICIENTS / f"{bench.hand.name}.json"
        )
    tops = [row for name in bench.objects for row in _first_grasps(bench, name)]
    times = _times(bench)
    figures = _figures(rows, tops, times, len(labels.names))
    parts = [
        f"{len(labels.names)} ranked grasps of {len(set(labels.names.tolist()))} objects, each executed {EXECUTIONS} "
        "times a level; every prediction is by coefficients fitted without the object. AUC: whether the grasp holds at "
        "least every other time.",
        table(
            ["noise", "tier", "AUC", "calibration error", "Brier score", "ceiling AUC"],
            [
                [r["level"], r["tier"], *(f"{r[k]:.3f}" for k in ("auc", "calibration", "brier", "ceiling"))]
                for r in rows
            ],
            left=2,
        ),
        "The ceiling is the AUC of the share in half of a grasp's executions for that in the other half: what sampling "
        "alone leaves.",
        "![Reliability](p_hold.png)",
        "### First grasps under noise",
        _tops_table(tops),
    ]
    return Chapter("Holding under noise", "\n\n".join(parts), figures, {"tiers": rows, "first": tops, "times": times})


def left_out_predictions(labels: Labels) -> dict[str, NDArray[np.float64]]:
    """Probabilities (n, L) by tier, of models fitted on the other objects.

    ``simulated`` has seen ``LOOKED_AT`` executions beside the closings, as the tier does in its time.
    """
    shape = labels.held.shape[:2]
    estimated, closed = np.zeros(shape), np.zeros(shape)
    for name in np.unique(labels.names):
        out = labels.names == name
        models = _fit(labels, ~out, {})
        for level in range(shape[1]):
            estimated[out, level] = models.estimate(labels.estimate[out, level])
            closed[out, level] = models.closings(labels.closings[out, level])
    seen = labels.held[:, :, :LOOKED_AT].sum(axis=2)
    simulated = (PRIOR_STRENGTH * closed + seen) / (PRIOR_STRENGTH + LOOKED_AT)
    return {"estimated": estimated, "closings alone": closed, "simulated": simulated}


def area_under_curve(values: NDArray[np.float64], positive: NDArray[np.bool_]) -> float:
    """Probability that a positive one has the larger value; ties count half. NaN without both kinds."""
    ones = int(positive.sum())
    if ones in (0, len(positive)):
        return float("nan")
    ranks = rankdata(values)[positive].sum()
    return float((ranks - ones * (ones + 1) / 2) / (ones * (len(positive) - ones)))


def calibration_error(values: NDArray[np.float64], shares: NDArray[np.float64]) -> float:
    """Mean difference of prediction and share that held over bins of the prediction, weighted by their grasps."""
    bins = np.minimum((values * BINS).astype(int), BINS - 1)
    return sum(abs(float((values - shares)[bins == number].sum())) for number in range(BINS)) / len(values)


def _fit(labels: Labels, chosen: NDArray[np.bool_], provenance: dict[str, Any]) -> HoldModels:
    """Models of some of the grasps, all levels together."""
    held = labels.shares[chosen].ravel()

    def model(features: tuple[str, ...], rows: NDArray[np.float64]) -> LogisticModel:
        return LogisticModel.fit(features, rows[chosen].reshape(-1, len(features)), held)

    estimate, closings = model(ESTIMATE_FEATURES, labels.estimate), model(CLOSING_FEATURES, labels.closings)
    return HoldModels(estimate, closings, PRIOR_STRENGTH, provenance)


def _judged(labels: Labels, predicted: dict[str, NDArray[np.float64]]) -> list[dict[str, Any]]:
    """AUC, calibration and Brier score of every tier at every level."""
    rows = []
    for number, level in enumerate(LEVELS):
        held = labels.held[:, number]
        unseen = held[:, LOOKED_AT:].mean(axis=1)
        ceiling = area_under_curve(
            held[:, : EXECUTIONS // 2].mean(axis=1), held[:, EXECUTIONS // 2 :].mean(axis=1) >= 0.5
        )
        for tier, values in predicted.items():
            shares = unseen if tier == "simulated" else held.mean(axis=1)
            value = values[:, number]
            rows.append(
                {
                    "level": level,
                    "tier": tier,
                    "auc": area_under_curve(value, shares >= 0.5),
                    "calibration": calibration_error(value, shares),
                    "brier": float(np.mean((value - shares) ** 2)),
                    "ceiling": ceiling,
                }
            )
    return rows


def _curves(
    labels: Labels, predicted: dict[str, NDArray[np.float64]]
) -> dict[str, dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]]:
    """Predictions and shares that held, by level and tier."""
    return {
        level: {
            tier: (values[:, number], labels.held[:, number, LOOKED_AT if tier == "simulated" else 0 :].mean(axis=1))
            for tier, values in predicted.items()
        }
        for number, level in enumerate(LEVELS)
    }


def _provenance(labels: Labels, rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "objects": sorted(set(labels.names.tolist())),
        "grasps": len(labels.names),
        "executions": EXECUTIONS,
        "levels": {level: noise.to_document() for level, noise in LEVELS.items()},
        "left_out": rows,
        "command": "fingersplit bench --only holding --refit",
    }


def _first_grasps(bench: Bench, name: str) -> list[dict[str, Any]]:
    """Share of executions in which an object's first grasp holds, by level and how grasps are ranked."""
    bench.note(f"executing first grasps of {name} under noise")
    model = prepare_object(bench.objects[name](), name, ObjectOptions(mass=measured_masses().get(name)))
    pieces, rows = decompose(model.mesh), []
    for number, (level, noise) in enumerate(LEVELS.items()):
        orders = {
            "margin": RankingOrder("holding_margin", noise),
            "estimated": RankingOrder("p_hold", noise),
            "simulated": RankingOrder("p_hold", noise, BUDGET, lambda: pieces),
        }
        for tier, ranking in orders.items():
            found = find_grasps(
                model, bench.hand, starts=bench.starts, seed=SEED + 1, top_k=1, ranking=ranking, threads=THREADS
            )
            if found.feasible:
                executor = Executor(bench.hand, model, pieces, found.friction, model.mass)
                executor.place(executed(found.grasps[0]))
                draws = noise.draw(DRAWS, 77 + number)
                held = mean(executor.holds(draws, which) for which in range(DRAWS))
                said = found.grasps[0].p_hold
                predicted = None if said is None else said.value
                rows.append({"object": name, "level": level, "ranked": tier, "held": held, "predicted": predicted})
    return rows


def _times(bench: Bench) -> dict[str, list[float]]:
    """Times [ms]: estimates of all feasible grasps of an ordinary plan, and one simulated closing."""
    noise, estimates, closings = NoiseModel(), [], []
    for name in bench.objects:
        model = bench.model(name)
        found = find_grasps(model, bench.hand, starts=bench.starts, seed=SEED, top_k=bench.starts)
        ranked = [one for one in found.grasps if one.run.feasible]
        if not ranked:
            continue
        candidates = [judged(one) for one in ranked]
        executor = Executor(bench.hand, model, decompose(model.mesh), found.friction, model.mass)
        for _ in range(bench.repeats):
            began = perf_counter()
            estimate_holding(bench.hand, model, candidates, found.friction, noise)
            estimates.append(1e3 * (perf_counter() - began))
            began = perf_counter()
            simulate_closings(executor, candidates[0], executed(ranked[0]), model.mass, noise)
            closings.append(1e3 * (perf_counter() - began) / 6)
    return {"estimates": estimates, "closings": closings}


def _figures(
    rows: list[dict[str, Any]], tops: list[dict[str, Any]], times: dict[str, list[float]], grasps: int
) -> dict[str, Figure]:
    calm, rough = LEVELS

    def tier_figure(key: str, meaning: str) -> Figure:
        of = {(row["level"], row["tier"]): row[key] for row in rows}
        value = of[calm, "simulated"]
        beside = {
            "simulated_each_axis": of[rough, "simulated"],
            "estimated": of[calm, "estimated"],
            "estimated_each_axis": of[rough, "estimated"],
        }
        return Figure(value, "1", value, value, grasps, meaning, beside, "mean")

    def share(level: str, ranked: str) -> list[float]:
        return [row["held"] for row in tops if row["level"] == level and row["ranked"] == ranked]

    means = {
        f"{ranked}{suffix}": mean(share(level, ranked) or [float("nan")])
        for level, suffix in ((calm, ""), (rough, "_each_axis"))
        for ranked in ("simulated", "estimated", "margin")
    }
    first = Figure.of(
        share(calm, "simulated"),
        "1",
        f"Share of {DRAWS} executions under noise in which the first grasp holds, ranked within {BUDGET:g} s of "
        "simulation.",
        **means,
    )
    return {
        "p_hold_auc": tier_figure("auc", "Grasps that hold at least every other time told from others, per grasp."),
        "p_hold_calibration": tier_figure("calibration", "Difference of predicted probability and share that held."),
        "noisy_top1": replace(first, value=means["simulated"], center="mean"),
        "cheap_tier_ms": Figure.of(times["estimates"], "ms", "Estimates of all feasible grasps of a plan, one thread."),
        "simulated_tier_ms": Figure.of(times["closings"], "ms", "One simulated closing."),
    }


def _tops_table(tops: list[dict[str, Any]]) -> str:
    headings = [(level, ranked) for level in LEVELS for ranked in ("margin", "estimated", "simulated")]
    shares = {(row["object"], row["level"], row["ranked"]): row["held"] for row in tops}
    names = list(dict.fromkeys(row["object"] for row in tops))
    lines = [[name, *(f"{shares[name, *key]:.2f}" for key in headings)] for name in names]
    means = [mean(shares[name, *key] for name in names) for key in headings]
    lines.append(["**mean**", *(f"**{value:.3f}**" for value in means)])
    return table(["object", *(f"{ranked}, {level}" for level, ranked in headings)], lines)
