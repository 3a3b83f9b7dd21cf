"""Section `ipopt`: Table III of [Fan2018], finger splitting against IPOPT on problem (1) from the same starts."""

from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

from fingersplit.objects.model import ObjectModel
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search
from fingersplit_bench.calls import FIDELITIES, paired_runs, plan_once, settings_of, warm_up
from fingersplit_bench.cases import Case, cases_of, parallel_grasps_of
from fingersplit_bench.ipopt.implicit_surface import fit_surface
from fingersplit_bench.ipopt.judgement import Judgement, judge_grasp
from fingersplit_bench.ipopt.problem import MAX_ITERATIONS, GeneralProblem, Solution, build_problem
from fingersplit_bench.suite import Bench, Chapter, Figure, table

__all__ = ["Attempt", "CaseComparison", "measure_ipopt", "table_three"]

STARTS = 8
"""Starts of each case that IPOPT gets, at most; it takes a hundred times as long for one."""

PUBLISHED = (
    ("Li et al., IPOPT through AMPL [Fan2018]", 8.36, 15.32),
    ("HFTS, 1,002 vertices [Fan2018]", 0.76, 16.26),
    ("HFTS, 20,586 vertices [Fan2018]", 13.41, 16.26),
    ("finger splitting, Matlab [Fan2018]", 0.15, 0.43),
)
"""Table III of [Fan2018] on the bunny: preprocessing and optimisation [s]."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """What became of one start: IPOPT's answer and its measure, and our runs by fidelity."""

    solution: Solution
    judgement: Judgement
    runs: dict[str, Run]


@dataclass(frozen=True, eq=False)
class CaseComparison:
    """One case: how long each side takes to prepare the object [s], and every start that both tried."""

    case: Case
    object_name: str
    prepare_seconds: dict[str, float]
    attempts: list[Attempt]

    def to_document(self) -> dict[str, Any]:
        """What Table III states, as plain JSON data; times are medians over the starts."""
        runs = {fidelity: [attempt.runs[fidelity] for attempt in self.attempts] for fidelity in FIDELITIES}
        return {
            "case": self.case.name,
            "object": self.object_name,
            "starts": len(self.attempts),
            "ipopt": {
                "prepare_s": self.prepare_seconds["ipopt"],
                "ms": median(1e3 * attempt.solution.seconds for attempt in self.attempts),
                "iterations": median(attempt.solution.iterations for attempt in self.attempts),
                "converged": sum(attempt.solution.converged for attempt in self.attempts),
                "feasible": sum(attempt.judgement.feasible for attempt in self.attempts),
                "quality": median(attempt.judgement.quality for attempt in self.attempts),
                "residual": median(attempt.judgement.residual for attempt in self.attempts),
                "penetration": median(attempt.judgement.penetration for attempt in self.attempts),
                "pad_angle": median(attempt.judgement.pad_angle for attempt in self.attempts),
            },
            **{
                fidelity: {
                    "prepare_s": self.prepare_seconds["splitting"],
                    "ms": median(1e3 * run.seconds[-1] for run in runs[fidelity]),
                    "feasible": sum(run.feasible for run in runs[fidelity]),
                    "quality": median(float(run.scores[0]) for run in runs[fidelity]),
                }
                for fidelity in FIDELITIES
            },
        }


def measure_ipopt(bench: Bench) -> Chapter:
    """Solve problem (1) with IPOPT and by finger splitting from the same mapped starts."""
    problems: dict[str, tuple[GeneralProblem, float]] = {}
    measured = []
    for case, name in cases_of(bench):
        grasps = parallel_grasps_of(bench, case, name)
        if grasps:
            if name not in problems:
                problems[name] = _prepare(bench, name)
            plans = {
                fidelity: plan_once(
                    bench.model(name), bench.hand, grasps, fidelity=fidelity, starts=min(STARTS, bench.starts)
                )
                for fidelity in FIDELITIES
            }
            measured.append(_compare(bench, case, bench.model(name), *problems[name], plans))
    rows = [each.to_document() for each in measured if each.attempts]
    attempts = [attempt for each in measured for attempt in each.attempts]
    if not attempts:
        return Chapter("IPOPT on the same problem", "No object could be grasped from the side asked for.")
    return Chapter(
        "IPOPT on the same problem",
        _text(rows, min(STARTS, bench.starts)),
        {"ipopt_ratio": _ratio(attempts)},
        {"cases": rows},
    )


def _prepare(bench: Bench, name: str) -> tuple[GeneralProblem, float]:
    """Problem (1) for an object, and how long our own preparation of it takes [s]."""
    bench.note(f"fitting an implicit surface to {name}")
    model = bench.model(name)
    warm_up(model, bench.hand)
    began = perf_counter()
    prepare_object(model.mesh, name)
    seconds = perf_counter() - began
    return build_problem(fit_surface(model), bench.hand, settings_of("paper")), seconds


