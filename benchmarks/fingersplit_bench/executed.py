"""First-ranked grasps executed as published, verdicts that come early, and grasps that hold for a second of work."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from statistics import median
from time import thread_time
from typing import Any

import numpy as np

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.result import GraspResult, PlanResult, Verification
from fingersplit.verification import verify
from fingersplit.verification.published import Execution
from fingersplit_bench.objects import measured_masses
from fingersplit_bench.suite import Bench, Figure

__all__ = [
    "executed_table",
    "executed_text",
    "measure_executed",
    "measure_rate",
    "measure_verdicts",
    "prepared_objects",
]

SEEDS = (11, 12, 13)
TRIALS = {
    "lift": ("lift", 1.0),
    "pull": ("pull", 1.0),
    "shake": ("shake", 1.0),
    "slippery lift": ("lift", 2.0 / 3.0),
}
"""What first-ranked grasps are put through: the protocol, and the world's friction over the planned one."""
DISPLACED = 3e-3, 10e-3
"""How far a palm is displaced so that some grasps fail, at least and at most [m]."""
SLIPPERY = 0.25
"""Share of the planned friction at which some grasps fail."""

EVEN_ODDS = 0.5
"""Probability of holding from which on a grasp is worth verifying where many are wanted."""

Prepared = tuple[ObjectModel, ConvexPieces]


def prepared_objects(bench: Bench, pieces: dict[str, ConvexPieces]) -> dict[str, Prepared]:
    """Objects with their measured masses, where there are any, and their pieces."""
    masses = measured_masses()
    return {
        name: (prepare_object(load(), name, ObjectOptions(mass=masses.get(name))), pieces[name])
        for name, load in bench.objects.items()
    }


def measure_executed(bench: Bench, objects: dict[str, Prepared]) -> list[dict[str, Any]]:
    """Reports of the first grasp of every object and seed, by what it is put through."""
    rows = []
    for name, (model, pieces) in objects.items():
        bench.note(f"executing first grasps of {name}")
        for seed in SEEDS:
            result = plan(model, bench.hand, starts=64, seed=seed, threads=2)
            reports = {} if not result.grasps else _first_reports(result, bench.hand, model, pieces)
            rows.append({"object": name, "seed": seed, "trials": reports})
    return rows


def _first_reports(result: PlanResult, hand: Hand, model: ObjectModel, pieces: ConvexPieces) -> dict[str, Any]:
    first = result.grasps[0]
    reports = {}
    for title, (protocol, factor) in TRIALS.items():
        report = verify(
            first.for_hand(hand),
            hand,
            model,
            pieces,
            protocol,
            friction=factor * result.friction,
            planned_friction=result.friction,
            execution=Execution.of_result(first, hand),
            threads=2,
        )
        moved = [phase.displacement for phase in (report.closing, report.squeeze) if phase is not None]
        reports[title] = {
            "held": report.passed,
            "firmly": report.held_firmly,
            "reason": report.reason,
            "slip": report.slip,
            "moved": max(moved, default=None),
        }
    return reports


def executed_table(rows: list[dict[str, Any]]) -> str:
    """Markdown: how many first-ranked grasps held, their slip, and how far the object moved while the hand closed."""
    lines = ["| first-ranked grasp | held | firmly | slip, median [mm] | moved on closing, median [mm] | failed |"]
    lines.append("|---|---|---|---|---|---|")
    for title in TRIALS:
        reports = [(f"{row['object']} {row['seed']}", row["trials"].get(title)) for row in rows]
        there = [report for _, report in reports if report is not None]
        slips = [1e3 * report["slip"] for report in there if report["slip"] is not None]
        moved = [1e3 * report["moved"] for report in there if report["moved"] is not None]
        failed = [
            f"{name} ({'no grasp' if report is None else report['reason']})"
            for name, report in reports
            if report is None or not report["held"]
        ]
        lines.append(
            f"| {title} | {len(rows) - len(failed)}/{len(rows)} | {sum(report['firmly'] for report in there)} "
            f"| {median(slips):.2f} | {median(moved):.2f} | {', '.join(failed)} |"
        )
    return "\n".join(lines)


def executed_text() -> str:
    """What the table shows."""
    return (
        f"Three seeds each; pre-grasp, closing, squeeze and grip as published, servos of the published stiffness. "
        f"`slippery lift`: the world has {TRIALS['slippery lift'][1]:.2g} of the planned friction."
    )


