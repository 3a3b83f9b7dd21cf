"""Folders that archives are unpacked to go with their processes, also where these are killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
from fingersplit.hands.scratch import scratch_folder
folder = scratch_folder()
assert folder == scratch_folder()
(folder / "mesh.stl").write_text("unpacked")
print(folder, flush=True)
input()
"""


@pytest.fixture
def begin(tmp_path):
    """Starts a process that has a folder, which looks long unused from outside; the process and the folder."""
    begun = []

    def start() -> tuple[subprocess.Popen[str], Path]:
        process = subprocess.Popen(
            [sys.executable, "-c", CODE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"TMPDIR": str(tmp_path)},
        )
        begun.append(process)
        folder = Path(process.stdout.readline().strip())
        os.utime(folder / "lock", (0, 0))
        return process, folder

    yield start
    for process in begun:
        process.kill()
        process.communicate()


def test_what_a_killed_process_left_is_deleted_by_the_next_one(begin, tmp_path):
    killed, left = begin()
    alive, kept = begin()
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert left.is_dir()
    ending, own = begin()
    assert sorted(tmp_path.iterdir()) == sorted([kept, own])
    ending.communicate("\n")
    alive.communicate("\n")
    assert list(tmp_path.iterdir()) == []
