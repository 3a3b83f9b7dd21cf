import subprocess
import sys
from pathlib import Path

import pytest
from pydantic import ValidationError

from fingersplit_service.settings import ServiceSettings


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


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_loopback_needs_no_permission(service_environment, host):
    assert ServiceSettings(host=host).host == host


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.2", "robot.example", ""])
def test_other_addresses_need_permission(service_environment, host):
    with pytest.raises(ValidationError, match="without API keys anyone who reaches it"):
        ServiceSettings(host=host)
    assert ServiceSettings(host=host, allow_unauthenticated=True).host == host


@pytest.mark.parametrize("value", [{"workers": 0}, {"port": 70_000}, {"max_upload_bytes": -1}])
def test_values_out_of_range(service_environment, value):
    with pytest.raises(ValidationError):
        ServiceSettings(**value)


def test_the_command_refuses_in_a_sentence(service_environment):
    program = Path(sys.executable).with_name("fingersplit")
    ended = subprocess.run(
        [program, "serve", "--host", "0.0.0.0"], capture_output=True, text=True, timeout=30, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("Refusing to listen on 0.0.0.0: without API keys")
    assert "Traceback" not in ended.stderr
