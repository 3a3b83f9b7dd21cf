"""Planner settings: the paper's values, what a fidelity fills in, and what is refused."""

import dataclasses
import math

import pytest

from fingersplit.errors import SettingsError
from fingersplit.splitting.collision_kernel import RANGE
from fingersplit.splitting.settings import FIDELITIES, PlannerSettings


def test_paper_fidelity_has_the_values_of_the_paper():
    settings = PlannerSettings.of("paper")
    assert settings.fidelity == "paper"
    assert (settings.object_weight, settings.hand_weight) == (1.0, 0.01)
    assert (settings.time_step, settings.cpo_gain, settings.ppo_gain) == (0.05, 2.0, 2.0)
    assert (settings.cpo_trust_region, settings.ppo_trust_region) == (0.15, 0.5)
    assert (settings.cpo_least_increase, settings.ppo_least_increase) == (0.0, 0.0)
    assert (settings.max_inner_iterations, settings.min_inner_iterations) == (50, 2)
    assert settings.pad_angle_limit == 0.6
    assert settings.line_search is False


def test_paper_fidelity_knows_no_potentials_and_one_step_length():
    settings = PlannerSettings.of("paper")
    assert settings.potentials is False
    assert (settings.clearance_weight, settings.pad_angle_weight, settings.joint_limit_weight) == (0.0, 0.0, 0.0)
    assert (settings.trust_region_growth, settings.trust_region_shrink) == (1.0, 0.0)
    assert settings.least_round_increase == 0.0


def test_what_a_feasible_grasp_is_does_not_depend_on_the_fidelity():
    paper, default = PlannerSettings.of("paper"), PlannerSettings()
    for name in (
        "pad_angle_limit",
        "contact_tolerance",
        "penetration_tolerance",
        "object_weight",
        "hand_weight",
    ):
        assert getattr(paper, name) == getattr(default, name)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_fidelity_fills_in_what_is_not_given(fidelity):
    assert PlannerSettings.from_document({"fidelity": fidelity}) == PlannerSettings.of(fidelity)
    changed = PlannerSettings.from_document({"fidelity": fidelity, "cpo_gain": 0.3, "max_inner_iterations": 7})
    assert changed == dataclasses.replace(PlannerSettings.of(fidelity), cpo_gain=0.3, max_inner_iterations=7)
    assert changed != PlannerSettings.of(fidelity)


def test_default_is_the_default():
    assert PlannerSettings.of("default") == PlannerSettings() == PlannerSettings.from_document({})


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_document_round_trip(fidelity):
    settings = PlannerSettings.of(fidelity, cpo_gain=0.3, line_search=True, max_outer_iterations=7)
    assert PlannerSettings.from_document(settings.to_document()) == settings
    assert PlannerSettings.from_document({"cpo_gain": 1}).cpo_gain == 1.0


def test_every_setting_states_unit_range_and_meaning():
    fidelity, *tunable = dataclasses.fields(PlannerSettings)
    assert fidelity.metadata["doc"].endswith(".")
    for setting in tunable:
        assert setting.metadata["doc"].endswith(".")
        assert isinstance(setting.metadata["unit"], str)
        for value in (setting.default, setting.metadata["paper"]):
            assert setting.metadata["low"] <= value <= setting.metadata["high"]
            assert type(value) is type(setting.default)


def test_kernels_get_the_same_values_in_their_types():
    settings = PlannerSettings(cpo_gain=1, max_inner_iterations=9, line_search=True)
    compiled = settings.for_kernels()
    document = settings.to_document()
    assert document.pop("fidelity") == "default"
    assert {name: compiled[name].item() for name in compiled.dtype.names} == document
    for setting in dataclasses.fields(PlannerSettings)[1:]:
        assert type(compiled[setting.name].item()) is type(setting.default)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"fidelty": "paper"}, r"Unknown planner setting 'fidelty'; did you mean 'fidelity'\? Known: fidelity, "),
        ({"friction": 0.5}, r"Unknown planner setting 'friction'; .* option of the object"),
        ({"max_inner_iterations": True}, r"'max_inner_iterations' must be .*, got True"),
        ({"max_inner_iterations": 5.0}, r"'max_inner_iterations' must be .*, got 5.0"),
        ({"cpo_gain": True}, r"'cpo_gain' must be .*, got True"),
        ({"cpo_gain": "0.5"}, r"'cpo_gain' must be .*, got '0.5'"),
        ({"cpo_gain": None}, r"'cpo_gain' must be .*, got None"),
        ({"line_search": 1}, r"'line_search' must be .*, got 1"),
        ({"time_step": 0.0}, r"'time_step' is 0.0; allowed: 0.0001 to 1"),
        ({"cpo_gain": math.nan}, r"'cpo_gain' is nan; allowed"),
        ({"cpo_gain": math.inf}, r"'cpo_gain' is inf; allowed"),
        ({"max_outer_iterations": 0}, r"'max_outer_iterations' is 0; allowed: 1 to"),
        ({"pad_angle_limit": 3.2}, r"'pad_angle_limit' is 3.2; allowed: 0 to"),
        ({"fidelity": "best"}, r"'fidelity' is 'best'; allowed: default, paper"),
        ({"fidelity": "Paper", "cpo_gain": 0.5}, r"'fidelity' is 'Paper'; allowed"),
        ({"potentials": 1}, r"'potentials' must be true or false, got 1"),
        ({"clearance_margin": 0.01}, r"'clearance_margin' is 0.01; allowed: 0 to"),
        ({"time_step": 10**400}, r"'time_step' is 1000+; allowed"),
    ],
)
def test_refused(document, message):
    with pytest.raises(SettingsError, match=message):
        PlannerSettings.from_document(document)


def test_links_are_pushed_only_where_their_clearance_is_measured():
    margin = PlannerSettings.__dataclass_fields__["clearance_margin"]
    assert margin.default <= margin.metadata["high"] <= RANGE
