"""The steps of a Dockerfile without a container engine: each stage a root of its own, each command in a chroot."""

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["CleanRoot", "build", "usable"]

_BASE = "python3,python3-venv,ca-certificates"
_FROM_HOST = ("etc/resolv.conf", "etc/hosts", "etc/ssl/certs/ca-certificates.crt")
_MOUNTS = {"proc": "proc", "sys": "sysfs", "dev/shm": "tmpfs"}


class CleanRoot:
    """A Debian of its own with Python, as the image that the Dockerfile begins with.

    Attributes:
        path: Where it lies.
        environment: What `ENV` set.
        user: What `USER` set; 0 is root.
        command: What `CMD` and `HEALTHCHECK` said, by instruction.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.user = path, "0"
        self.environment = {"PATH": "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin", "HOME": "/root"}
        self.command: dict[str, list[str]] = {}

    @classmethod
    def bootstrap(cls, path: Path, release: str = "bookworm") -> "CleanRoot":
        """Make a minimal system, with ``python`` where the official images have it."""
        subprocess.run(["debootstrap", "--variant=minbase", f"--include={_BASE}", release, path], check=True)
        (path / "usr" / "local" / "bin" / "python").symlink_to("/usr/bin/python3")
        for name in _FROM_HOST:
            if Path("/", name).exists():
                shutil.copy(Path("/", name), path / name)
        return cls(path)

    def copied(self, path: Path) -> "CleanRoot":
        """The same system elsewhere: a stage that begins anew."""
        subprocess.run(["cp", "-a", self.path, path], check=True)  # with its devices as such
        return CleanRoot(path)

    def arguments(self, command: list[str]) -> list[str]:
        """The command line that runs a command inside, as its user and with its environment."""
        variables = [f"{name}={value}" for name, value in self.environment.items()]
        return ["chroot", f"--userspec={self.user}:{self.user}", str(self.path), "env", "-i", *variables, *command]

    def run(self, command: list[str]) -> None:
        """Run a command inside, to its end."""
        with self.mounted():
            subprocess.run(self.arguments(command), check=True)

    @contextmanager
    def mounted(self) -> Iterator[None]:
        """With the system's own file systems, as a container has them."""
        mounted = []
        try:
            for place, kind in _MOUNTS.items():
                (self.path / place).mkdir(parents=True, exist_ok=True)
                subprocess.run(["mount", "-t", kind, kind, self.path / place], check=True)
                mounted.append(self.path / place)
            yield
        finally:
            for place in reversed(mounted):
                subprocess.run(["umount", "--lazy", place], check=True)

    def copy(self, source: Path, target: str) -> None:
        """`COPY` of a file or a folder's content."""
        place = self.path / target.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        subprocess.run(["cp", "-a", "--no-target-directory", source, place], check=True)


def build(dockerfile: Path, base: CleanRoot, folder: Path) -> CleanRoot:
    """Follow a Dockerfile step by step; the root of its last stage.

    Args:
        dockerfile: What to follow; files are copied from beside it.
        base: Stands for every image that a stage begins with.
        folder: Where the stages' roots are made.

    Raises:
        subprocess.CalledProcessError: A step failed.
        ValueError: An instruction is not one that this knows to follow.
    """
    stages: dict[str, CleanRoot] = {}
    root = base
    for instruction, value in _steps(dockerfile.read_text()):
        if instruction == "FROM":
            name = value.split(" AS ")[1] if " AS " in value else f"stage{len(stages)}"
            root = stages[name] = base.copied(folder / name)
        elif instruction == "ENV":
            for name, given in (pair.split("=", 1) for pair in shlex.split(value)):
                root.environment[name] = given.replace("$PATH", root.environment["PATH"])
        elif instruction == "RUN":
            root.run(["sh", "-ec", value])
        elif instruction == "COPY":
            of, source, target = re.fullmatch(r"(?:--from=(\S+) )?(\S+) (\S+)", value).groups()  # type: ignore[union-attr]
            root.copy((stages[of].path / source.lstrip("/")) if of else dockerfile.parent / source, target)
        elif instruction == "USER":
            root.user, root.environment["HOME"] = value, "/home/fingersplit"
        elif instruction in ("CMD", "HEALTHCHECK"):
            root.command[instruction] = _command(value)
        elif instruction not in ("VOLUME", "EXPOSE"):
            raise ValueError(f"{instruction} is not known here.")
    return root


def _steps(text: str) -> Iterator[tuple[str, str]]:
    """Instructions with their values, continued lines joined, comments left out."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    for step in re.sub(r"\\\n\s*", "", "\n".join(lines)).splitlines():
        if step.strip():
            instruction, _, value = step.partition(" ")
            yield instruction.upper(), value.strip()


def _command(value: str) -> list[str]:
    command: list[str] = json.loads(value[value.index("[") :])
    return command


def usable() -> bool:
    """Whether roots can be made here: with the right of root, and debootstrap."""
    return os.geteuid() == 0 and shutil.which("debootstrap") is not None