def measure_verdicts(bench: Bench, objects: dict[str, Prepared]) -> tuple[dict[str, Figure], list[dict[str, Any]]]:
    """`lift` against `lift_full` on ranked grasps as planned, displaced, slippery: its time, and changed verdicts."""
    rng, rows, times = np.random.default_rng(0), [], []
    for name, (model, pieces) in objects.items():
        bench.note(f"early verdicts of {name}")
        result = plan(model, bench.hand, starts=64, seed=SEEDS[0], top_k=10, threads=2)
        for kind, grasp, friction, execution in _cases(result, bench.hand, rng):

            def run(
                protocol: str,
                grasp: Grasp = grasp,
                friction: float = friction,
                execution: Execution = execution,
                model: ObjectModel = model,
                pieces: ConvexPieces = pieces,
            ) -> Verification:
                return verify(grasp, bench.hand, model, pieces, protocol, friction=friction, execution=execution)

            began = thread_time()
            early = run("lift")
            times.append(1e3 * (thread_time() - began))
            whole = run("lift_full")
            rows.append({"object": name, "case": kind, "early": early.reason, "whole": whole.reason})
    changes = [float((row["early"] == "held") != (row["whole"] == "held")) for row in rows]
    failed = sum(row["whole"] != "held" for row in rows) / len(rows)
    meaning = "Share of verdicts of `lift` that differ from those of `lift_full`"
    changed = Figure.of(changes, "1", meaning, failed=failed, cases=len(rows), changed=sum(changes))
    figures = {
        "lift_ms": Figure.of(times, "ms", "CPU time of one `lift`, one thread, object known."),
        "verdict_changes": replace(changed, value=sum(changes) / len(changes), center="mean"),
    }
    return figures, rows


def _cases(result: PlanResult, hand: Hand, rng: np.random.Generator) -> Iterator[tuple[str, Grasp, float, Execution]]:
    """Every ranked grasp as planned, with its palm displaced, and in a slippery world: name, grasp, friction, grip."""
    for one in result.grasps:
        grasp, execution = one.for_hand(hand), Execution.of_result(one, hand)
        yield "planned", grasp, result.friction, execution
        direction = rng.normal(size=3)
        displacement = rng.uniform(*DISPLACED) * direction / np.linalg.norm(direction)
        pose = grasp.object_from_palm.copy()
        pose[:3, 3] += displacement
        moved = replace(grasp, object_from_palm=pose, fingertips=grasp.fingertips + displacement)
        yield "displaced", moved, result.friction, execution
        yield "slippery", grasp, SLIPPERY * result.friction, execution


def measure_rate(bench: Bench, objects: dict[str, Prepared]) -> Figure:
    """Grasps that held `lift` for each second of planning and verifying, on one thread, objects known.

    Verified are grasps that the estimate gives even odds or better; the rate of verifying every feasible one stands
    beside it.
    """
    rates, of_all = [], []
    for name, (model, pieces) in objects.items():
        bench.note(f"held a second, {name}")
        _held(plan(model, bench.hand, starts=64, seed=SEEDS[0]).grasps[:1], bench, model, pieces)  # compiles the scene
        began = thread_time()
        result = plan(model, bench.hand, starts=64, seed=SEEDS[0], top_k=64)
        judged = [(one, one.p_hold.value) for one in result.grasps if one.feasible and one.p_hold is not None]
        held = _held([one for one, odds in judged if odds >= EVEN_ODDS], bench, model, pieces)
        seconds = thread_time() - began
        rates.append(held / seconds)
        began = thread_time()
        held += _held([one for one, odds in judged if odds < EVEN_ODDS], bench, model, pieces)
        of_all.append(held / (seconds + thread_time() - began))
    meaning = (
        "Grasps that hold `lift`, planned and verified, for each second of CPU time; of those with a probability of "
        f"holding of {EVEN_ODDS:g} or more."
    )
    return Figure.of(rates, "1/s", meaning, of_all_feasible=median(of_all))


def _held(grasps: Sequence[GraspResult], bench: Bench, model: ObjectModel, pieces: ConvexPieces) -> int:
    """How many of some grasps hold `lift`, executed as published."""
    hand = bench.hand
    return sum(
        verify(one.for_hand(hand), hand, model, pieces, execution=Execution.of_result(one, hand)).passed
        for one in grasps
    )