def _compare(
    bench: Bench, case: Case, model: ObjectModel, problem: GeneralProblem, prepare_s: float, plans: dict[str, Search]
) -> CaseComparison:
    bench.note(f"IPOPT on {case.name} ({model.name})")
    attempts = []
    for runs in paired_runs(*plans.values()):
        start = runs[0].initial
        solution = problem.solve(start)
        judgement = judge_grasp(model, bench.hand, settings_of("paper"), solution.object_from_palm, solution.joints)
        attempts.append(Attempt(solution, judgement, dict(zip(plans, runs, strict=True))))
    seconds = {"ipopt": problem.surface.seconds + problem.seconds, "splitting": prepare_s}
    return CaseComparison(case, model.name, seconds, attempts)


def _ratio(attempts: list[Attempt]) -> Figure:
    """IPOPT's time over ours, start by start."""
    times = {
        fidelity: [attempt.solution.seconds / attempt.runs[fidelity].seconds[-1] for attempt in attempts]
        for fidelity in FIDELITIES
    }
    return Figure.of(
        times["default"],
        "1",
        "CPU time of IPOPT on problem (1) over wall time of a run of ours at default fidelity, start by start.",
        paper_fidelity=median(times["paper"]),
        ipopt_q=median(attempt.judgement.quality for attempt in attempts),
        default_q=median(float(attempt.runs["default"].scores[0]) for attempt in attempts),
        paper_q=median(float(attempt.runs["paper"].scores[0]) for attempt in attempts),
        ipopt_feasible=sum(attempt.judgement.feasible for attempt in attempts) / len(attempts),
        default_feasible=sum(attempt.runs["default"].feasible for attempt in attempts) / len(attempts),
        paper_feasible=sum(attempt.runs["paper"].feasible for attempt in attempts) / len(attempts),
    )


def _text(rows: list[dict[str, Any]], starts: int) -> str:
    return "\n\n".join(
        [
            "Problem (1) of [Fan2018] as a nonlinear program in palm position, palm quaternion, joints and contacts: "
            "maximise Q with every contact on the surface, every pad's centre a pad radius off its contact along the "
            "normal, and joints in their ranges. The surface is the zero set of a cubic B-spline of the signed "
            "distance on a grid, so it is smooth and rounds off what is finer than the grid. Exact first and second "
            f"derivatives (CasADi), IPOPT with MUMPS, at most {MAX_ITERATIONS} iterations. Both sides start from the "
            f"same mapped grasps, up to {starts} a case; times are CPU times for IPOPT and wall times for us, so that "
            "a busy machine does not count against IPOPT. Like problem (1) in the paper, the program knows no "
            "collision and no pad angle; `feasible` is our own measure of the answer, with both, on the triangles.",
            "### Table III: time and final quality",
            table_three(rows),
            "Q is the median over all starts, feasible or not, at the points that the pads touch; a higher Q of a "
            "grasp that is not feasible is no grasp.",
            "### As the paper has it: seconds on the bunny",
            _paper_table(rows),
        ]
    )


def table_three(rows: list[dict[str, Any]]) -> str:
    """Markdown of time, quality and feasible share a case."""
    headings = ["case", "IPOPT [ms]", "ours, paper [ms]", "ours, default [ms]", "Q IPOPT", "Q paper", "Q default"]
    lines = []
    for row in rows:
        ways = [row[way] for way in ("ipopt", *FIDELITIES)]
        lines.append(
            [
                f"{row['case']} ({row['object']})",
                *(f"{way['ms']:.2f}" for way in ways),
                *(f"{1e3 * way['quality']:.2f}" for way in ways),
                " / ".join(str(way["feasible"]) for way in ways) + f" of {row['starts']}",
                f"{row['ipopt']['converged']} of {row['starts']}",
            ]
        )
    headings[4:] = [f"{heading} x1000" for heading in headings[4:]]
    return table([*headings, "feasible: IPOPT / paper / default", "IPOPT converged"], lines)


def _paper_table(rows: list[dict[str, Any]]) -> str:
    """Preprocessing, optimisation and total [s] on the bunny, or the first object, beside the published ones."""
    row = next((row for row in rows if row["case"] == "Bunny"), rows[0])
    ours = [
        ("IPOPT on problem (1), this run", row["ipopt"]),
        ("finger splitting, paper fidelity, this run", row["paper"]),
        ("finger splitting, default fidelity, this run", row["default"]),
    ]
    lines = [[name, f"{first:.2f}", f"{second:.2f}", f"{first + second:.2f}"] for name, first, second in PUBLISHED]
    for name, way in ours:
        seconds = way["prepare_s"], 1e-3 * way["ms"]
        lines.append([name, f"{seconds[0]:.2f}", f"{seconds[1]:.4f}", f"{sum(seconds):.2f}"])
    note = (
        f"Object of this run: {row['object']}. Preparation is the spline and the program for IPOPT, the surface "
        "samples for us; it is needed once an object. The paper's 0.15 s is its parallel grasp."
    )
    return table(["method", "preparation [s]", "optimisation [s]", "total [s]"], lines) + f"\n\n{note}"
