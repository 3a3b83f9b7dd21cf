"""URDF files as found in the wild, rewritten so that MuJoCo reads them: mesh paths, inertias, visual meshes kept."""

import re
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

from fingersplit.errors import HandError

__all__ = ["rewrite_urdf"]

_PREFIX = re.compile(rb"(</?|\s)([\w.-]+):([\w.-]+)(?=[\s=/>])")
"""Of elements and attributes; URDFs use those of other tools without declaring them."""

MOVING = {"revolute", "continuous", "prismatic"}
"""Types of joints that can follow each other."""

MESH_SUFFIXES = {".stl", ".obj", ".msh"}


def rewrite_urdf(model: Path, root: Path) -> tuple[str, list[str]]:
    """The URDF with absolute mesh paths and MuJoCo's compiler told to keep links and visuals apart.

    A mesh is looked for below ``root`` by the longest end of its path that exists there, wherever ``package://`` was
    put. Visual meshes in formats that MuJoCo does not read are left out.

    Returns:
        The XML, and notes about what was left out.

    Raises:
        HandError: A collision mesh that is not there or cannot be read, or a joint that mimics none.
    """
    try:
        robot = ElementTree.fromstring(_PREFIX.sub(rb"\1\2_\3", model.read_bytes()))
    except ElementTree.ParseError as error:
        line, column = error.position
        raise HandError(
            f"{model.name} is not XML: it cannot be read from line {line}, column {column + 1} on."
        ) from error
    if any(str(element.tag).startswith("xacro_") for element in robot.iter()):
        raise HandError(f"{model.name} is a xacro file; expand it first with `xacro {model.name} > hand.urdf`.")
    _check_mimics(robot, model.name)
    files = [path for path in sorted(root.rglob("*")) if path.is_file()]
    notes: list[str] = []
    for link in robot.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            mesh = part.find("geometry/mesh")
            if mesh is None:
                continue
            found = _find(mesh.get("filename", ""), files)
            if found is not None and found.suffix.lower() in MESH_SUFFIXES:
                mesh.set("filename", str(found))
            elif part.tag == "visual":
                link.remove(part)
                notes.append(f"Visual mesh {mesh.get('filename')!r} of {link.get('name')!r} is left out.")
            elif found is None:
                raise HandError(
                    f"{model.name}: mesh {mesh.get('filename')!r} of {link.get('name')!r} is not below {root.name}/."
                )
            else:
                raise HandError(f"{model.name}: mesh {found.name!r} is no STL, OBJ or MSH file; convert it to one.")
    for extension in robot.findall("mujoco"):
        robot.remove(extension)
    extension = ElementTree.SubElement(robot, "mujoco")
    options = {"balanceinertia": "true", "discardvisual": "false", "fusestatic": "false", "strippath": "false"}
    ElementTree.SubElement(extension, "compiler", options)
    return ElementTree.tostring(robot, encoding="unicode"), notes


def _check_mimics(robot: ElementTree.Element, name: str) -> None:
    """Refuse joints that follow what does not move: MuJoCo would leave them with a motor of their own."""
    moving = {joint.get("name") for joint in robot.findall("joint") if joint.get("type") in MOVING}
    for joint in robot.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") in MOVING and mimic.get("joint") not in moving:
            raise HandError(
                f"{name}: joint {joint.get('name')!r} mimics {mimic.get('joint')!r}, which is no moving joint of the "
                f"model; these are {', '.join(sorted(filter(None, moving)))}."
            )


def _find(filename: str, files: list[Path]) -> Path | None:
    """The file whose path shares the longest end with ``filename``; None when not even the name is there."""
    wanted = PurePosixPath(filename.split("://")[-1].replace("\\", "/")).parts
    best, longest = None, 0
    for path in files:
        parts, shared = path.parts, 0
        while shared < min(len(parts), len(wanted)) and parts[-1 - shared] == wanted[-1 - shared]:
            shared += 1
        if shared > longest:
            best, longest = path, shared
    return best
