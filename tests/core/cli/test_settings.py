"""What the program tells about itself: settings, scenes, version, completion, the columns of its tables."""

import json
import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fingersplit.cli.main import app
from fingersplit.cli.planning import _legend
from fingersplit.contacts.metrics import available_metrics
from fingersplit.errors import SettingsError
from fingersplit.planning.planning import plan
from fingersplit.scene import Constraints
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.verification.controllers import available_controllers
from fingersplit.verification.protocols import available_protocols

PROGRAM = Path(sys.executable).with_name("fingersplit")


def told(*arguments: str, code: int = 0) -> str:
    finished = CliRunner().invoke(app, arguments)
    assert finished.exit_code == code, finished.output
    return finished.output


def test_every_planner_setting_is_listed_with_range_and_meaning():
    shown = told("settings")
    for setting in fields(PlannerSettings):
        assert setting.name in shown
    assert "0.0001 to 1" in shown
    assert "Time step T_s of tangent and tracking steps." in shown
    assert "Other topics: gravity_six, joint_torque, lift" in " ".join(shown.split())


def test_protocols_controllers_and_objects_have_settings_too():
    assert "density" in told("settings", "object")
    assert "[kg/m^3]" in told("plan", "--help")  # brackets are no markup
    assert "decided_after" in told("settings", "lift")
    documents = json.loads(told("settings", "--json"))
    assert set(documents) == {"planner", "object", *available_protocols(), *available_controllers()}
    height = next(one for one in documents["lift"] if one["name"] == "height")
    assert (height["default"], height["unit"], height["low"], height["high"]) == (0.2, "m", 0.0, 1.0)


def test_an_unknown_topic_is_answered_with_the_nearest():
    finished = CliRunner().invoke(app, ["settings", "lfit"])
    assert isinstance(finished.exception, SettingsError)
    assert "did you mean 'lift'? Known: planner, object, " in str(finished.exception)


def test_a_scene_is_checked_and_printed_whole(tmp_path):
    (tmp_path / "scene.json").write_text('{"scene": {"support_surfaces": [{"id": "shelf"}]}}')
    document = json.loads(told("scene", str(tmp_path / "scene.json")))
    assert document["scene"]["support_surfaces"][0]["id"] == "shelf"
    assert Constraints.from_document(document).to_document() == document
    assert json.loads(told("scene", "--schema")) == Constraints.json_schema()


@pytest.mark.parametrize("arguments", [["--version"], ["--help"]])
def test_the_program_introduces_itself(arguments):
    assert told(*arguments).startswith(("fingersplit 0", "Usage: "))


def test_the_shell_completes_commands():
    environment = os.environ | {
        "_FINGERSPLIT_COMPLETE": "complete_bash",
        "COMP_WORDS": "fingersplit data",
        "COMP_CWORD": "1",
    }
    done = subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.split() == ["dataset", "data"]


def test_every_column_of_the_table_of_grasps_has_a_legend(prepared, barrett):
    lines = "\n".join(_legend(plan(prepared("box"), barrett, starts=4, seed=1)))
    for metric in available_metrics().values():
        if metric.in_tables:
            assert f"{metric.title} [{metric.unit}]: " in lines or f"{metric.title}: " in lines
    for column in ("feasible", "pad [rad]", "ended"):
        assert f"{column}: " in lines
