"""Section `parallel_grasps`, time of antipodal sampling and of surface fitting, and how often they succeed."""

from collections.abc import Callable
from functools import partial
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.triangle_grid import bin_triangles
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.sources.antipodal import sample_antipodal
from fingersplit.parallel_grasps.sources.surface_fitting import PadGripper, fit_surfaces, surface_fits
from fingersplit_bench.suite import Bench, Chapter

__all__ = ["measure_parallel_grasps", "parallel_grasps_chapter", "table_parallel_grasps"]

FRICTION = 0.6
OPENING = (0.0, 0.2)
FITS = 32
"""Grasps that one surface fitting is to find."""


def parallel_grasps_chapter(bench: Bench) -> Chapter:
    """Measure every object."""
    rows = []
    for name, load in bench.objects.items():
        bench.note(f"parallel grasps of {name}")
        rows.append(measure_parallel_grasps(name, load, bench.repeats))
    return Chapter("Parallel grasps", table_parallel_grasps(rows), data={"objects": rows})


def measure_parallel_grasps(name: str, load: Callable[[], Mesh], repeats: int) -> dict[str, Any]:
    """Figures of one object: medians over repeats with warm kernels, each with a seed of its own [ms]."""
    mesh = load()
    model = prepare_object(mesh, name)
    sample_antipodal(prepare_object(mesh), 1, **_antipodal(1, 0))
    first_ms, first = _timed(lambda: sample_antipodal(model, 200, **_antipodal(1, 0)))
    fit_surfaces(model, 1, gripper=PadGripper(OPENING), friction=FRICTION, rng=np.random.default_rng(0))
    fits = [_timed(partial(_fit, model, seed)) for seed in range(repeats)]
    scores = surface_fits(model, 8 * FITS, PadGripper(OPENING), FRICTION, np.random.default_rng(0))[0]
    return {
        "object": name,
        "faces": len(mesh.faces),
        "grid_ms": median(_timed(lambda: bin_triangles(mesh))[0] for _ in range(repeats)),
        "first_200_ms": first_ms,
        "antipodal_200_ms": median(
            _timed(partial(sample_antipodal, model, 200, **_antipodal(1, seed)))[0] for seed in range(repeats)
        ),
        "antipodal_200": len(first),
        "antipodal_32x8_ms": median(
            _timed(partial(sample_antipodal, model, 32, **_antipodal(8, seed)))[0] for seed in range(repeats)
        ),
        "fitting_ms": median(ms for ms, _ in fits),
        "fitted": median(len(grasps) for _, grasps in fits),
        "fitting_hit_rate": float((scores > 0).mean()),
    }


def table_parallel_grasps(rows: list[dict[str, Any]]) -> str:
    """Markdown of the figures."""
    lines = [
        "| object | #faces | grid [ms] | 200 antipodal, first and warm [ms] | #found | 32 x 8 [ms] "
        "| fitting [ms] | #found | starts that fit |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['object']} | {row['faces']:,} | {row['grid_ms']:.1f} | {row['first_200_ms']:.1f}, "
        f"{row['antipodal_200_ms']:.1f} | {row['antipodal_200']} | {row['antipodal_32x8_ms']:.1f} "
        f"| {row['fitting_ms']:.1f} | {row['fitted']:.0f} | {100 * row['fitting_hit_rate']:.0f}% |"
        for row in rows
    ]
    return "\n".join(lines)


def _antipodal(approaches: int, seed: int) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    return {"friction": FRICTION, "opening": OPENING, "approaches": approaches, "rng": rng}


def _fit(model: ObjectModel, seed: int) -> ParallelGrasps:
    rng = np.random.default_rng(seed)
    return fit_surfaces(model, FITS, gripper=PadGripper(OPENING), friction=FRICTION, rng=rng)


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    began = perf_counter()
    result = call()
    return 1e3 * (perf_counter() - began), result
