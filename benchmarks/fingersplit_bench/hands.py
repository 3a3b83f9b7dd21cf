"""Section `hands`: kinematics, speed, feasible share and lifts of every hand that is there."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from fingersplit.errors import FingersplitError
from fingersplit.hands.check.measures import pad_errors
from fingersplit.hands.draft.sampling import sample_postures
from fingersplit.hands.hand import Hand, available_hands, load_hand
from fingersplit.hands.public_hands import FOLDERS_VARIABLE, described_hands
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.verification import verify_ranked
from fingersplit.verification.protocols import load_protocol
from fingersplit_bench.calls import SEED
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["HandRow", "hands_chapter", "hands_there", "measure_hand"]

POSTURES = 10_000
HANDS_VARIABLE = "FINGERSPLIT_BENCH_HANDS"
"""Environment variable: names, folders or zips of the hands to measure, separated by commas."""


@dataclass(frozen=True)
class HandRow:
    """Figures of one hand.

    Attributes:
        name: Its name.
        fingers: Active fingers, its joints and its drivers.
        pads_m: Largest difference of pads from MuJoCo's over random postures [m].
        jacobians: The same of their Jacobians by drivers [m/rad].
        starts_per_s: Starts of whole plans by CPU time on one thread, over all objects [1/s].
        feasible_per_s: Feasible ones of them [1/s].
        shares: Share of the starts that are feasible, by object.
        firsts: Rank that was held first of those verified in order, by object; None where none was.
        lift_s: Time until then, by object [s].
    """

    name: str
    fingers: str
    pads_m: float
    jacobians: float
    starts_per_s: float
    feasible_per_s: float
    shares: dict[str, float]
    firsts: dict[str, int | None]
    lift_s: dict[str, float]


def hands_chapter(bench: Bench) -> Chapter:
    """Measure every hand that ships, and those with a description whose model is there."""
    hands, missing = hands_there(bench.hand.name)
    rows = [measure_hand(bench, hand) for hand in hands]
    text = "\n\n".join(
        [
            f"CPU time of whole plans of {bench.starts} starts on one thread. First verified: objects of which one "
            f"ranked grasp holds `lift`; top-1: of which the first does. Kinematics: {POSTURES:,} random postures "
            "against MuJoCo.",
            table(_HEADINGS, [_cells(row, rows[0]) for row in rows]),
            "Feasible share and rank that held first, by object.",
            table(["object", *(row.name for row in rows)], [_object_cells(name, rows) for name in bench.objects]),
            *([f"Left out: {'; '.join(missing)}"] if missing else []),
        ]
    )
    return Chapter("Hands", text, {}, {"hands": [asdict(row) for row in rows]})


_HEADINGS = [
    "hand",
    "fingers / joints / drivers",
    "pads [m]",
    "Jacobians [m/rad]",
    "starts/s",
    "by the first",
    "feasible/s",
    "by the first",
    "feasible",
    "first verified",
    "top-1",
    "longest [s]",
]


def hands_there(first: str) -> tuple[list[Hand], list[str]]:
    """Every hand whose model is there, the ``first`` one in front, and why others are not.

    Models of others are looked for in a folder ``shared/hands`` beside the checkout where nothing else is said.
    """
    beside = Path(__file__).parents[3] / "shared" / "hands"
    if beside.is_dir():
        os.environ.setdefault(FOLDERS_VARIABLE, str(beside))
    asked = os.environ.get(HANDS_VARIABLE)
    names = asked.split(",") if asked else [*available_hands(), *described_hands()]
    names.sort(key=lambda name: name != first)  # the others are compared with it
    hands, missing = list[Hand](), list[str]()
    for name in names:
        try:
            hands.append(load_hand(name))
        except FingersplitError as error:
            missing.append(f"{name}: {error}")
    return hands, missing


def measure_hand(bench: Bench, hand: Hand) -> HandRow:
    """Kinematics, then a plan and its verification until one grasp holds for every object of the bench."""
    bench.note(f"kinematics of {hand.name}")
    pads, jacobians = pad_errors(hand, sample_postures(hand.model, POSTURES, np.random.default_rng(SEED)))
    protocol = load_protocol("lift")
    shares: dict[str, float] = {}
    firsts: dict[str, int | None] = {}
    times: dict[str, float] = {}
    started = feasible = 0
    used = 0.0
    for name in bench.objects:
        model = bench.model(name)
        bench.note(f"{hand.name} and {name}")
        if not shares:
            find_grasps(model, hand, starts=4, seed=SEED)  # loads kernels
        began = process_time()
        found = find_grasps(model, hand, starts=bench.starts, seed=SEED, threads=1)
        used += process_time() - began
        started, feasible = started + len(found.runs), feasible + found.feasible
        shares[name] = found.feasible / found.starts
        pieces = decompose(model.mesh)
        planned = plan(model, hand, starts=bench.starts, seed=SEED)
        began = perf_counter()
        checked = verify_ranked(planned, model, hand, pieces, verified=1, protocol=protocol, threads=2)
        times[name] = perf_counter() - began
        firsts[name] = next((g.rank for g in checked.grasps if g.verification and g.verification.passed), None)
    return HandRow(
        name=hand.name,
        fingers=f"{len(hand.fingers)} / {len(hand.joint_names)} / {len(hand.driver_names)}",
        pads_m=pads,
        jacobians=jacobians,
        starts_per_s=started / used,
        feasible_per_s=feasible / used,
        shares=shares,
        firsts=firsts,
        lift_s=times,
    )


def _cells(row: HandRow, first: HandRow) -> list[str]:
    held = [rank for rank in row.firsts.values() if rank is not None]
    return [
        row.name,
        row.fingers,
        f"{row.pads_m:.0e}",
        f"{row.jacobians:.0e}",
        f"{row.starts_per_s:.0f}",
        f"{row.starts_per_s / first.starts_per_s:.2f}",
        f"{row.feasible_per_s:.0f}",
        f"{row.feasible_per_s / first.feasible_per_s:.2f}",
        f"{np.mean(list(row.shares.values())):.1%}",
        f"{len(held)} of {len(row.firsts)}",
        f"{sum(rank == 1 for rank in held)}",
        f"{max(row.lift_s.values()):.1f}",
    ]


def _object_cells(name: str, rows: list[HandRow]) -> list[str]:
    return [name, *(f"{row.shares[name]:.0%}, {row.firsts[name] or 'none'}" for row in rows)]
