"""Section `second_engine`: whether Drake with hydroelastic contact agrees on which grasps hold."""

from collections import Counter
from dataclasses import asdict, replace
from importlib.metadata import version
from math import degrees
from statistics import median
from typing import Any

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.verification import verify
from fingersplit.verification.protocols import load_protocol
from fingersplit_bench.objects import measured_masses
from fingersplit_bench.second_engine.disagreements import FRICTION_STEPS, disagreement_table
from fingersplit_bench.second_engine.executing import TIME_STEP, Outcome, execute
from fingersplit_bench.second_engine.trials import SPOILT, TrialGrasp, trial_grasps
from fingersplit_bench.second_engine.world import DISSIPATION, hydroelastic_modulus
from fingersplit_bench.suite import Bench, Chapter, Figure, table

__all__ = ["agreement_table", "compare", "in_drake", "in_mujoco", "second_engine_chapter"]

_LIFT = load_protocol("lift")
OUTCOMES = ((True, True), (True, False), (False, True), (False, False))
"""Held in MuJoCo, held in Drake."""


def second_engine_chapter(bench: Bench) -> Chapter:
    """Execute the same grasps in both engines and compare the verdicts."""
    masses, rows = measured_masses(), []
    for name, load in bench.objects.items():
        bench.note(f"planning for {name}")
        mesh = load()
        model = prepare_object(mesh, name, ObjectOptions(mass=masses.get(name)))
        pieces = decompose(mesh)
        for number, trial in enumerate(trial_grasps(bench, name, model, pieces, _LIFT), 1):
            bench.note(f"second engine, {name}, grasp {number}")
            rows.append(compare(bench.hand, model, pieces, trial))
    agreed = [float(row["mujoco"]["held"] == row["drake"]["held"]) for row in rows]
    figure = Figure.of(
        agreed,
        "1",
        "Share of grasps on whose `lift` Drake and MuJoCo agree.",
        lost_in_mujoco=float(sum(not row["mujoco"]["held"] for row in rows)),
        lost_in_drake=float(sum(not row["drake"]["held"] for row in rows)),
    )
    return Chapter(
        "A second engine",
        "\n\n".join([_text(bench, rows), agreement_table(rows), "### Disagreements", disagreement_table(rows)]),
        {"engine_agreement": replace(figure, value=sum(agreed) / len(agreed), center="mean")},
        {"grasps": rows},
    )


def compare(hand: Hand, model: ObjectModel, pieces: ConvexPieces, trial: TrialGrasp) -> dict[str, Any]:
    """What both engines say of a grasp, plain JSON data in SI units; where they disagree, with ``probes``."""
    mujoco, drake = in_mujoco(hand, model, pieces, trial), asdict(in_drake(hand, model, trial))
    row: dict[str, Any] = {
        "object": trial.object_name,
        "kind": trial.kind,
        "rank": trial.rank,
        "mass": trial.mass,
        "friction": trial.friction,
        "mujoco": mujoco,
        "drake": {"held": drake["reason"] == "held", **drake},
    }
    if row["drake"]["held"] != mujoco["held"]:
        others = [replace(trial, friction=step * trial.friction) for step in FRICTION_STEPS]
        row["probes"] = {
            "mujoco": [in_mujoco(hand, model, pieces, other)["held"] for other in others],
            "drake": [in_drake(hand, model, other).held for other in others],
            "pieces": in_drake(hand, model, trial, pieces).held,
        }
    return row


def in_drake(hand: Hand, model: ObjectModel, trial: TrialGrasp, pieces: ConvexPieces | None = None) -> Outcome:
    """A grasp executed in Drake, on the object's own triangles or its convex pieces."""
    return execute(
        trial.grasp,
        hand,
        model,
        _LIFT,
        trial.execution,
        mass=trial.mass,
        friction=trial.friction,
        pieces=pieces,
    )


def in_mujoco(hand: Hand, model: ObjectModel, pieces: ConvexPieces, trial: TrialGrasp) -> dict[str, Any]:
    """The same by our verification, in the words of ``Outcome``."""
    report = verify(
        trial.grasp,
        hand,
        model,
        pieces,
        _LIFT,
        friction=trial.friction,
        mass=trial.mass,
        execution=trial.execution,
    )
    closing = [phase for phase in (report.closing, report.squeeze) if phase is not None]
    lifting = [phase for each in report.trials for phase in each.phases]
    return {
        "held": report.passed,
        "reason": report.reason,
        "phase": lifting[-1].name if lifting else "closing",
        "closing": max((phase.displacement for phase in closing), default=0.0),
        "closing_turn": max((phase.rotation for phase in closing), default=0.0),
        "slip": report.slip,
        "turn": report.turn,
        "lost": list(lifting[-1].lost_contacts if lifting else ()),
    }


def agreement_table(rows: list[dict[str, Any]]) -> str:
    """Markdown: how often both engines hold, one of them, or neither, by kind of grasp."""
    lines = []
    for kind in ("planned", *SPOILT, "all"):
        chosen = [row for row in rows if kind in (row["kind"], "all")]
        counts = Counter((row["mujoco"]["held"], row["drake"]["held"]) for row in chosen)
        agreed = counts[True, True] + counts[False, False]
        share = f"{agreed / len(chosen):.1%}" if chosen else "-"
        lines.append([kind, str(len(chosen)), *(str(counts[outcome]) for outcome in OUTCOMES), share])
    headings = ["grasps", "number", "held / held", "held / lost", "lost / held", "lost / lost", "agreement"]
    return table(headings, lines) + "\n\nFirst MuJoCo, then Drake."


def _text(bench: Bench, rows: list[dict[str, Any]]) -> str:
    both = [row for row in rows if row["mujoco"]["held"] and row["drake"]["held"]]
    slips = {engine: [1e3 * row[engine]["slip"] for row in both] for engine in ("mujoco", "drake")}
    turns = [degrees(abs(row["drake"]["turn"] - row["mujoco"]["turn"])) for row in both]
    modulus = hydroelastic_modulus(sum(pad.radius for pad in bench.hand.pads) / len(bench.hand.pads))
    medians = [f"{median(values):.2f}" if values else "-" for values in (*slips.values(), turns)]
    return (
        f"`lift` in Drake {version('drake')}: pre-grasp, closing, squeeze, gravity and lift as published, with the "
        "same links, masses, servos, torque limits, friction and limits of slip and turn as in MuJoCo. The object "
        "is its own mesh, rigid, where MuJoCo collides convex pieces of it; the hand's solids are compliant "
        f"(hydroelastic modulus {1e-6 * modulus:.1f} MPa, whose patch is that of a rubber pad, dissipation "
        f"{DISSIPATION:g} s/m), so contact is a patch with pressure where MuJoCo has points with torsional friction. "
        f"SAP solver, convex approximation `lagged`, steps of {1e3 * TIME_STEP:g} ms; CPU time of a grasp "
        f"{median([row['drake']['seconds'] for row in rows]):.2f} s in the median. Half of the grasps are ranked first "
        "and executed as planned; the others are displaced, executed in a slippery world or with a heavy object, or "
        "ranked last, drawn before either engine runs.\n\n"
        f"Where both hold, the median slip is {medians[0]} mm in MuJoCo and {medians[1]} mm in Drake, and the turns "
        f"differ by {medians[2]} degrees in the median."
    )
