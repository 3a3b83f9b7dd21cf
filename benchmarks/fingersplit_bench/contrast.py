"""What tells grasps apart in simulation: slippery worlds, split against initial grasps, half the time step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.grasp import Grasp
from fingersplit.planning.run import Run
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.protocols import load_protocol
from fingersplit_bench.suite import table

__all__ = ["TOP", "Check", "World", "contrast_table", "measure_contrast", "time_step_sentence", "worlds"]

TOP = 3
"""Grasps of each object that are compared, with what each began as."""
HALVED = ("lift", "gravity_six")
"""Protocols that are run at half the time step, too."""

Check = Callable[[Grasp, Protocol, float | Sequence[float]], bool]
"""Whether a grasp holds by a protocol in a world of that friction."""


@dataclass(frozen=True)
class World:
    """A protocol, and the friction of the simulated world, one number or one a finger; the grip is planned for 0.6."""

    protocol: str
    friction: float | tuple[float, ...] = DEFAULT_FRICTION

    @property
    def label(self) -> str:
        """How tables call it."""
        if isinstance(self.friction, float):
            return f"{self.protocol}, {self.friction:g}"
        return f"{self.protocol}, finger {self.friction.index(0.0) + 1} without friction"


def worlds(fingers: int) -> tuple[World, ...]:
    """Every world that grasps of so many fingers are compared in; in the last ones, one finger has no friction."""
    return (
        *(World(protocol, friction) for protocol in ("lift", "gravity_six") for friction in (0.6, 0.45, 0.3, 0.05)),
        *(World(protocol) for protocol in ("six_direction", "six_direction_hard", "shake")),
        *(World("gravity_six", (0.6,) * k + (0.0,) + (0.6,) * (fingers - k - 1)) for k in range(fingers)),
    )


def measure_contrast(runs: Sequence[Run], fingers: int, check: Check) -> dict[str, Any]:
    """Verdicts on an object's best runs: of the split and of the initial grasp in every world, and at half the step."""
    best = runs[:TOP]
    rows = []
    for world in worlds(fingers):
        protocol = load_protocol(world.protocol)
        rows.append(
            {
                "world": world.label,
                "split": [check(run.final, protocol, world.friction) for run in best],
                "initial": [check(run.initial, protocol, world.friction) for run in best],
            }
        )
    halved = {}
    for name in HALVED:
        whole = next(row for row in rows if row["world"] == World(name).label)["split"]
        protocol = load_protocol(name)
        fine = protocol.with_values({"time_step": protocol.time_step / 2})
        halved[name] = [[held, check(run.final, fine, 0.6)] for held, run in zip(whole, best, strict=True)]
    return {"worlds": rows, "halved": halved}


def contrast_table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown: how many split and initial grasps hold in each world, over all objects."""
    lines = []
    for number, world in enumerate(rows[0]["worlds"]):
        split = [row["worlds"][number]["split"] for row in rows]
        initial = [row["worlds"][number]["initial"] for row in rows]
        lines.append([world["world"], _count(one[:1] for one in split), _count(split), _count(initial)])
    headings = ["protocol, friction", "rank 1 holds", f"ranks 1 to {TOP}", "what these began as"]
    return table(headings, lines) + (
        "\n\nThe grip is planned for a friction of 0.6 in every row; where the world has less, nobody told the hand. "
        "It is computed anew for the contacts of each initial grasp. At 0.05 everything has to fall, but for what lies "
        "on the fingers when it is lifted; with a frictionless finger, what the others cannot hold between them."
    )


def time_step_sentence(rows: Sequence[dict[str, Any]]) -> str:
    """How many verdicts change when the time step is halved, grasp by grasp."""
    parts = []
    for name in HALVED:
        pairs = [pair for row in rows for pair in row["halved"][name]]
        changed, held = sum(a != b for a, b in pairs), [b for a, b in pairs if a]
        parts.append(
            f"`{name}`: {changed} of {len(pairs)} verdicts change ({changed / max(len(pairs), 1):.1%}), of the "
            f"{len(held)} that held {len(held) - sum(held)}"
        )
    return f"Half the time step, the same grasps: {'; '.join(parts)}."


def _count(verdicts: Any) -> str:
    flat = [held for one in verdicts for held in one]
    return f"{sum(flat)}/{len(flat)}"
