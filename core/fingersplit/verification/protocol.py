"""What is done to a held object and when it counts as held: numbers, and the trials that they mean."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import radians
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.torsion import torsional_friction
from fingersplit.hands.hand import Hand
from fingersplit.ranges import check_known, check_settings, setting
from fingersplit.registry import first_line

__all__ = ["REFERENCE_FRICTION", "Phase", "Protocol", "Trial", "at_rest", "setting", "torsion_in"]

Motion = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Palm displacement (T, 3) [m], world frame, by time since the phase began (T,) [s]."""
Vector = tuple[float, float, float]

REFERENCE_FRICTION = 0.6
"""Sliding friction that the torsional friction of protocols is stated for."""


def at_rest(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """The palm stays where it is."""
    return np.zeros((len(times), 3))


@dataclass(frozen=True)
class Phase:
    """A stretch of time in which one thing is done.

    Attributes:
        name: What is done.
        duration: How long [s].
        motion: Where the palm goes.
        pull: Force on the object's centre of mass for each kg of it, world frame [N/kg].
    """

    name: str
    duration: float
    motion: Motion = at_rest
    pull: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Trial:
    """Phases that follow the squeeze, all under one gravity.

    Attributes:
        name: What distinguishes this trial.
        phases: One after the other.
        gravity: World frame [m/s^2].
    """

    name: str
    phases: tuple[Phase, ...]
    gravity: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Protocol(ABC):
    """Numbers that every protocol has; each subclass says in ``trials`` what it does after the squeeze.

    Every trial starts from the same squeezed grasp.

    Raises:
        SettingsError: A value outside its range.
    """

    name: ClassVar[str]
    """How requests call it."""

    mass: float | None = setting(None, "kg", "Mass of the object; none for the object's own.", 1e-3, 50.0)
    friction_scale: float = setting(
        1.0, "1", "Scales the simulated friction only; grip forces use the planned friction.", 0, 10
    )
    torsional_friction: float | None = setting(
        None,
        "m",
        "Torsional friction at a requested friction of 0.6, in proportion at others; none for that of a rubber pad of "
        "the hand's radius under the grip.",
        0.0,
        0.1,
    )
    closing_time: float = setting(
        0.2, "s", "Time from the pre-grasp to the planned grasp, without gravity.", 0.05, 10.0
    )
    squeeze_time: float = setting(0.2, "s", "Time from there to the squeeze, without gravity.", 0.05, 10.0)
    closing_step: float = setting(0.003, "s", "Simulation step while the hand closes and squeezes.", 1e-4, 0.005)
    time_step: float = setting(0.002, "s", "Simulation step after that.", 1e-4, 0.005)
    decided_after: float | None = setting(
        None, "s", "Time from which a trial whose verdict stands may end; none runs every phase to its end.", 0.1, 60.0
    )
    largest_displacement: float = setting(0.02, "m", "Most that the object may move in the hand.", 0.0, 1.0)
    largest_rotation: float = setting(radians(15.0), "rad", "Most that it may turn in the hand.", 0.0, 3.2)
    largest_initial_penetration: float = setting(0.01, "m", "Most that the planned hand may lie inside.", 0.0, 0.1)
    all_contacts: bool = setting(True, "", "Whether every finger must touch at the end.", 0, 1)

    def __post_init__(self) -> None:
        check_settings(self, f"{{}} of protocol {self.name!r}")

    @property
    @abstractmethod
    def trials(self) -> tuple[Trial, ...]:
        """What is done after the squeeze, each from the same start."""

    def with_values(self, values: dict[str, Any]) -> Self:
        """The same protocol with other numbers.

        Raises:
            SettingsError: An unknown name, or a value outside its range.
        """
        check_known(values, self, f"Protocol {self.name!r} has no number {{}}")
        return replace(self, **values)

    def to_document(self) -> dict[str, Any]:
        """All numbers as plain JSON data."""
        return asdict(self)

    def info(self) -> dict[str, Any]:
        """Name, meaning and numbers, for lists of what there is."""
        return {"name": self.name, "meaning": first_line(type(self)), "numbers": asdict(self)}


def torsion_in(
    protocol: Protocol, friction: NDArray[np.float64], forces: NDArray[np.float64], hand: Hand
) -> NDArray[np.float64]:
    """Torsional friction of each finger in a simulation, (F,) [m].

    Args:
        protocol: States it, or leaves it to the pads.
        friction: Sliding friction that was asked for, (F,).
        forces: Normal forces of the grip, (F,) [N].
        hand: The hand.
    """
    if protocol.torsional_friction is not None:
        return np.asarray(protocol.torsional_friction * friction / REFERENCE_FRICTION)
    radii = np.array([pad.radius for pad in hand.pads])
    return torsional_friction(protocol.friction_scale * friction, forces, radii)
