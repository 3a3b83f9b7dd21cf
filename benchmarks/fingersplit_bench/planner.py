"""Section `planner`: how fast whole plans are, over every object, on one thread and on two."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from statistics import mean, median
from time import perf_counter, process_time
from typing import TypeVar

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import mug
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import Search
from fingersplit_bench.calls import plan_once, warm_up
from fingersplit_bench.machine import on_core
from fingersplit_bench.published import compare_with_published
from fingersplit_bench.suite import Bench, Chapter, Figure, table

__all__ = ["ObjectSpeed", "measure_planner", "object_table"]

Result = TypeVar("Result")

LONG_PLAN = 4
"""Times the starts of an ordinary plan; throughput is measured on long plans."""
CORES = 2
"""Cores that take turns where one thread is timed, as one may be slower than the other; two threads use both."""
FIRST_PLANS = 3
"""New processes that are timed from import to first plan, at most."""
DENSE, SPARSE = "mug_dense", "mug"
SUBDIVISIONS = 2
"""Of the sparse mug, where there is no dense one: sixteen times the faces."""


@dataclass(frozen=True)
class ObjectSpeed:
    """Figures of one object, default fidelity; times are medians over repeats.

    Attributes:
        name: Of the object.
        vertices: Of its mesh.
        runs: Of an ordinary plan.
        feasible: Runs of an ordinary plan that ended in a feasible grasp.
        run_ms: Median run [ms].
        plan_ms: An ordinary plan, from parallel grasps to ranked grasps with forces [ms].
        starts_per_second: Finished runs over the time of finding, mapping and splitting them, one thread, mean of the
            cores [1/s].
        starts_per_second_on_two: The same with two threads.
        feasible_per_second: Feasible runs over the time of the whole long plan with ranking, one thread [1/s].
        cpu_share: CPU time over wall time of the long plans on one thread; below 1 others had the rest.
        ferrari_canny: Of the best-ranked grasp, 0 when none is feasible.
    """

    name: str
    vertices: int
    runs: int
    feasible: int
    run_ms: float
    plan_ms: float
    starts_per_second: float
    starts_per_second_on_two: float
    feasible_per_second: float
    cpu_share: float
    ferrari_canny: float


def measure_planner(bench: Bench) -> Chapter:
    """Time plans of every object, mesh density and the first plan of a process."""
    speeds = [_measure_object(bench, bench.model(name)) for name in bench.objects]
    figures = {
        **_throughput(speeds, bench.starts),
        "dense_ratio": _dense_ratio(bench),
        "first_plan_s": _first_plan(bench),
    }
    text = "\n\n".join(
        [
            f"Default fidelity; plans of {bench.starts} starts (throughput: {LONG_PLAN * bench.starts}) from antipodal "
            "grasps of our own, mapping, splitting, ranking and forces included; the object is prepared beforehand.",
            object_table(speeds),
            "### Beside published planners",
            compare_with_published(figures, bench.starts),
        ]
    )
    return Chapter("Speed of the planner", text, figures, {"objects": [asdict(speed) for speed in speeds]})


def _measure_object(bench: Bench, model: ObjectModel) -> ObjectSpeed:
    bench.note(f"planning for {model.name}")
    hand, many = bench.hand, LONG_PLAN * bench.starts
    warm_up(model, hand)
    plans, seconds, alone, shares, together = [], [], [], [], []
    for _ in range(bench.repeats):
        took, result = _timed(lambda: plan_once(model, hand, starts=bench.starts))
        plans.append(result)
        seconds.append(took)
        for core in range(CORES):
            cpu = process_time()
            with on_core(core):
                took, result = _timed(lambda: plan_once(model, hand, starts=many))
            shares.append((process_time() - cpu) / took)
            alone.append((_started_per_second(result), result.feasible / took))
        together.append(_started_per_second(plan_once(model, hand, starts=many, threads=2)))
    result = plans[0]
    return ObjectSpeed(
        name=model.name,
        vertices=len(model.mesh.vertices),
        runs=len(result.runs),
        feasible=result.feasible,
        run_ms=median([1e3 * run.seconds[-1] for each in plans for run in each.runs] or [0.0]),
        plan_ms=1e3 * median(seconds),
        starts_per_second=_mean_of_cores([rate for rate, _ in alone]),
        starts_per_second_on_two=median(together),
        feasible_per_second=_mean_of_cores([rate for _, rate in alone]),
        cpu_share=median(shares),
        ferrari_canny=result.grasps[0].metrics["ferrari_canny"] or 0.0 if result.feasible else 0.0,
    )


def _mean_of_cores(rates: list[float]) -> float:
    """Mean over the cores of each one's median rate; the cores took turns."""
    return mean(median(rates[core::CORES]) for core in range(CORES))


