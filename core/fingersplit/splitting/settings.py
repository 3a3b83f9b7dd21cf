"""What a caller may tune: the fast defaults, and the values of [Fan2018] at ``fidelity="paper"``."""

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

import numpy as np

from fingersplit.errors import SettingsError
from fingersplit.ranges import check_known, check_settings, setting

__all__ = ["FIDELITIES", "SETTINGS", "PlannerSettings"]

FIDELITIES = ("default", "paper")


def _setting(default: Any, unit: str, doc: str, low: float, high: float, paper: Any = None) -> Any:
    return setting(default, unit, doc, low, high, paper=default if paper is None else paper)


@dataclass(frozen=True)
class PlannerSettings:
    """Parameters of the splitting.

    The constructor's defaults are those of the fast fidelity; ``of("paper")`` gives the parameters of [Fan2018] section
    IV-A, without potentials and with the step control of its algorithms.

    Raises:
        SettingsError: A value outside its range; ranges stand in the field metadata.
    """

    fidelity: str = field(
        default="default", metadata={"unit": "", "doc": "Where defaults come from: default or paper."}
    )
    object_weight: float = _setting(1.0, "1/m^2", "Weight w1 of the contact triangle in Q.", 0.0, 1e6)
    hand_weight: float = _setting(0.01, "1", "Weight w2 of the joints' distance from mid-range in Q.", 0.0, 1e6)
    time_step: float = _setting(1.0, "s", "Time step T_s of tangent and tracking steps.", 1e-4, 1.0, paper=0.05)
    cpo_gain: float = _setting(1.0, "1/s", "Tracking gain K_cpo; 1 / T_s tracks fully.", 0.0, 1e3, paper=2.0)
    ppo_gain: float = _setting(1.0, "1/s", "Tracking gain K_ppo; 1 / T_s tracks fully.", 0.0, 1e3, paper=2.0)
    cpo_trust_region: float = _setting(0.15, "m and rad", "Longest CPO tangent step sigma_cpo.", 1e-6, 10.0, paper=0.15)
    ppo_trust_region: float = _setting(
        0.15, "rad/s", "Largest joint speed sigma_ppo of a PPO tangent step.", 1e-6, 100.0, paper=0.5
    )
    trust_region_growth: float = _setting(2.0, "1", "Factor on the trust region after a step.", 1.0, 10.0, paper=1.0)
    trust_region_shrink: float = _setting(
        0.25, "1", "Factor on the trust region after a refused step.", 0.0, 0.9, paper=0.0
    )
    least_trust_region: float = _setting(0.03, "as sigma", "A trust region below this ends the phase.", 1e-6, 10.0)
    cpo_least_increase: float = _setting(
        1e-6, "1", "A CPO step must raise Q by more than delta_c.", 0.0, 1.0, paper=0.0
    )
    ppo_least_increase: float = _setting(
        1e-6, "1", "A PPO step must raise Q by more than delta_p.", 0.0, 1.0, paper=0.0
    )
    least_round_increase: float = _setting(
        4e-5, "1", "The loop ends when a round raises Q by no more; 0 does not look.", 0.0, 1.0, paper=0.0
    )
    max_inner_iterations: int = _setting(4, "1", "Most iterations M of one CPO or PPO.", 1, 1_000, paper=50)
    min_inner_iterations: int = _setting(2, "1", "The loop ends when CPO and PPO both take fewer than m.", 1, 1_000)
    max_outer_iterations: int = _setting(10, "1", "Most rounds of CPO and PPO.", 1, 100, paper=30)
    line_search: bool = _setting(False, "", "Search the step length along the tangent (F_ls = 1).", 0, 1)
    pad_angle_limit: float = _setting(0.6, "rad", "Most between pad normal and inward surface normal.", 0.0, math.pi)
    contact_tolerance: float = _setting(0.3e-3, "m", "Most between fingertip and surface in a grasp.", 1e-6, 0.01)
    penetration_tolerance: float = _setting(1e-3, "m", "Most that a link may lie inside the object.", 0.0, 0.01)
    potentials: bool = _setting(True, "", "Push links, pads and joints away from their limits.", 0, 1, paper=False)
    clearance_margin: float = _setting(2e-3, "m", "Links nearer to the object are pushed away.", 0.0, 2.5e-3)
    clearance_weight: float = _setting(300.0, "1/m^2", "Weight of the clearance potential.", 0.0, 1e6, paper=0.0)
    soft_pad_angle: float = _setting(0.5, "rad", "Pads tilted more are turned back.", 0.0, math.pi)
    pad_angle_weight: float = _setting(0.1, "1/rad^2", "Weight of the pad angle potential.", 0.0, 1e3, paper=0.0)
    joint_limit_margin: float = _setting(0.05, "1", "Joints nearer to a limit, as a share of the range.", 0.0, 0.5)
    joint_limit_weight: float = _setting(0.1, "1", "Weight of the joint limit potential.", 0.0, 1e3, paper=0.0)
    palm_sliding: int = _setting(
        1,
        "1",
        "Contacts slide while the palm moves: 0 never, 1 for fewer than two drivers a finger, 2 always.",
        0,
        2,
        0,
    )

    def __post_init__(self) -> None:
        if self.fidelity not in FIDELITIES:
            raise SettingsError(f"Planner setting 'fidelity' is {self.fidelity!r}; allowed: {', '.join(FIDELITIES)}.")
        check_settings(self, "Planner setting {}")

    @classmethod
    def of(cls, fidelity: str, **changed: Any) -> Self:
        """The settings of a fidelity, but for those that are given.

        Raises:
            SettingsError: An unknown fidelity, a value of the wrong type or outside its range.
        """
        if fidelity == "paper":
            changed = {one.name: one.metadata["paper"] for one in fields(cls)[1:]} | changed
        return cls(fidelity=fidelity, **changed)

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """Settings from plain JSON data; what is left out has the value of its ``fidelity``.

        Raises:
            SettingsError: An unknown name, a value of the wrong type or outside its range.
        """
        advice = "The friction is no setting of the splitting: give it to `plan`, or as an option of the object."
        check_known(document, cls, "Unknown planner setting {}", advice)
        return cls.of(**{"fidelity": "default", **document})

    def for_kernels(self) -> np.record:
        """The same values as the ``SETTINGS`` record that compiled code reads."""
        record: np.record = np.rec.array(np.zeros(1, SETTINGS))[0]
        for name in SETTINGS.names or ():
            setattr(record, name, getattr(self, name))
        return record

    def to_document(self) -> dict[str, Any]:
        """All values as plain JSON data."""
        return asdict(self)


SETTINGS = np.dtype([(s.name, type(s.default)) for s in fields(PlannerSettings)[1:]], align=True)
"""The settings as compiled code reads them, field for field."""
