"""A stored grasp with its history: the search and the simulations are run again, from the stored result alone.

Both are the same each time on the same machine, a search takes less than a millisecond, and only what is looked at is
made; so jobs keep no traces and workers keep no plans.
"""

import json
from typing import TYPE_CHECKING, Any

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.stored_objects import convex_pieces, planner_settings
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.hands.hand import Hand
    from fingersplit.objects.model import ObjectModel
    from fingersplit.planning.plan import PlannedGrasp
    from fingersplit.recording.recorded_run import RecordedRun
    from fingersplit.verification import Simulation

__all__ = ["replay_grasp"]


def replay_grasp(
    storage: Storage, model: "ObjectModel", hand: "Hand", request: JobCreate, result: str, rank: int, *, simulate: bool
) -> "RecordedRun":
    """Run the search of one stored grasp again.

    Args:
        storage: Where the object is.
        model: The object, prepared.
        hand: The hand.
        request: What the job asked for.
        result: Its result document, JSON.
        rank: Rank of the grasp, from 1.
        simulate: Whether to simulate it again, too, where the job did.

    Raises:
        ResultError: The grasp could not be reproduced: it was planned with another version or on another machine.
    """
    from fingersplit.contacts.friction import planned_friction
    from fingersplit.recording.recorded_run import RecordedRun
    from fingersplit.recording.replay import replay

    document: dict[str, Any] = json.loads(result)
    settings, friction = planner_settings(request.planner)
    friction = document.get("friction", planned_friction(friction, model.options.friction))
    grasp = replay(document, rank, model, hand, settings, friction)
    stored = next(one for one in document["grasps"] if one["rank"] == rank)
    simulations = _simulate(storage, model, hand, request, friction, grasp, stored) if simulate else {}
    return RecordedRun(
        trace=grasp.run.trace,
        document=stored,
        simulation=simulations.get("verification"),
        initial_simulation=simulations.get("initial"),
        initial_report=stored["initial"].get("verification"),
    )


def _simulate(
    storage: Storage,
    model: "ObjectModel",
    hand: "Hand",
    request: JobCreate,
    planned: float,
    grasp: "PlannedGrasp",
    stored: dict[str, Any],
) -> "dict[str, Simulation | None]":
    """The simulations that a stored grasp has reports of, by whose they are."""
    from fingersplit.verification import verify
    from fingersplit.verification.controllers import load_controller
    from fingersplit.verification.protocols import load_protocol

    asked = {"verification": (stored["verification"], grasp.run.final)}
    asked["initial"] = stored["initial"].get("verification"), grasp.run.initial
    simulations = {}
    for name, (report, state) in asked.items():
        if report is not None:
            again = verify(
                state,
                hand,
                model,
                convex_pieces(storage, request.object_id),
                load_protocol(request.protocol),
                friction=planned if request.simulated_friction is None else request.simulated_friction,
                planned_friction=planned,
                controller=load_controller(request.controller),
            )
            simulations[name] = again.simulation
    return simulations
