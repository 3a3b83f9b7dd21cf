"""Hands written by the tests as URDF, as makers publish them: mimic joints, efforts, inertias that are not physical."""

from pathlib import Path

LINK = (
    '<link name="{name}"><inertial><mass value="0.03"/><origin xyz="{half} 0 0"/>'
    '<inertia ixx="1e-9" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><origin xyz="{half} 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="{radius}" length="{length}"/>'
    "</geometry></collision>"
    '<collision><origin xyz="{length} 0 0"/><geometry><sphere radius="{radius}"/></geometry></collision></link>'
)
JOINT = (
    '<joint name="{name}_joint" type="revolute"><parent link="{parent}"/><child link="{name}"/>'
    '<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
    '<limit lower="{lower}" upper="{upper}" effort="1.2" velocity="3"/>{mimic}</joint>'
)


def _link(name: str, length: float, radius: float = 0.008) -> str:
    return LINK.format(name=name, half=length / 2, length=length, radius=radius)


def _joint(name: str, parent: str, xyz: str, rpy: str = "0 0 0", **more: str | float) -> str:
    values = {"axis": "0 -1 0", "lower": 0.0, "upper": 1.6, "mimic": ""} | more
    return JOINT.format(name=name, parent=parent, xyz=xyz, rpy=rpy, **values)


def _mimic(driver: str, ratio: float, offset: float = 0.0) -> str:
    return f'<mimic joint="{driver}_joint" multiplier="{ratio}" offset="{offset}"/>'


def _finger(name: str, xyz: str, turn: float, mimic: tuple[float, float] | None, lengths: tuple[float, float]) -> str:
    """Two links that stand up from the palm, lean outwards by 0.35 rad and close with positive angles."""
    near, far = f"{name}_near", f"{name}_far"
    follows = {} if mimic is None else {"mimic": _mimic(near, *mimic)}
    return (
        _link(near, lengths[0])
        + _joint(near, "palm", xyz, f"0 -1.22 {turn}", lower=-0.2, upper=1.5)
        + _link(far, lengths[1])
        + _joint(far, near, f"{lengths[0]} 0 0", lower=-0.2, upper=1.8, **follows)
    )


def _robot(name: str, palm: str, parts: str) -> str:
    box = (
        f'<link name="palm"><inertial><mass value="0.4"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" '
        f'iyz="0"/></inertial><collision><geometry><box size="{palm}"/></geometry></collision></link>'
    )
    wrist = '<link name="wrist"/><joint name="mount" type="fixed"><parent link="wrist"/><child link="palm"/></joint>'
    return f'<?xml version="1.0"?><robot name="{name}">{wrist}{box}{parts}</robot>'


def three_finger_urdf() -> str:
    """Three fingers with one motor each; every outer joint follows its inner one."""
    fingers = (
        _finger("left", "-0.03 0.045 0.01", 1.5708, (0.5, 0.1), (0.06, 0.05))
        + _finger("right", "0.03 0.045 0.01", 1.5708, (0.5, 0.1), (0.06, 0.05))
        + _finger("single", "0 -0.045 0.01", -1.5708, (0.5, 0.1), (0.06, 0.05))
    )
    return _robot("three", "0.1 0.1 0.02", fingers)


URDF_HANDS = {"three": three_finger_urdf}


def write_urdf(folder: Path, name: str) -> Path:
    """The URDF of that name in a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.urdf"
    path.write_text(URDF_HANDS[name]())
    return path
