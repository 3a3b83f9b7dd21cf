"""The image's steps one by one in a clean root, and the service that comes out of it."""

import shutil
import signal
import subprocess
import time
from pathlib import Path

import httpx2
import pytest

from clean_root import CleanRoot, build, usable
from fingersplit_bench.service.machines import free_port
from fingersplit_client import Client

REPOSITORY = Path(__file__).parents[2]


@pytest.mark.campaign
@pytest.mark.skipif(not usable(), reason="needs root and debootstrap")
def test_the_image_builds_and_serves_as_another_user(tmp_path):
    root = build(REPOSITORY / "Dockerfile", CleanRoot.bootstrap(tmp_path / "base"), tmp_path)
    port = free_port()
    root.environment |= {"FINGERSPLIT_PORT": str(port)}
    kernels = sorted((root.path / "var/cache/fingersplit").rglob("*.nbc"))
    assert kernels
    with root.mounted():
        service = subprocess.Popen(root.arguments(root.command["CMD"]))
        try:
            began = time.monotonic()
            while subprocess.run(root.arguments(root.command["HEALTHCHECK"]), stderr=subprocess.DEVNULL).returncode:
                assert service.poll() is None
                assert time.monotonic() < began + 600
                time.sleep(0.5)
            with Client(f"http://127.0.0.1:{port}", timeout=300) as client:
                result = client.plan(REPOSITORY / "examples" / "objects" / "mug.ply", starts=16, verified=1)
            assert result.best.verification.passed
            assert httpx2.get(f"http://127.0.0.1:{port}/review").status_code == 200
        finally:
            service.send_signal(signal.SIGTERM)
            service.wait(60)
    assert sorted((root.path / "var/cache/fingersplit").rglob("*.nbc")) == kernels  # all were warm
    assert service.returncode == 0
    shutil.rmtree(tmp_path)
