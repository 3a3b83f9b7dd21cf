"""Planner settings: the paper's defaults, and what is refused."""

import dataclasses
import math

import pytest

from fingersplit.errors import SettingsError
from fingersplit.splitting.settings import PlannerSettings


def test_defaults_are_those_of_the_paper():
    settings = PlannerSettings()
    assert (settings.object_weight, settings.hand_weight) == (1.0, 0.01)
    assert (settings.time_step, settings.cpo_gain, settings.ppo_gain) == (0.05, 2.0, 2.0)
    assert (settings.cpo_trust_region, settings.ppo_trust_region) == (0.15, 0.5)
    assert (settings.cpo_least_increase, settings.ppo_least_increase) == (0.0, 0.0)
    assert (settings.max_inner_iterations, settings.min_inner_iterations) == (50, 2)
    assert settings.pad_angle_limit == 0.6
    assert settings.line_search is False


def test_document_round_trip():
    settings = PlannerSettings(friction=0.3, line_search=True, max_outer_iterations=7)
    assert PlannerSettings.from_document(settings.to_document()) == settings
    assert PlannerSettings.from_document({}) == PlannerSettings()
    assert PlannerSettings.from_document({"friction": 1}).friction == 1.0


def test_every_setting_states_unit_range_and_meaning():
    for setting in dataclasses.fields(PlannerSettings):
        assert setting.metadata["doc"].endswith(".")
        assert isinstance(setting.metadata["unit"], str)
        assert setting.metadata["low"] <= setting.default <= setting.metadata["high"]


def test_kernels_get_the_same_values_in_their_types():
    settings = PlannerSettings(friction=1, max_inner_iterations=9)
    compiled = settings.for_kernels()
    assert compiled._asdict() == settings.to_document()
    for setting in dataclasses.fields(PlannerSettings):
        assert type(getattr(compiled, setting.name)) is type(setting.default)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"fricton": 0.5}, r"Unknown planner setting 'fricton'; known: .*friction"),
        ({"max_inner_iterations": True}, r"'max_inner_iterations' must be .*, got True"),
        ({"max_inner_iterations": 5.0}, r"'max_inner_iterations' must be .*, got 5.0"),
        ({"friction": True}, r"'friction' must be .*, got True"),
        ({"friction": "0.5"}, r"'friction' must be .*, got '0.5'"),
        ({"friction": None}, r"'friction' must be .*, got None"),
        ({"line_search": 1}, r"'line_search' must be .*, got 1"),
        ({"friction": 0.0}, r"'friction' is 0.0; allowed: 0.01 to 5"),
        ({"friction": math.nan}, r"'friction' is nan; allowed"),
        ({"friction": math.inf}, r"'friction' is inf; allowed"),
        ({"max_outer_iterations": 0}, r"'max_outer_iterations' is 0; allowed: 1 to"),
        ({"pad_angle_limit": 3.2}, r"'pad_angle_limit' is 3.2; allowed: 0 to"),
        ({"time_step": 10**400}, r"'time_step' is 1000+; allowed"),
    ],
)
def test_refused(document, message):
    with pytest.raises(SettingsError, match=message):
        PlannerSettings.from_document(document)
