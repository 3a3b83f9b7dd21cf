"""Palm and fingers of a model that nobody has described: where its chains of joints branch and end."""

import re
from dataclasses import dataclass
from typing import Any

import mujoco

from fingersplit.errors import HandError

__all__ = ["FingerBodies", "find_fingers", "find_palm"]


@dataclass(frozen=True)
class FingerBodies:
    """A finger: a name made of its joints', and its last moving body."""

    name: str
    tip: str


def find_palm(model: Any) -> str:
    """The last body before the chains of joints branch, and what is rigidly joined to it from above.

    Raises:
        HandError: The model has no three chains of joints.
    """
    children = _children(model)
    body = 0
    while True:
        moving = [child for child in children[body] if _moves(model, children, child)]
        if len(moving) != 1:
            break
        body = moving[0]
    if len(moving) < 2:
        raise HandError("The model has fewer than two chains of joints; a hand has at least three fingers.")
    while body != 0 and not model.body_jntnum[body] and model.body_parentid[body] != 0:
        body = int(model.body_parentid[body])
    return "world" if body == 0 else str(model.body(body).name) or f"body{body}"


def find_fingers(model: Any, palm: str, wanted: tuple[str, ...] = ()) -> tuple[FingerBodies, ...]:
    """Fingers below a palm: a chain for each moving body that carries no other moving body.

    Args:
        model: Compiled model.
        palm: Name of the palm's body.
        wanted: Names of bodies at the fingers' ends, where a person knows better.

    Raises:
        HandError: A name that is no body, or fewer than three fingers.
    """
    children = _children(model)
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, palm)
    if root < 0:
        known = ", ".join(model.body(b).name for b in range(model.nbody))
        raise HandError(f"The model has no body {palm!r}; its bodies: {known}.")
    if wanted:
        tips = []
        for name in wanted:
            body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
            if body < 0:
                raise HandError(f"The model has no body {name!r} at the end of a finger.")
            tips.append(body)
    else:
        tips = [b for b in _below(children, root) if model.body_jntnum[b] and not _carries_moving(model, children, b)]
    if len(tips) < 3:
        raise HandError(
            f"Below {palm!r} there are {len(tips)} chains of joints; three are needed. Is that the palm? See --palm."
        )
    names = _names(model, root, tips)
    return tuple(FingerBodies(name, str(model.body(tip).name)) for name, tip in zip(names, tips, strict=True))


def _children(model: Any) -> list[list[int]]:
    children: list[list[int]] = [[] for _ in range(model.nbody)]
    for body in range(1, model.nbody):
        children[int(model.body_parentid[body])].append(body)
    return children


def _below(children: list[list[int]], body: int) -> list[int]:
    return [each for child in children[body] for each in (child, *_below(children, child))]


def _moves(model: Any, children: list[list[int]], body: int) -> bool:
    return bool(model.body_jntnum[body]) or any(_moves(model, children, child) for child in children[body])


def _carries_moving(model: Any, children: list[list[int]], body: int) -> bool:
    return any(_moves(model, children, child) for child in children[body])


def _names(model: Any, root: int, tips: list[int]) -> list[str]:
    """What the joints of a finger have in common in their names, without what all fingers share."""
    groups = []
    for tip in tips:
        joints, body = [], tip
        while body != root and body != 0:
            first = model.body_jntadr[body]
            joints += [str(model.joint(j).name) for j in range(first, first + model.body_jntnum[body])]
            body = int(model.body_parentid[body])
        groups.append(joints)
    shared = _common([name for group in groups for name in group])
    names = [_plain(_common(group)[len(shared) :]) for group in groups]
    if "" in names or len(set(names)) < len(names):
        bodies = [str(model.body(tip).name) for tip in tips]
        shared = _common(bodies)
        names = [_plain(name[len(shared) :]) for name in bodies]
    if "" in names or len(set(names)) < len(names):
        names = [f"finger{k + 1}" for k in range(len(tips))]
    return names


def _plain(name: str) -> str:
    name = re.sub(r"[\W_]+", "_", name).strip("_")
    name = re.sub(r"_?(joint|link|j|q)$", "", name, flags=re.IGNORECASE)
    return f"finger{name}" if name.isdigit() else name


def _common(names: list[str]) -> str:
    """The characters that all names begin with."""
    shortest = min(names, key=len)
    same = (all(name[i] == c for name in names) for i, c in enumerate(shortest))
    return shortest[: next((i for i, equal in enumerate(same) if not equal), len(shortest))]
