"""Tables I and II of Fan2018 on our objects: iterations, counts and time of a run, by stage and in all."""

from collections.abc import Callable
from statistics import mean, median
from typing import Any

from fingersplit.hands import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import prepare_object
from fingersplit.plan import Plan
from fingersplit.planning import plan

STAGES = ("tangent search", "projection and test", "collision")


def measure_object(name: str, load: Callable[[], Mesh], hand: Hand, repeats: int) -> dict[str, Any]:
    """Figures of one object: medians over the runs of a plan, and of the plan over repeats, warm."""
    mesh = load()
    model = prepare_object(mesh, name)
    plan(model, hand, starts=4)
    plans = [plan(model, hand, starts=64, seed=1) for _ in range(repeats)]
    runs = plans[0].runs
    run_ms = [1e3 * run.seconds[-1] for each in plans for run in each.runs]
    return {
        "object": name,
        "vertices": len(mesh.vertices),
        "samples": len(model.surface.normals),
        "runs": len(runs),
        "feasible": plans[0].feasible,
        "rounds": mean(run.rounds for run in runs),
        "cpo": mean(run.cpo for run in runs),
        "ppo": mean(run.ppo for run in runs),
        "run_ms": median(run_ms),
        "us_per_iteration": 1e6 * sum(sum(run.seconds[:6]) for run in runs) / sum(run.cpo + run.ppo for run in runs),
        "plan_ms": median(1e3 * sum(each.seconds.values()) for each in plans),
        "best_ferrari_canny": plans[0].grasps[0].metrics.ferrari_canny if plans[0].grasps else 0.0,
        "stage_ms": _stage_times(plans[0]),
    }


def _stage_times(result: Plan) -> dict[str, dict[str, float]]:
    """Mean time of a run by stage, for CPO and PPO [ms]."""
    return {
        phase: {stage: 1e3 * mean(run.seconds[3 * p + s] for run in result.runs) for s, stage in enumerate(STAGES)}
        for p, phase in enumerate(("CPO", "PPO"))
    }


def table_one(rows: list[dict[str, Any]]) -> str:
    """Markdown of Table I, with the feasible share and the whole plan's time beside it."""
    lines = [
        "| object | #iters | #CPO/PPO | run [ms] | us/iteration | plan of 64 [ms] | feasible | #vertices |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['object']} | {row['rounds']:.1f} | {row['cpo']:.0f}/{row['ppo']:.0f} | {row['run_ms']:.2f} "
        f"| {row['us_per_iteration']:.1f} | {row['plan_ms']:.0f} | {row['feasible']}/{row['runs']} "
        f"| {row['vertices']:,} |"
        for row in rows
    ]
    return "\n".join(lines)


def table_two(rows: list[dict[str, Any]]) -> str:
    """Markdown of Table II: mean time of a run by stage over all objects."""
    lines = [f"| time [ms] | {' | '.join(STAGES)} | total |", "|---|---|---|---|---|"]
    for phase in ("CPO", "PPO"):
        times = [mean(row["stage_ms"][phase][stage] for row in rows) for stage in STAGES]
        lines.append(f"| {phase} | {' | '.join(f'{time:.3f}' for time in times)} | {sum(times):.3f} |")
    return "\n".join(lines)
