"""From planned grasps to proven ones: ranked grasps are verified in order until enough of them hold."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from time import perf_counter

from fingersplit.errors import SettingsError
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.planning.plan import Plan, PlannedGrasp, Proof
from fingersplit.verification import verify
from fingersplit.verification.controllers import Controller, load_controller
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.protocols import load_protocol

__all__ = ["prove"]


def prove(
    plan: Plan,
    pieces: ConvexPieces,
    *,
    verified: int,
    protocol: str | Protocol = "lift",
    controller: str | Controller = "virtual_frame",
    friction: float | None = None,
    mass: float | None = None,
    deadline: float | None = None,
    threads: int = 1,
    initial: bool = False,
) -> Plan:
    """Verify a plan's grasps in the order of their ranks until ``verified`` of them hold.

    Ranks stay as they are. Unless the deadline ends it, which grasps are tried does not depend on ``threads``.

    Args:
        plan: The plan.
        pieces: Its object for the simulation, from ``decompose``.
        verified: How many grasps must hold.
        protocol: Name of a preset, or one with numbers of one's own.
        controller: Name of a controller, or one with numbers of one's own.
        friction: Sliding friction between hand and object in the simulation; None for the one that was planned for. The
            grip is always planned for that one.
        mass: Mass of the object [kg]; None for the plan's.
        deadline: Begin no verification later than this after the call [s]; None for no limit.
        threads: Grasps verified at a time.
        initial: Verify the initial grasp of every tried one by the same protocol, too.

    Returns:
        The same plan with the reports in its grasps and ``Plan.proof`` on how it went.

    Raises:
        SettingsError: ``verified`` or ``threads`` below 1, or an unknown protocol or controller.
    """
    for name, value in (("verified", verified), ("threads", threads)):
        if value < 1:
            raise SettingsError(f"{name} is {value}; it must be at least 1.")
    protocol = load_protocol(protocol) if isinstance(protocol, str) else protocol
    controller = load_controller(controller) if isinstance(controller, str) else controller
    began = perf_counter()

    def try_one(planned: PlannedGrasp) -> PlannedGrasp | None:
        if deadline is not None and perf_counter() - began >= deadline:
            return None
        grasps = [planned.run.final, planned.run.initial] if initial else [planned.run.final]
        reports = [
            verify(
                grasp,
                plan.hand,
                plan.model,
                pieces,
                protocol,
                friction=plan.friction if friction is None else friction,
                planned_friction=plan.friction,
                mass=mass,
                controller=controller,
            )
            for grasp in grasps
        ]
        return replace(planned, verification=reports[0], initial_verification=reports[1] if initial else None)

    tried: list[PlannedGrasp] = []
    held, late = 0, False
    for outcome in _in_order(try_one, plan.grasps, threads):
        if outcome is None:
            late = True
            break
        tried.append(outcome)
        held += outcome.verification is not None and outcome.verification.passed
        if held == verified:
            break
    proof = Proof(
        protocol=protocol.name,
        controller=controller.name,
        wanted=verified,
        tried=len(tried),
        held=held,
        out_of_time=late,
        seconds=perf_counter() - began,
    )
    return replace(plan, grasps=(*tried, *plan.grasps[len(tried) :]), proof=proof)


def _in_order(
    try_one: Callable[[PlannedGrasp], PlannedGrasp | None], grasps: Sequence[PlannedGrasp], threads: int
) -> Iterator[PlannedGrasp | None]:
    """Outcomes in the order of the grasps, ``threads`` worked on at a time; what was begun in vain is dropped."""
    if threads == 1:
        yield from map(try_one, grasps)
        return
    waiting = iter(grasps)
    with ThreadPoolExecutor(threads) as pool:
        running = deque(pool.submit(try_one, grasp) for grasp in islice(waiting, threads))
        try:
            while running:
                yield running.popleft().result()
                running.extend(pool.submit(try_one, grasp) for grasp in islice(waiting, 1))
        finally:
            for future in running:
                future.cancel()
