"""A hand of five fingers written by the tests as MJCF: four of them have one motor each, the thumb has two."""

from pathlib import Path

FINGERS = (
    ("index", "0.03 0.04", 90, 0.045, 0.040),
    ("middle", "0.01 0.04", 90, 0.050, 0.042),
    ("ring", "-0.01 0.04", 90, 0.047, 0.040),
    ("little", "-0.03 0.04", 90, 0.041, 0.037),
    ("thumb", "0.01 -0.045", -90, 0.050, 0.040),
)
FINGER = (
    '<body name="{name}_base" pos="{place} 0.012" axisangle="0 0 1 {turn}">'
    '<body name="{name}_proximal" axisangle="0 -1 0 75"><joint name="{name}_mcp" axis="0 -1 0" range="-10 85"/>'
    '<geom type="capsule" fromto="0.004 0 0 {near} 0 0" size="0.007"/><body name="{name}_distal" pos="{near} 0 0">'
    '<joint name="{name}_pip" axis="0 -1 0" range="-10 100"/>'
    '<geom type="capsule" fromto="0.004 0 0 {far} 0 0" size="0.007"/></body></body></body>'
)
FOLLOWS = '<joint joint1="{name}_pip" joint2="{name}_mcp" polycoef="0.05 0.9 0 0 0"/>'
MOTOR = '<position joint="{joint}" kp="5" forcerange="-1.2 1.2"/>'
RATIO, OFFSET = 0.9, 0.05


def write_five_fingers(folder: Path) -> Path:
    """The model in a folder, which is made; a forearm carries the palm."""
    fingers = "".join(
        FINGER.format(name=name, place=place, turn=turn, near=near, far=far) for name, place, turn, near, far in FINGERS
    )
    names = [name for name, *_ in FINGERS]
    follows = "".join(FOLLOWS.format(name=name) for name in names[:4])
    motors = "".join(MOTOR.format(joint=joint) for joint in [*(f"{name}_mcp" for name in names), "thumb_pip"])
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "five.xml"
    path.write_text(
        '<mujoco><compiler angle="degree" autolimits="true"/><worldbody><body name="forearm">'
        '<geom type="box" size="0.02 0.02 0.03" pos="0 0 -0.06"/><body name="hand">'
        f'<geom type="box" size="0.045 0.045 0.012"/>{fingers}</body></body></worldbody>'
        f"<equality>{follows}</equality><actuator>{motors}</actuator></mujoco>"
    )
    return path
