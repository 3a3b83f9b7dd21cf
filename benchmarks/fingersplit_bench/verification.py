"""Section `verification`: how many grasps hold in simulation, by preset, and how long that takes."""

from collections.abc import Callable
from dataclasses import replace
from statistics import mean, median
from time import perf_counter
from typing import Any

from fingersplit.hands import Hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import prepare_object
from fingersplit.planning import plan
from fingersplit.verification import Verification, verify
from fingersplit.verification.protocols import available_protocols
from fingersplit_bench.suite import Bench, Chapter, Figure

__all__ = ["measure_verification", "verification_chapter", "verification_tables"]

FRICTION = 0.6
FROGGER = (
    "FRoGGeR [Li2023] publishes 224 of 235 (95.3 %) picks that succeed on its spheres. Its share counts converged "
    "grasps only, its hand, objects, simulator, controller and friction are others, and its pick is the likes of our "
    "`lift`; so the numbers stand side by side, not against each other."
)


def verification_chapter(bench: Bench) -> Chapter:
    """Verify the ranked grasps of every object."""
    rows = []
    for name, load in bench.objects.items():
        bench.note(f"verifying grasps of {name}")
        rows.append(measure_verification(name, load, bench.hand))
    held = [float(row["presets"]["lift"]["first"] == 1) for row in rows]
    meaning = "Share of the objects whose top-ranked grasp holds `lift`, chosen without verification."
    rate = replace(Figure.of(held, "1", meaning, held=sum(held), objects=len(held)), value=mean(held), center="mean")
    return Chapter("Verification in simulation", verification_tables(rows), {"holding_rate": rate}, {"objects": rows})


def measure_verification(
    name: str, load: Callable[[], Mesh], hand: Hand, mass: float | None = None, top_k: int = 10
) -> dict[str, Any]:
    """Figures of one object for `verification_tables`; ``mass`` [kg] where it was measured.

    The ranked grasps are verified in order until one holds, by every preset; by ``lift`` all of them are, and the
    grasps that they were before the splitting.
    """
    mesh = load()
    began = perf_counter()
    pieces = decompose(mesh)
    row: dict[str, Any] = {"object": name, "pieces": len(pieces.pieces), "pieces_s": perf_counter() - began}
    model = prepare_object(mesh, name)
    runs = [grasp.run for grasp in plan(model, hand, starts=64, seed=1, top_k=top_k).grasps]

    def check(grasp: Any, protocol: str) -> Verification:
        return verify(grasp, hand, model, pieces, protocol, friction=FRICTION, mass=mass, threads=2)

    if runs:
        check(runs[0].final, "lift")  # compiles the scene
    lifted = [check(run.final, "lift") for run in runs]
    started = [check(run.initial, "lift") for run in runs]
    row |= {
        "mass": mass or model.mass,
        "ranked": len(runs),
        "split_held": sum(report.passed for report in lifted),
        "initial_held": sum(report.passed for report in started),
        "presets": {preset: _until_one_holds(runs, preset, check) for preset in available_protocols()},
    }
    return row


def _until_one_holds(runs: list[Any], protocol: str, check: Callable[[Any, str], Verification]) -> dict[str, Any]:
    """Rank of the first grasp that holds (None when none does), time until then [ms] and median time of one [ms]."""
    times, first = [], None
    for rank, run in enumerate(runs, 1):
        report = check(run.final, protocol)
        times.append(1e3 * report.seconds)
        if report.passed:
            first = rank
            break
    return {"first": first, "until_ms": sum(times), "one_ms": median(times) if times else 0.0}


def verification_tables(rows: list[dict[str, Any]]) -> str:
    """Markdown: the rank that first held by object and preset, totals, and split against initial grasps."""
    presets = list(rows[0]["presets"])
    lines = [
        f"| object | mass [kg] | pieces (s) | {' | '.join(presets)} | split grasps that hold lift | initial ones |",
        "|---|---|---|" + "---|" * (len(presets) + 2),
    ]
    for row in rows:
        firsts = [row["presets"][preset]["first"] or "none" for preset in presets]
        lines.append(
            f"| {row['object']} | {row['mass']:.3f} | {row['pieces']} ({row['pieces_s']:.1f}) "
            f"| {' | '.join(map(str, firsts))} | {row['split_held']}/{row['ranked']} "
            f"| {row['initial_held']}/{row['ranked']} |"
        )
    lines.append(f"| **rank 1 holds** | | | {' | '.join(_share(rows, p, lambda f: f == 1) for p in presets)} | | |")
    lines.append(f"| **one holds** | | | {' | '.join(_share(rows, p, lambda f: f is not None) for p in presets)} | | |")
    for label, key in (("one verification [ms]", "one_ms"), ("until one holds [ms]", "until_ms")):
        times = [f"{median(row['presets'][preset][key] for row in rows):.0f}" for preset in presets]
        lines.append(f"| {label}, median | | | {' | '.join(times)} | | |")
    sums = [sum(row[key] for row in rows) for key in ("split_held", "initial_held", "ranked")]
    lines[-1] = lines[-1].removesuffix(" | | |") + f" | {sums[0]}/{sums[2]} | {sums[1]}/{sums[2]} |"
    return "\n".join([*lines, "", f"Friction {FRICTION:g}, two threads; numbers are ranks. {FROGGER}"])


def _share(rows: list[dict[str, Any]], preset: str, good: Callable[[int | None], bool]) -> str:
    return f"{sum(good(row['presets'][preset]['first']) for row in rows)}/{len(rows)}"
