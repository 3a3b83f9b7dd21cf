"""A real service in a process of its own, on a port of loopback."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx2

from fingersplit_client import Client

__all__ = ["Server"]

_IDLE_FOR, _IDLE_SHARE = 1.0, 0.1
"""Time over which its processes together must take less than this share of a core to count as idle [s]."""


class Server:
    """Starts `fingersplit serve` on a data directory; used in a ``with`` statement.

    Attributes:
        url: Where it listens.
        seconds_to_ready: From the start of the process until its workers were warm.
    """

    def __init__(self, data_dir: Path, workers: int = 2, spares: int = 1, **settings: object) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = probe.getsockname()[1]
        self.url = f"http://127.0.0.1:{self._port}"
        self.seconds_to_ready = 0.0
        self._data_dir, self._workers, self._spares = data_dir, workers, spares
        settings |= {"spare_workers": spares}
        self._environment = {f"FINGERSPLIT_{name.upper()}": str(value) for name, value in settings.items()}

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(30)

    def start(self) -> None:
        """Start it and wait until it is ready."""
        began = time.monotonic()
        program = Path(sys.executable).with_name("fingersplit")
        options = ["--port", str(self._port), "--workers", str(self._workers), "--data-dir", str(self._data_dir)]
        self.process = subprocess.Popen(
            [program, "serve", *options],
            env=os.environ | {"FINGERSPLIT_LOG_LEVEL": "error"} | self._environment,
            stdout=subprocess.DEVNULL,
        )
        with Client(self.url) as client:
            while True:
                if self.process.poll() is not None:
                    raise RuntimeError("the service ended while it started")
                if client.ready():
                    break
                time.sleep(0.02)
        self.seconds_to_ready = time.monotonic() - began

    def kill(self) -> None:
        """End it as a crash would."""
        self.process.kill()
        self.process.wait()

    def workers(self) -> list[int]:
        """Process ids of its workers, the spare one included."""
        return [pid for pid in self.processes() if pid != self.process.pid and "spawn_main" in _command(pid)]

    def complete(self) -> bool:
        """Whether all workers are warm, the spare ones too."""
        with self.http() as http:
            told = dict(line.rsplit(" ", 1) for line in http.get("/metrics").text.splitlines() if line[0] != "#")
        warm, spare = (float(told[f'fingersplit_workers{{state="{state}"}}']) for state in ("warm", "spare"))
        return (warm, spare) == (self._workers, self._spares)

    def wait_until_idle(self) -> None:
        """Wait until all workers are warm, the spare ones too, and done with work in advance."""
        while not self.complete():
            time.sleep(0.05)
        before, now = -1.0, self._cpu_s()
        while now - before > _IDLE_SHARE * _IDLE_FOR:
            time.sleep(_IDLE_FOR)
            before, now = now, self._cpu_s()

    def _cpu_s(self) -> float:
        """CPU time of its processes so far [s]."""
        total = 0.0
        for pid in self.processes():
            with suppress(FileNotFoundError, ProcessLookupError):  # one that has just ended
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        return total

    def processes(self) -> list[int]:
        """Process ids of it and its children."""
        found = [self.process.pid]
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                if int((folder / "stat").read_text().rpartition(")")[2].split()[1]) == self.process.pid:
                    found.append(int(folder.name))
            except (FileNotFoundError, ProcessLookupError):
                continue
        return found

    def memory(self) -> float:
        """Memory of all its processes, pages that they share counted once [MiB]."""
        total = 0
        for pid in self.processes():
            text = Path(f"/proc/{pid}/smaps_rollup").read_text()
            match = re.search(r"^Pss:\s+(\d+)", text, re.MULTILINE)
            total += int(match[1]) if match else 0
        return total / 1024

    def has_file(self, job_id: str, pattern: str) -> bool:
        """Whether a job's folder holds a file of that name."""
        return any((self._data_dir / "jobs" / job_id).glob(pattern))

    def http(self) -> httpx2.Client:
        """A plain connection, to time what is sent over it."""
        return httpx2.Client(base_url=self.url, timeout=120)


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""
