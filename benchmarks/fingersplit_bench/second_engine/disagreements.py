"""Why two engines disagree on a grasp: their numbers side by side, and what changes either verdict."""

from collections import Counter
from math import degrees
from typing import Any

from fingersplit_bench.suite import table

__all__ = ["FRICTION_STEPS", "cause_of", "disagreement_table"]

FRICTION_STEPS = (0.9, 1.1)
"""Shares of the friction at which a disagreement is looked at again."""
_CAUSES = {
    "at the limit": "one engine changes its own verdict when the friction changes by a tenth: the grasp is at the "
    "limit of what friction carries, or of where the closing pushes the object",
    "geometry": "Drake says what MuJoCo says when it collides the convex pieces: what the pieces fill or leave out of "
    "the surface under the fingers decides",
    "contact model": "neither: patches of pressure and points with torsional friction carry a different load, or push "
    "a different way",
}


def cause_of(row: dict[str, Any]) -> str:
    """What a disagreement comes from, by the verdicts of its probes; one of ``at the limit``, ``geometry`` and others.

    Args:
        row: A grasp with ``held`` of either engine, and ``probes``: for each engine whether the grasp holds at the
            friction of every step, and whether it holds in Drake with the convex pieces.
    """
    probes = row["probes"]
    if any(held != row[engine]["held"] for engine in ("mujoco", "drake") for held in probes[engine]):
        return "at the limit"
    return "geometry" if probes["pieces"] == row["mujoco"]["held"] else "contact model"


def disagreement_table(rows: list[dict[str, Any]]) -> str:
    """Markdown: every grasp that one engine holds and the other does not, and what the causes mean."""
    chosen = [row for row in rows if row["mujoco"]["held"] != row["drake"]["held"]]
    if not chosen:
        return "None."
    lines = [
        [
            f"{row['object']}, rank {row['rank']}",
            row["kind"],
            *(text for engine in ("mujoco", "drake") for text in _cells(row[engine])),
            cause_of(row),
        ]
        for row in chosen
    ]
    sides = [f"{engine}: {what}" for engine in ("MuJoCo", "Drake") for what in ("verdict", "closing", "slip", "lost")]
    counts = Counter(cause_of(row) for row in chosen)
    causes = [f"- **{cause}** ({counts[cause]}): {meaning}." for cause, meaning in _CAUSES.items()]
    return "\n\n".join(
        [
            table(["grasp", "kind", *sides, "cause"], lines, left=2),
            "Closing and slip: farthest displacement [mm] / turn [deg] of the object in the hand until the squeeze, "
            "and from there on; lost: fingers that do not touch at the end. Every disagreement was executed again with "
            f"{' and '.join(f'{step:g}' for step in FRICTION_STEPS)} of the friction in both engines, and in Drake "
            "with the convex pieces of MuJoCo. Causes:",
            "\n".join(causes),
        ]
    )


def _cells(engine: dict[str, Any]) -> list[str]:
    return [
        f"{engine['reason']} ({engine['phase']})",
        _motion(engine["closing"], engine["closing_turn"]),
        _motion(engine["slip"], engine["turn"]),
        ", ".join(engine["lost"]) or "-",
    ]


def _motion(distance: float | None, turn: float | None) -> str:
    return "-" if distance is None or turn is None else f"{1e3 * distance:.1f} / {degrees(turn):.1f}"
