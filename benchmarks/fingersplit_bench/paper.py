"""Section `paper`: tables I and II and both figures of [Fan2018], on public stand-ins for its objects."""

from dataclasses import asdict, dataclass
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search
from fingersplit_bench.calls import FIDELITIES, paired_runs, plan_once, warm_up
from fingersplit_bench.cases import Case, cases_of, parallel_grasps_of
from fingersplit_bench.paper_tables import PUBLISHED_STAGES, STAGES, gain_table, table_one, table_two
from fingersplit_bench.plots import draw_metrics, draw_quality_profile
from fingersplit_bench.profiles import LENGTH, metric_profiles
from fingersplit_bench.suite import Bench, Chapter, Figure

__all__ = ["CaseRuns", "measure_paper"]

PROFILE_CASE = "Screwdriver"
"""Whose quality profile the paper shows."""


@dataclass(frozen=True, eq=False)
class CaseRuns:
    """One case of Table I: the object that plays it, and its plans, ``repeats`` of each fidelity."""

    case: Case
    model: ObjectModel
    plans: dict[str, list[Search]]

    def runs(self, fidelity: str) -> list[Run]:
        """Every run of every plan; plans are the same but for their times."""
        return [run for each in self.plans[fidelity] for run in each.runs]

    def successes(self, fidelity: str) -> list[Run]:
        """The runs that ended in a feasible grasp, as the paper's did; all of them where none did."""
        runs = self.runs(fidelity)
        return [run for run in runs if run.feasible] or runs

    def run_ms(self, fidelity: str) -> float:
        """Median time of a successful run [ms]."""
        return median(1e3 * run.seconds[-1] for run in self.successes(fidelity))

    def us_per_iteration(self, fidelity: str) -> float:
        """Time in the stages of CPO and PPO over the number of tangent searches, median over the runs [us]."""
        return median(
            1e6 * sum(run.seconds[:6]) / int(run.outcome.cpo + run.outcome.ppo) for run in self.runs(fidelity)
        )

    def stage_ms(self, fidelity: str, phase: str) -> list[float]:
        """Median time of a successful run in each of ``STAGES``, in ``"CPO"`` or ``"PPO"`` [ms]."""
        first = 0 if phase == "CPO" else len(STAGES)
        runs = self.successes(fidelity)
        return [1e3 * median(run.seconds[first + stage] for run in runs) for stage in range(len(STAGES))]

    def paired_quality(self) -> list[tuple[float, float]]:
        """Final Q at paper and default fidelity of every start from which both end in a feasible grasp."""
        pairs = paired_runs(self.plans["paper"][0], self.plans["default"][0])
        return [(float(a.scores[0]), float(b.scores[0])) for a, b in pairs if a.feasible and b.feasible]

    def steepest(self) -> dict[str, Run]:
        """The run whose Q rises most at paper fidelity, feasible if any is, and that of the other from its start."""
        starts = paired_runs(*(plans[0] for plans in self.plans.values()))
        best = max(starts, key=lambda runs: (runs[0].feasible, runs[0].scores[0] - float(runs[0].first.quality)))
        return dict(zip(self.plans, best, strict=True))

    def to_document(self) -> dict[str, Any]:
        """Everything that the tables state, as plain JSON data."""
        document: dict[str, Any] = {
            "case": self.case.name,
            "object": self.model.name,
            "side": self.case.side,
            "vertices": len(self.model.mesh.vertices),
            "samples": len(self.model.surface.normals),
            "published": asdict(self.case.published) if self.case.published else None,
            "paired_quality": self.paired_quality(),
        }
        for fidelity in FIDELITIES:
            plan, runs = self.plans[fidelity][0], self.successes(fidelity)
            document[fidelity] = {
                "runs": len(plan.runs),
                "feasible": plan.feasible,
                "rounds": median(int(run.outcome.rounds) for run in runs),
                "cpo": median(int(run.outcome.cpo) for run in runs),
                "ppo": median(int(run.outcome.ppo) for run in runs),
                "run_ms": self.run_ms(fidelity),
                "us_per_iteration": self.us_per_iteration(fidelity),
                "stage_ms": {phase: self.stage_ms(fidelity, phase) for phase in PUBLISHED_STAGES},
            }
        return document


def measure_paper(bench: Bench) -> Chapter:
    """Run the paper's cases at both fidelities; draw its figures from the best-ranked grasp of each."""
    measured = [found for case, name in cases_of(bench) if (found := _run_case(bench, case, name))]
    if not measured:
        return Chapter("The paper's tables and figures", "No object could be grasped from the side asked for.")
    rows = [each.to_document() for each in measured]
    profiles = _draw(bench, measured)
    return Chapter(
        "The paper's tables and figures",
        _text(rows, profiles),
        _figures(measured),
        {"cases": rows},
    )