def _started_per_second(result: Search) -> float:
    """Finished runs over the time of everything but ranking, which is paid once an answer [1/s]."""
    stages = result.seconds
    return len(result.runs) / (stages["parallel_grasps"] + stages["mapping"] + stages["splitting"])


def _timed(call: Callable[[], Result]) -> tuple[float, Result]:
    """Wall time of a call [s], and what it returned."""
    began = perf_counter()
    result = call()
    return perf_counter() - began, result


def _throughput(speeds: list[ObjectSpeed], starts: int) -> dict[str, Figure]:
    alone, together = ([getattr(s, name) for s in speeds] for name in ("starts_per_second", "starts_per_second_on_two"))
    feasible = [speed.feasible_per_second for speed in speeds]
    return {
        "starts_per_second": Figure.of(
            alone,
            "1/s",
            "Finished runs over the time to find, map and split them in a long plan, one thread, over the objects.",
            per_cpu_second=median(speed.starts_per_second / speed.cpu_share for speed in speeds),
            two_threads=median(together),
            ratio=median(two / one for one, two in zip(alone, together, strict=True) if one > 0),
        ),
        "feasible_per_second": replace(
            Figure.of(
                feasible,
                "1/s",
                "Feasible grasps over the time of a whole long plan with ranking, one thread, over the objects.",
            ),
            value=mean(feasible),
            center="mean",
            beside={"per_cpu_second": mean(speed.feasible_per_second / speed.cpu_share for speed in speeds)},
        ),
        "best_of_64_ms": Figure.of(
            [speed.plan_ms for speed in speeds],
            "ms",
            f"A plan of {starts} starts, ranked and with forces, over the objects.",
        ),
    }


def _dense_ratio(bench: Bench) -> Figure:
    """Runs on a dense mug against runs on a sparse one, taken in turns."""
    dense, sparse = _mugs(bench)
    bench.note("comparing mesh densities")
    times: dict[str, list[float]] = {dense.name: [], sparse.name: []}
    ratios = []
    for _ in range(max(bench.repeats, 2)):
        for model in (dense, sparse):
            runs = plan_once(model, bench.hand, starts=bench.starts).runs
            times[model.name].append(median(1e3 * run.seconds[-1] for run in runs))
        ratios.append(times[dense.name][-1] / times[sparse.name][-1])
    return Figure.of(
        ratios,
        "1",
        f"Median run on {dense.name} ({len(dense.mesh.vertices):,} vertices) over that on {sparse.name} "
        f"({len(sparse.mesh.vertices):,}).",
        dense_run_ms=median(times[dense.name]),
        sparse_run_ms=median(times[sparse.name]),
    )


def _mugs(bench: Bench) -> tuple[ObjectModel, ObjectModel]:
    """The dense and the sparse mug of the folder, else our own, subdivided and as it is."""
    if DENSE in bench.objects and SPARSE in bench.objects:
        return bench.model(DENSE), bench.model(SPARSE)
    sparse = mug()
    subdivided = sparse.trimesh
    for _ in range(SUBDIVISIONS):
        subdivided = subdivided.subdivide()
    dense = Mesh(subdivided.vertices, subdivided.faces)
    return prepare_object(dense, "mug, subdivided"), prepare_object(sparse, "mug")


def _first_plan(bench: Bench) -> Figure:
    """Import to first plan in new processes; the kernels are in the cache by now."""
    bench.note("starting new processes")
    command = [sys.executable, "-m", "fingersplit_bench.first_plan"]
    samples = [
        float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for _ in range(min(bench.repeats, FIRST_PLANS))
    ]
    return Figure.of(
        samples, "s", "Import, preparation of the parametric mug and a plan of 64 starts, in a new process, warm cache."
    )


def object_table(speeds: list[ObjectSpeed]) -> str:
    """Markdown of one row an object, and their mean."""
    headings = ["object", "#vertices", "run [ms]", "best of plan [ms]", "starts/s", "on two threads", "feasible/s"]
    rows = [
        [
            speed.name,
            f"{speed.vertices:,}",
            f"{speed.run_ms:.2f}",
            f"{speed.plan_ms:.0f}",
            f"{speed.starts_per_second:,.0f}",
            f"{speed.starts_per_second_on_two:,.0f}",
            f"{speed.feasible_per_second:,.0f}",
            f"{speed.feasible}/{speed.runs}",
            f"{speed.ferrari_canny:.3f}",
        ]
        for speed in speeds
    ]
    return table([*headings, "feasible", "best Ferrari-Canny"], rows)
