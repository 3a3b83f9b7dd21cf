"""Section `verification`: how many grasps hold in simulation, by preset, and how long that takes."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import mean, median
from typing import Any

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.grasp import Grasp
from fingersplit.hands import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.result import Verification
from fingersplit.verification import verify
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.protocols import available_protocols
from fingersplit_bench.contrast import contrast_table, measure_contrast, time_step_sentence
from fingersplit_bench.convex_pieces import measure_pieces, pieces_figure, pieces_table
from fingersplit_bench.executed import (
    executed_table,
    executed_text,
    measure_executed,
    measure_rate,
    measure_verdicts,
    prepared_objects,
)
from fingersplit_bench.objects import measured_masses
from fingersplit_bench.suite import Bench, Chapter, Figure

__all__ = ["measure_verification", "verification_chapter", "verification_tables"]

FRICTION = DEFAULT_FRICTION
TOP_K = 10
NEED_SCENES = ("pick", "noisy_pick")
"""Protocols of section `scene`."""
FROGGER = (
    "FRoGGeR [Li2023] publishes 224 of 235 (95.3 %) picks that succeed on its spheres. Its share counts converged "
    "grasps only, its hand, objects, simulator, controller and friction are others, and its pick is the likes of our "
    "`lift`; so the numbers stand side by side, not against each other."
)


def verification_chapter(bench: Bench) -> Chapter:
    """Verify the ranked grasps of every object."""
    pieces_rows, pieces = measure_pieces(bench)
    masses, rows = measured_masses(), []
    for name, load in bench.objects.items():
        bench.note(f"verifying grasps of {name}")
        rows.append(measure_verification(name, load, bench.hand, pieces[name], masses.get(name)))
    held = [float(row["presets"]["lift"]["first"] == 1) for row in rows]
    meaning = "Share of the objects whose top-ranked grasp holds `lift`, chosen without verification."
    rate = replace(Figure.of(held, "1", meaning, held=sum(held), objects=len(held)), value=mean(held), center="mean")
    objects = prepared_objects(bench, pieces)
    executed = measure_executed(bench, objects)
    figures, verdicts = measure_verdicts(bench, objects)
    figures["held_per_second"] = measure_rate(bench, objects)
    parts = [
        "### Executed as published",
        executed_table(executed),
        executed_text(),
        "### Every preset",
        verification_tables(rows),
        "### What must fall, what the splitting gains",
        contrast_table(rows),
        time_step_sentence(rows),
        "### Convex pieces",
        pieces_table(pieces_rows),
    ]
    return Chapter(
        "Verification in simulation",
        "\n\n".join(parts),
        {"holding_rate": rate, "convex_pieces_s": pieces_figure(pieces_rows)} | figures,
        {"objects": rows, "pieces": pieces_rows, "executed": executed, "verdicts": verdicts},
    )


def measure_verification(
    name: str, load: Callable[[], Mesh], hand: Hand, pieces: ConvexPieces, mass: float | None = None, seed: int = 1
) -> dict[str, Any]:
    """Figures of one object for `verification_tables` and `contrast_table`; ``mass`` [kg] where it was measured.

    The ranked grasps are verified in order until one holds, by every preset; by ``lift`` all of them are, and the
    grasps that they were before the splitting.
    """
    model = prepare_object(load(), name, ObjectOptions(mass=mass))
    runs = [grasp.run for grasp in find_grasps(model, hand, starts=64, seed=seed, top_k=TOP_K).grasps]

    def check(grasp: Grasp, protocol: str | Protocol, friction: float | Sequence[float] = FRICTION) -> Verification:
        return verify(grasp, hand, model, pieces, protocol, friction=friction, planned_friction=FRICTION, threads=2)

    if runs:
        check(runs[0].final, "lift")  # compiles the scene
    return {
        "object": name,
        "mass": model.mass,
        "ranked": len(runs),
        "split_held": sum(check(run.final, "lift").passed for run in runs),
        "initial_held": sum(check(run.initial, "lift").passed for run in runs),
        "presets": {
            preset: _until_one_holds(runs, preset, check)
            for preset in available_protocols()
            if preset not in NEED_SCENES
        },
        **measure_contrast(runs, len(hand.fingers), lambda *what: check(*what).passed),
    }


def _until_one_holds(runs: list[Any], protocol: str, check: Callable[[Any, str], Verification]) -> dict[str, Any]:
    """Rank of the first grasp that holds (None when none does), time until then [ms] and median time of one [ms]."""
    times, first = [], None
    for rank, run in enumerate(runs, 1):
        report = check(run.final, protocol)
        times.append(report.time_ms)
        if report.passed:
            first = rank
            break
    return {"first": first, "until_ms": sum(times), "one_ms": median(times) if times else 0.0}


def verification_tables(rows: list[dict[str, Any]]) -> str:
    """Markdown: the rank that first held by object and preset, totals, and split against initial grasps."""
    presets = list(rows[0]["presets"])
    lines = [
        f"| object | mass [kg] | {' | '.join(presets)} | split grasps that hold lift | initial ones |",
        "|---|---|" + "---|" * (len(presets) + 2),
    ]
    for row in rows:
        firsts = [row["presets"][preset]["first"] or "none" for preset in presets]
        lines.append(
            f"| {row['object']} | {row['mass']:.3f} "
            f"| {' | '.join(map(str, firsts))} | {row['split_held']}/{row['ranked']} "
            f"| {row['initial_held']}/{row['ranked']} |"
        )
    lines.append(f"| **rank 1 holds** | | {' | '.join(_share(rows, p, lambda f: f == 1) for p in presets)} | | |")
    lines.append(f"| **one holds** | | {' | '.join(_share(rows, p, lambda f: f is not None) for p in presets)} | | |")
    for label, key in (("one verification [ms]", "one_ms"), ("until one holds [ms]", "until_ms")):
        times = [f"{median(row['presets'][preset][key] for row in rows):.0f}" for preset in presets]
        lines.append(f"| {label}, median | | {' | '.join(times)} | | |")
    sums = [sum(row[key] for row in rows) for key in ("split_held", "initial_held", "ranked")]
    lines[-1] = lines[-1].removesuffix(" | | |") + f" | {sums[0]}/{sums[2]} | {sums[1]}/{sums[2]} |"
    return "\n".join(
        [*lines, "", f"Friction {FRICTION:g}, measured masses where known; two threads; numbers are ranks. {FROGGER}"]
    )


def _share(rows: list[dict[str, Any]], preset: str, good: Callable[[int | None], bool]) -> str:
    return f"{sum(good(row['presets'][preset]['first']) for row in rows)}/{len(rows)}"
