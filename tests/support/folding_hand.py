"""A hand with parallel fingers and a thumb that face each other only where they fold down towards the palm."""

from pathlib import Path

PLACES = {"index": (-0.025, 0.03, 0), "middle": (0, 0.03, 0), "ring": (0.025, 0.03, 0), "thumb": (0, -0.035, 180)}
LENGTHS = {"mcp": 0.045, "pip": 0.03, "dip": 0.02}


def folding_hand_mjcf() -> str:
    """MJCF: three joints a finger, of which the last follows the one before; sideways joints at the fingers' roots."""
    fingers = "".join(_finger(name, *place) for name, place in PLACES.items())
    follow = "".join(f'<joint joint1="{name}_dip" joint2="{name}_pip"/>' for name in PLACES)
    motors = "".join(
        f'<motor joint="{name}_{joint}" forcerange="-1 1"/>' for name in PLACES for joint in ("side", "mcp", "pip")
    )
    return (
        '<mujoco><compiler angle="degree" autolimits="true"/><default><geom type="capsule" size="0.007"/></default>'
        '<worldbody><body name="palm"><geom type="box" size="0.045 0.04 0.04" pos="0 0 0.01"/>'
        f"{fingers}</body></worldbody><equality>{follow}</equality><actuator>{motors}</actuator></mujoco>"
    )


def _finger(name: str, x: float, y: float, turn: float) -> str:
    chain = ""
    for joint, length in reversed(LENGTHS.items()):
        place = 'pos="0 0 0"' if joint == "mcp" else f'pos="0 0 {LENGTHS["mcp" if joint == "pip" else "pip"]}"'
        chain = (
            f'<body name="{name}_{joint}" {place}><joint name="{name}_{joint}" axis="1 0 0" range="-5 95"/>'
            f'<geom fromto="0 0 0.012 0 0 {length}"/>{chain}</body>'
        )
    return (
        f'<body name="{name}_root" pos="{x} {y} 0.05" euler="0 0 {turn}">'
        f'<joint name="{name}_side" axis="0 1 0" range="-15 15"/><geom size="0.006" fromto="0 0 0 0 0 0.012"/>'
        f"{chain}</body>"
    )


def write_folding_hand(folder: Path) -> Path:
    """The model in a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "hand.xml").write_text(folding_hand_mjcf())
    return folder / "hand.xml"
