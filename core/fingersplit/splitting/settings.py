"""What a caller may tune, with the paper's values as defaults."""

import json
import math
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

from fingersplit.errors import SettingsError

__all__ = ["KernelSettings", "PlannerSettings"]


_KINDS: dict[type, str] = {float: "a number", int: "a whole number", bool: "true or false"}


def _setting(default: float, unit: str, doc: str, low: float, high: float) -> Any:
    return field(default=default, metadata={"unit": unit, "doc": doc, "low": low, "high": high})


@dataclass(frozen=True)
class PlannerSettings:
    """Parameters of the splitting; defaults are those of [Fan2018] section IV-A where the paper has one.

    Raises:
        SettingsError: A value outside its range; ranges stand in the field metadata.
    """

    object_weight: float = _setting(1.0, "1/m^2", "Weight w1 of the contact triangle in Q.", 0.0, 1e6)
    hand_weight: float = _setting(0.01, "1", "Weight w2 of the joints' distance from mid-range in Q.", 0.0, 1e6)
    time_step: float = _setting(0.05, "s", "Time step T_s of every tangent and tracking step.", 1e-4, 1.0)
    cpo_gain: float = _setting(2.0, "1/s", "Tracking gain K_cpo.", 0.0, 1e3)
    ppo_gain: float = _setting(2.0, "1/s", "Tracking gain K_ppo.", 0.0, 1e3)
    cpo_trust_region: float = _setting(0.15, "m and rad", "Length sigma_cpo of a CPO tangent step.", 1e-6, 10.0)
    ppo_trust_region: float = _setting(0.5, "rad/s", "Joint speed sigma_ppo of a PPO tangent step.", 1e-6, 100.0)
    cpo_least_increase: float = _setting(0.0, "1", "CPO ends when Q rises by no more than delta_c.", 0.0, 1.0)
    ppo_least_increase: float = _setting(0.0, "1", "PPO ends when Q rises by no more than delta_p.", 0.0, 1.0)
    max_inner_iterations: int = _setting(50, "1", "Most iterations M of one CPO or PPO.", 1, 1_000)
    min_inner_iterations: int = _setting(2, "1", "The loop ends when CPO and PPO both take fewer than m.", 1, 1_000)
    max_outer_iterations: int = _setting(30, "1", "Most rounds of CPO and PPO.", 1, 100)
    line_search: bool = _setting(False, "", "Search the step length along the tangent (F_ls = 1).", 0, 1)
    pad_angle_limit: float = _setting(0.6, "rad", "Most between pad normal and inward surface normal.", 0.0, math.pi)
    contact_tolerance: float = _setting(0.5e-3, "m", "Most between fingertip and surface in a grasp.", 1e-6, 0.01)
    penetration_tolerance: float = _setting(1e-3, "m", "Most that a link may lie inside the object.", 0.0, 0.01)
    friction: float = _setting(0.6, "1", "Coulomb friction between pads and object.", 0.01, 5.0)

    def __post_init__(self) -> None:
        for setting in fields(self):
            value: Any = getattr(self, setting.name)
            kind: type[Any] = type(setting.default)
            accepted = (float, int) if kind is float else (kind,)
            if type(value) not in accepted:
                raise SettingsError(f"Planner setting {setting.name!r} must be {_KINDS[kind]}, got {value!r}.")
            low, high = setting.metadata["low"], setting.metadata["high"]
            if not low <= value <= high:
                raise SettingsError(f"Planner setting {setting.name!r} is {value!r}; allowed: {low:g} to {high:g}.")
            object.__setattr__(self, setting.name, kind(value))

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """Settings from plain JSON data; what is left out keeps its default.

        Raises:
            SettingsError: An unknown name, a value of the wrong type or outside its range.
        """
        known = [setting.name for setting in fields(cls)]
        unknown = sorted(set(document) - set(known))
        if unknown:
            raise SettingsError(f"Unknown planner setting {unknown[0]!r}; known: {', '.join(known)}.")
        return cls(**document)

    @classmethod
    def from_pairs(cls, pairs: Sequence[str]) -> Self:
        """Settings from texts such as ``friction=0.4``.

        Raises:
            SettingsError: As ``from_document``, or a text that is no pair.
        """
        values = {}
        for pair in pairs:
            name, _, text = pair.partition("=")
            try:
                values[name] = json.loads(text)
            except json.JSONDecodeError:
                raise SettingsError(f"Setting {pair!r} is not NAME=VALUE with a number, true or false.") from None
        return cls.from_document(values)

    def for_kernels(self) -> "KernelSettings":
        """The same values as the tuple that compiled code reads."""
        return KernelSettings(**asdict(self))

    def to_document(self) -> dict[str, Any]:
        """All values as plain JSON data."""
        return asdict(self)


KernelSettings = namedtuple("KernelSettings", [s.name for s in fields(PlannerSettings)])  # type: ignore[misc]
"""The settings as compiled code reads them, field for field."""
