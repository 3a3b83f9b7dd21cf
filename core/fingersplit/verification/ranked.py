"""Verification of ranked grasps: in the order of their ranks, until enough of them hold."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from time import perf_counter

from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult
from fingersplit.result.verification import VerificationSummary
from fingersplit.verification.controllers import Controller, load_controller
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.protocols import load_protocol
from fingersplit.verification.protocols.pick import Pick
from fingersplit.verification.published import Execution
from fingersplit.verification.ranked_pick import ResultPicks
from fingersplit.verification.verifying import verify

__all__ = ["verify_ranked"]


def verify_ranked(
    result: PlanResult,
    model: ObjectModel,
    hand: Hand,
    pieces: ConvexPieces,
    *,
    verified: int,
    protocol: str | Protocol = "lift",
    controller: str | Controller = "position_servo",
    friction: float | None = None,
    mass: float | None = None,
    deadline: float | None = None,
    threads: int = 1,
    initial: bool = False,
    obstacle: Callable[[str], ObjectModel] | None = None,
) -> PlanResult:
    """Verify a result's grasps in the order of their ranks until ``verified`` of them hold.

    Ranks stay as they are. Unless the deadline ends it, which grasps are verified does not depend on ``threads``.

    Args:
        result: The result, just planned or read from a file.
        model: The object that it was planned for.
        hand: The hand that it was planned for.
        pieces: The object for the simulation, from ``decompose``.
        verified: How many grasps must hold.
        protocol: Name of a preset, or one with numbers of one's own.
        controller: Name of a controller, or one with numbers of one's own; those that execute what is published
            take it from the result.
        friction: Sliding friction between hand and object in the simulation; None for the one that was planned for. The
            grip force is always planned for that one.
        mass: Mass of the object [kg]; None for the one that was planned for.
        deadline: Begin no verification later than this after the call [s]; None for no limit.
        threads: Grasps verified at a time.
        initial: Verify the initial grasp of each of them by the same protocol, too; ``pick`` has no way to them.
        obstacle: Gives the model of an obstacle that is named by its id, for ``pick``; None where there are none.

    Returns:
        The same result with the reports in its grasps and a summary of them.

    Raises:
        SettingsError: ``verified`` or ``threads`` below 1, or an unknown protocol or controller.
        ResultError: The object or the hand is not the one of the result.
    """
    for name, value in (("verified", verified), ("threads", threads)):
        if value < 1:
            raise SettingsError(f"{name} is {value}; it must be at least 1.")
    result.check_origin(model, hand)
    hand = result.active_grip(hand)
    protocol = load_protocol(protocol) if isinstance(protocol, str) else protocol
    controller = load_controller(controller) if isinstance(controller, str) else controller
    began = perf_counter()

    picks = ResultPicks(result, model, hand, pieces, obstacle)

    def verify_one(planned: GraspResult) -> GraspResult | None:
        if deadline is not None and perf_counter() - began >= deadline:
            return None
        if isinstance(protocol, Pick):
            return replace(planned, verification=picks.verify(planned, protocol, friction))
        grasps: list[tuple[Grasp, Execution | None]] = [
            (planned.for_hand(hand), Execution.of_result(planned, hand)),
            (planned.initial.for_hand(hand), None),
        ]
        reports = [
            verify(
                grasp,
                hand,
                model,
                pieces,
                protocol,
                friction=result.friction if friction is None else friction,
                planned_friction=result.friction,
                mass=mass,
                controller=controller,
                execution=execution,
            )
            for grasp, execution in (grasps if initial else grasps[:1])
        ]
        began_as = replace(planned.initial, verification=reports[1] if initial else None)
        return replace(planned, verification=reports[0], initial=began_as)

    tried: list[GraspResult] = []
    held, late = 0, False
    for outcome in _in_order(verify_one, result.grasps, threads):
        if outcome is None:
            late = True
            break
        tried.append(outcome)
        held += outcome.verification is not None and outcome.verification.passed
        if held == verified:
            break
    summary = VerificationSummary(
        protocol=protocol.name,
        controller=controller.name,
        wanted=verified,
        tried=len(tried),
        held=held,
        message=f"{held} of {len(tried)} verified grasps held ({protocol.name}); {verified} requested."
        + (" The deadline ended the verification." if late else ""),
        time_ms=1e3 * (perf_counter() - began),
    )
    return replace(
        result,
        grasps=(*tried, *result.grasps[len(tried) :]),
        summary=replace(result.summary, verification=summary),
    )


def _in_order(
    verify_one: Callable[[GraspResult], GraspResult | None], grasps: Sequence[GraspResult], threads: int
) -> Iterator[GraspResult | None]:
    """Outcomes in the order of the grasps, ``threads`` worked on at a time; those begun in vain are dropped."""
    if threads == 1:
        yield from map(verify_one, grasps)
        return
    waiting = iter(grasps)
    with ThreadPoolExecutor(threads) as pool:
        running = deque(pool.submit(verify_one, grasp) for grasp in islice(waiting, threads))
        try:
            while running:
                yield running.popleft().result()
                running.extend(pool.submit(verify_one, grasp) for grasp in islice(waiting, 1))
        finally:
            for future in running:
                future.cancel()
