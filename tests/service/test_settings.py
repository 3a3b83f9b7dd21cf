import subprocess
import sys
from pathlib import Path

import pytest
import typer
from pydantic import ValidationError

from fingersplit_service.cli import doctor
from fingersplit_service.settings import ServiceSettings, is_loopback, settings_table


def test_defaults(service_environment, tmp_path):
    service_environment.setenv("XDG_DATA_HOME", str(tmp_path))
    settings = ServiceSettings()
    assert settings.host == "127.0.0.1"
    assert settings.data_dir == tmp_path / "fingersplit"
    assert 1 <= settings.workers <= 2
    assert settings.max_upload_bytes == 64 * 2**20


def test_the_environment_sets_what_options_leave(service_environment):
    service_environment.setenv("FINGERSPLIT_PORT", "9000")
    service_environment.setenv("FINGERSPLIT_WORKERS", "3")
    settings = ServiceSettings(workers=5)
    assert (settings.port, settings.workers) == (9000, 5)


def test_a_file_sets_what_the_environment_leaves(service_environment, tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text('workers = 4\nport = 9100\nlog_format = "json"\n')
    service_environment.setenv("FINGERSPLIT_CONFIG", str(file))
    service_environment.setenv("FINGERSPLIT_PORT", "9000")
    settings = ServiceSettings(max_queued_jobs=7)
    assert (settings.workers, settings.port, settings.log_format, settings.max_queued_jobs) == (4, 9000, "json", 7)


def test_a_setting_in_the_file_that_is_none_is_refused(service_environment, tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text("wokers = 4\n")
    service_environment.setenv("FINGERSPLIT_CONFIG", str(file))
    with pytest.raises(ValidationError, match="wokers"):
        ServiceSettings()


@pytest.mark.parametrize(
    ("host", "only_this_machine"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("[::1]", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.1.2", False),
        ("localhost.example", False),
        ("", False),
    ],
)
def test_loopback_is_what_only_this_machine_can_reach(host, only_this_machine):
    assert is_loopback(host) == only_this_machine


def test_the_table_has_every_setting():
    rows = [line.split("|") for line in settings_table().splitlines()[2:]]
    assert [row[1].strip(" `") for row in rows] == [
        f"FINGERSPLIT_{name.upper()}" for name in ServiceSettings.model_fields
    ]
    assert all(row[2].strip() and row[3].strip().endswith((".", "]", "].")) for row in rows)


@pytest.mark.parametrize("value", [{"workers": 0}, {"port": 70_000}, {"max_upload_bytes": -1}])
def test_values_out_of_range(service_environment, value):
    with pytest.raises(ValidationError):
        ServiceSettings(**value)


def test_the_command_refuses_in_a_sentence(service_environment, tmp_path):
    program = Path(sys.executable).with_name("fingersplit")
    ended = subprocess.run(
        [program, "serve", "--host", "0.0.0.0", "--data-dir", tmp_path],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("Refusing to listen on 0.0.0.0: without API keys")
    assert "Traceback" not in ended.stderr


def test_a_list_of_the_environment_that_is_none_is_told(service_environment, capsys, tmp_path):
    service_environment.setenv("FINGERSPLIT_CORS_ORIGINS", "https://cell.example")
    with pytest.raises(typer.Exit) as ended:
        doctor(data_dir=tmp_path)
    assert ended.value.exit_code == 2
    assert capsys.readouterr().err.startswith("cors_origins: It must be a JSON list")