def _run_case(bench: Bench, case: Case, name: str) -> CaseRuns | None:
    """Plans of one case; None when no start comes from its side."""
    model, grasps = bench.model(name), parallel_grasps_of(bench, case, name)
    if not grasps:
        return None
    bench.note(f"running {case.name} ({name})")
    warm_up(model, bench.hand)
    plans = {
        fidelity: [
            plan_once(model, bench.hand, grasps, fidelity=fidelity, starts=bench.starts) for _ in range(bench.repeats)
        ]
        for fidelity in FIDELITIES
    }
    return CaseRuns(case, model, plans) if all(each[0].runs for each in plans.values()) else None


def _figures(measured: list[CaseRuns]) -> dict[str, Figure]:
    pairs = [pair for each in measured for pair in each.paired_quality()]
    quality = {
        "paper_q": median(paper for paper, _ in pairs),
        "default_q": median(default for _, default in pairs),
        "share_at_least_paper_q": mean(default >= paper for paper, default in pairs),
        "starts_compared": len(pairs),
    } if pairs else {}  # fmt: skip
    return {
        "us_per_iteration": Figure.of(
            [each.us_per_iteration("paper") for each in measured],
            "us",
            "Tangent step, projection, tests and collision of one inner iteration, paper fidelity, over the cases.",
            default_fidelity=median(each.us_per_iteration("default") for each in measured),
        ),
        "paper_run_ms": Figure.of(
            [each.run_ms("paper") for each in measured],
            "ms",
            "One run of Algorithm 3 from a mapped start to a feasible grasp, paper fidelity: a case's median, over the "
            "cases.",
            infeasible_too=median(1e3 * run.seconds[-1] for each in measured for run in each.runs("paper")),
        ),
        "default_run_ms": Figure.of(
            [each.run_ms("default") for each in measured],
            "ms",
            "The same at default fidelity, from the same starts; beside it the final Q where both end feasible.",
            infeasible_too=median(1e3 * run.seconds[-1] for each in measured for run in each.runs("default")),
            **quality,
        ),
    }


def _draw(bench: Bench, measured: list[CaseRuns]) -> list[dict[str, NDArray[np.float64]]]:
    """Write both pictures; returns the metrics of every grasp along its trace."""
    bench.note("drawing")
    shown = next((each for each in measured if each.case.name == PROFILE_CASE), measured[0])
    traces = {
        f"{shown.case.name} ({shown.model.name}), {fidelity} fidelity": run.trace
        for fidelity, run in shown.steepest().items()
    }
    draw_quality_profile(bench.folder / "quality_profile.png", traces)
    best = [each for each in measured if each.plans["paper"][0].feasible]
    profiles = [
        metric_profiles(each.plans["paper"][0].grasps[0].run.trace, each.model, DEFAULT_FRICTION)
        for each in best or measured
    ]
    draw_metrics(bench.folder / "metrics.png", profiles)
    return profiles


def _text(rows: list[dict[str, Any]], profiles: list[dict[str, NDArray[np.float64]]]) -> str:
    return "\n\n".join(
        [
            "Ten grasps as in [Fan2018]; its own objects are not public, so a public mesh stands in for each. The pose "
            "of the object is played by the side that the hand comes from: the jaw's approach lies within 60 degrees "
            "of straight down (above), straight up (below), or at least 60 degrees off both (beside). The paper "
            "shows one successful grasp a case; here every case is run from many starts, and its successful runs are "
            "counted. The paper's figures, from Matlab on a 4 GHz PC, stand in brackets.",
            "### Table I: optimisation details, paper fidelity",
            table_one(rows),
            "Iterations and times are medians over the successful runs of a case; the last row is their mean (the "
            "paper's own has 84.9/29.2 and 63,516 vertices, which its rows do not give). Parallel grasps and their "
            "mapping to the hand are not part of a run, here as in the paper.",
            "### Table II: time by stage",
            table_two(rows),
            "Medians over the successful runs of a case, their mean over the cases; totals add them up. The total "
            "of a run also holds the last pull to the surface and the check against the triangles; stages do not.",
            "### Quality during one splitting",
            "![Quality against iteration](quality_profile.png)",
            "The feasible run of the case whose Q rises most at paper fidelity, and the run from the same start at "
            "default fidelity; every accepted state is one iteration. White at the right end is the last pull to the "
            "surface, after the loop. Default fidelity climbs Q less its potentials, so Q itself may dip.",
            "### Metrics during the splitting",
            "![Four metrics during the splitting](metrics.png)",
            f"The best-ranked grasp of {len(profiles)} cases at paper fidelity. Each profile is resampled to {LENGTH} "
            "states and scaled to 0..1 by its own least and largest value; one that never changes has no trend and is "
            "left out. The planner climbs Q alone, the other three are only measured. As measured:",
            gain_table(profiles),
        ]
    )
