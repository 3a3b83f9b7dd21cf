"""A hand of four fingers written by the tests: MJCF and description, with what each test wants changed."""

import tomllib
from pathlib import Path
from typing import Any

FINGERS = ("thumb", "first", "second", "third")
COUNTS = (2, 3, 4, 2)
MOUNTS = (("0 -0.05 0.01", -90), ("0.016 0.05 0.01", 90), ("0 0.05 0.01", 90), ("-0.016 0.05 0.01", 90))


def finger_mjcf(name: str, count: int, mount: str, turn: int, joint_offset: str, extra: str = "") -> str:
    """A chain of 90 mm that stands up from the palm and closes with positive angles."""
    length = 0.09 / count
    chain = f'<site name="{name}_pad" pos="{length} 0 0" size="0.006" zaxis="0.3 0 1"/>'
    for number in reversed(range(count)):
        place = f'pos="{length} 0 0"' if number else 'axisangle="0 -1 0 80"'
        chain = (
            f'<body name="{name}_{number}" {place}>'
            f'<joint name="{name}_{number}" axis="0 -1 0" range="-30 60" pos="{joint_offset}" {extra}/>'
            f'<geom name="{name}_{number}" type="capsule" fromto="0 0 0 {length} 0 0" size="0.006"/>{chain}</body>'
        )
    return f'<body name="{name}_mount" pos="{mount}" axisangle="0 0 1 {turn}">{chain}</body>'


def hand_mjcf(counts: tuple[int, ...] = COUNTS, joint_offset: str = "0 0 0", extra: str = "", after: str = "") -> str:
    """The model; ``extra`` are attributes of every joint, ``after`` comes behind the world."""
    fingers = "".join(
        finger_mjcf(name, count, *mount, joint_offset, extra)
        for name, count, mount in zip(FINGERS, counts, MOUNTS, strict=True)
    )
    return (
        '<mujoco><compiler angle="degree" autolimits="true"/><worldbody><body name="palm" pos="0.2 0 0.1">'
        f'<geom name="plate" type="box" size="0.055 0.06 0.01"/>{fingers}</body></worldbody>{after}</mujoco>'
    )


def description(counts: tuple[int, ...] = COUNTS, drivers: list[str] | None = None) -> dict[str, Any]:
    """Its description, with 0.5 N m for every driver; all joints are drivers where none are given."""
    joints = [f"{name}_{j}" for name, count in zip(FINGERS, counts, strict=True) for j in range(count)]
    drivers = joints if drivers is None else drivers
    return {
        "title": "Four fingers",
        "model": "hand.xml",
        "palm": "palm",
        "fingers": [{"name": name, "pads": [{"site": f"{name}_pad"}]} for name in FINGERS],
        "torque_limits": dict.fromkeys(drivers, 0.5),
        "grips": [
            {
                "jaws": [["first", "second", "third"], ["thumb"]],
                "jaw_axis": [0.0, 1.0, 0.0],
                "approach_axis": [0.0, 0.0, 1.0],
                "center": [0.0, 0.0],
                "standoff": [0.05, 0.11],
                "opening": [0.0, 0.12],
                "preshapes": [dict.fromkeys(drivers, 0.1)],
            }
        ],
    }


def to_toml(value: Any) -> str:
    """TOML of plain data; tables become inline tables, which TOML allows in lists."""
    lines = "\n".join(f"{key} = {_inline(item)}" for key, item in value.items())
    assert tomllib.loads(lines) == value
    return lines


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def write_hand(folder: Path, mjcf: str, described: dict[str, Any]) -> Path:
    """The folder, with model and description in it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / described["model"]).write_text(mjcf)
    (folder / "hand.toml").write_text(to_toml(described))
    return folder
