"""Which joints motors turn and how the others follow: URDF mimic, MJCF equalities and fixed tendons to S and q0."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.description import HandDescription
from fingersplit.hands.model import Coupling
from fingersplit.hands.tree import Tree

__all__ = ["read_coupling"]

MAX_DEVIATION = 0.05
"""[rad]; a polynomial coupling farther than this from a straight line is refused."""


@dataclass(frozen=True)
class _Row:
    """angle of a driven joint = sum of ratios * other joints + offset; joints by their index."""

    ratios: dict[int, float]
    offset: float
    source: str


def read_coupling(model: Any, tree: Tree, description: HandDescription) -> tuple[Coupling, list[str]]:
    """Drivers, S, q0, limits and torques of a hand, and notes about what was approximated.

    A driven joint's limits count for its driver. A driver's torque limit is the description's, else what the model's
    actuators can do at it (through every joint that follows it), else the joint's own.

    Raises:
        HandError: A coupling that no kernel computes, a joint that nothing drives, or a torque that nobody gives.
    """
    notes: list[str] = []
    moments = _actuator_moments(model, tree)
    rows = _model_rows(model, tree, moments, notes)
    names = [joint.name for joint in tree.joints]
    for name, coupling in description.couplings.items():
        joint, driver = _index(names, name, "[couplings]"), _index(names, coupling.driver, f"[couplings] {name}")
        if joint in rows:
            notes.append(f"The description's coupling of {name} takes the place of the model's {rows[joint].source}.")
        rows[joint] = _Row({driver: coupling.ratio}, coupling.offset, "description")
    _refuse_loops(model, tree, description, notes)
    drivers = [j for j in range(len(names)) if j not in rows]
    matrix, offset = _resolve(rows, drivers, names)
    _refuse_undriven(model, tree, description, drivers, moments @ matrix if len(moments) else None, notes)
    lower, upper = _driver_limits(tree, drivers, matrix, offset, notes)
    torques = _torque_limits(model, tree, description, drivers, moments, matrix)
    return Coupling(tuple(names[j] for j in drivers), matrix, offset, lower, upper, torques), notes


def _index(names: list[str], name: str, table: str) -> int:
    if name not in names:
        raise HandError(f"{table} names the joint {name!r}; the hand's joints are {', '.join(names)}.")
    return names.index(name)


def _actuator_moments(model: Any, tree: Tree) -> NDArray[np.float64]:
    """Torque on every joint by unit force of every actuator, (n_actuators, N)."""
    moments = np.zeros((model.nu, len(tree.joints)))
    for u in range(model.nu):
        target, gear = int(model.actuator_trnid[u, 0]), float(model.actuator_gear[u, 0])
        kind = mujoco.mjtTrn(int(model.actuator_trntype[u]))
        if kind in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
            if target in tree.joint_of_id:
                moments[u, tree.joint_of_id[target]] = gear
        elif kind == mujoco.mjtTrn.mjTRN_TENDON:
            for joint, coefficient in _fixed_tendon(model, target).items():
                if joint in tree.joint_of_id:
                    moments[u, tree.joint_of_id[joint]] += gear * coefficient
    return moments


def _fixed_tendon(model: Any, tendon: int) -> dict[int, float]:
    """Coefficients of a fixed tendon by joint id; empty for a spatial one."""
    first, count = model.tendon_adr[tendon], model.tendon_num[tendon]
    wraps = range(first, first + count)
    if any(model.wrap_type[i] != mujoco.mjtWrap.mjWRAP_JOINT for i in wraps):
        return {}
    return {int(model.wrap_objid[i]): float(model.wrap_prm[i]) for i in wraps}


def _model_rows(model: Any, tree: Tree, moments: NDArray[np.float64], notes: list[str]) -> dict[int, _Row]:
    rows: dict[int, _Row] = {}
    for e in range(model.neq):
        if not model.eq_active0[e]:
            continue
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT:
            _add_joint_equality(model, tree, e, rows, notes)
        elif model.eq_type[e] == mujoco.mjtEq.mjEQ_TENDON:
            _add_tendon_equality(model, tree, e, rows)
    for u in range(model.nu):
        moved = [int(j) for j in np.flatnonzero(moments[u])]
        alone = [j for j in moved if not any(moments[v, j] for v in range(model.nu) if v != u) and j not in rows]
        if len(alone) < 2:
            continue
        first = alone[0]
        for j in alone[1:]:  # with equal give, each joint takes its share of the tendon's length
            rows[j] = _Row({first: moments[u, j] / moments[u, first]}, 0.0, f"tendon of {model.actuator(u).name!r}")
            notes.append(
                f"One tendon moves {tree.joints[first].name} and {tree.joints[j].name}; they are taken to share it."
            )
    return rows


def _add_joint_equality(model: Any, tree: Tree, e: int, rows: dict[int, _Row], notes: list[str]) -> None:
    driven, driver = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    if driven not in tree.joint_of_id:
        return
    joint, c = tree.joints[tree.joint_of_id[driven]], model.eq_data[e, :5]
    if driver < 0:
        rows[tree.joint_of_id[driven]] = _Row({}, joint.reference + float(c[0]), "equality")
        return
    if driver not in tree.joint_of_id:
        angle = tree.angles[driver] - float(model.qpos0[model.jnt_qposadr[driver]])
        rows[tree.joint_of_id[driven]] = _Row({}, joint.reference + float(np.polyval(c[::-1], angle)), "equality")
        return
    other = tree.joints[tree.joint_of_id[driver]]
    offset, ratio = float(c[0]), float(c[1])
    if np.any(c[2:] != 0):
        angles = np.linspace(other.lower, other.upper, 201) - other.reference
        ratio, offset = np.polyfit(angles, np.polyval(c[::-1], angles), 1)
        deviation = float(np.abs(np.polyval(c[::-1], angles) - (ratio * angles + offset)).max())
        if deviation > MAX_DEVIATION:
            raise HandError(
                f"{joint.name} follows {other.name} by a polynomial {deviation:.2f} rad from any straight line; "
                f"at most {MAX_DEVIATION} rad are approximated. Give a line over the range you use under [couplings]."
            )
        notes.append(f"{joint.name} follows {other.name} by a polynomial; a line is within {deviation:.3f} rad of it.")
    constant = joint.reference + offset - ratio * other.reference
    rows[tree.joint_of_id[driven]] = _Row({tree.joint_of_id[driver]: ratio}, constant, "equality")


def _add_tendon_equality(model: Any, tree: Tree, e: int, rows: dict[int, _Row]) -> None:
    """length1 = c0 + c1 * length2, solved for the last joint that has no row yet."""
    c, one, two = model.eq_data[e, :5], int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    if np.any(c[2:] != 0):
        raise HandError(f"Tendon {model.tendon(one).name!r} is held by a polynomial; only lines are planned for.")
    sums = dict(_fixed_tendon(model, one))
    constant = float(c[0]) + float(model.tendon_length0[one])
    if two >= 0:
        constant -= float(c[1]) * float(model.tendon_length0[two])
        for joint, coefficient in _fixed_tendon(model, two).items():
            sums[joint] = sums.get(joint, 0.0) - float(c[1]) * coefficient
    if not sums:
        raise HandError(
            f"Tendon {model.tendon(one).name!r} of an equality is no fixed tendon; give [couplings] instead."
        )
    inside = {tree.joint_of_id[j]: k for j, k in sums.items() if j in tree.joint_of_id and k != 0.0}
    constant -= sum(k * tree.angles[j] for j, k in sums.items() if j not in tree.joint_of_id)
    free = [j for j in inside if j not in rows]
    if not free:
        return
    driven = max(free)
    ratios = {j: -k / inside[driven] for j, k in inside.items() if j != driven}
    rows[driven] = _Row(ratios, constant / inside[driven], "tendon equality")


def _refuse_loops(model: Any, tree: Tree, description: HandDescription, notes: list[str]) -> None:
    """A closed loop is only planned for where the description says how its passive joints follow."""
    told = set(description.couplings) | set(description.fixed)
    for e in range(model.neq):
        kind = mujoco.mjtEq(int(model.eq_type[e]))
        if kind not in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD) or not model.eq_active0[e]:
            continue
        ends = [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
        if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE:
            ends = [int(model.site_bodyid[site]) for site in ends]
        if not any(body in tree.link_of_body for body in ends):
            continue
        names = [model.body(body).name for body in ends]
        if not told:
            raise HandError(
                f"{names[0]!r} and {names[1]!r} close a loop. Loops are not solved: say under [couplings] how passive "
                "joints follow driven ones (ratio and offset), or fix them under [fixed]."
            )
        notes.append(f"The loop of {names[0]} and {names[1]} is left to the description's couplings.")


def _resolve(
    rows: dict[int, _Row], drivers: list[int], names: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """S and q0 by putting rows into each other."""
    matrix, offset = np.zeros((len(names), len(drivers))), np.zeros(len(names))
    for column, j in enumerate(drivers):
        matrix[j, column] = 1.0
    done = set(drivers)
    while len(done) < len(names):
        ready = [j for j in rows if j not in done and set(rows[j].ratios) <= done]
        if not ready:
            circle = ", ".join(names[j] for j in rows if j not in done)
            raise HandError(f"The couplings of {circle} go round in a circle; one of these joints must be a driver.")
        for j in ready:
            offset[j] = rows[j].offset
            for other, ratio in rows[j].ratios.items():
                matrix[j] += ratio * matrix[other]
                offset[j] += ratio * offset[other]
            done.add(j)
    return matrix, offset


def _refuse_undriven(
    model: Any,
    tree: Tree,
    description: HandDescription,
    drivers: list[int],
    reached: NDArray[np.float64] | None,
    notes: list[str],
) -> None:
    """Where a model has actuators, a joint without one is passive: nothing decides where it stands."""
    sprung = {tree.joint_of_id[j] for j in tree.joint_of_id if model.jnt_stiffness[j] > 0}
    for column, j in enumerate(drivers):
        name = tree.joints[j].name
        driven = reached is None or not reached.any() or bool(np.any(reached[:, column]))
        if driven or name in description.torque_limits:
            if j in sprung:
                notes.append(f"The spring of {name} is left out.")
            continue
        held = "held by a spring only" if j in sprung else "moved by no actuator"
        raise HandError(
            f"Joint {name!r} is {held}. Say under [couplings] how it follows another joint, fix it under [fixed], "
            "or, if a motor turns it, give its torque under [torque_limits]."
        )


def _driver_limits(
    tree: Tree, drivers: list[int], matrix: NDArray[np.float64], offset: NDArray[np.float64], notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Limits of drivers, narrowed by every joint that follows one driver alone."""
    lower = np.array([tree.joints[j].lower for j in drivers])
    upper = np.array([tree.joints[j].upper for j in drivers])
    for j, joint in enumerate(tree.joints):
        (columns,) = np.nonzero(matrix[j])
        if j in drivers or len(columns) != 1:
            if len(columns) == 0 and not joint.lower - 1e-6 <= offset[j] <= joint.upper + 1e-6:
                raise HandError(f"Joint {joint.name!r} is held at {offset[j]:.3f} rad, outside its own limits.")
            continue
        c = columns[0]
        ends = sorted((limit - offset[j]) / matrix[j, c] for limit in (joint.lower, joint.upper))
        narrowed = max(lower[c], ends[0]), min(upper[c], ends[1])
        driver = tree.joints[drivers[c]].name
        if not narrowed[0] < narrowed[1]:
            raise HandError(
                f"{joint.name} = {matrix[j, c]:.4g} {driver} {offset[j]:+.4g} leaves its own limits "
                f"[{joint.lower:.3g}, {joint.upper:.3g}] wherever {driver} stands: its sign or offset is wrong."
            )
        if narrowed[1] - narrowed[0] < 0.999 * (upper[c] - lower[c]):
            notes.append(f"{driver} goes from {narrowed[0]:.3f} to {narrowed[1]:.3f} rad, as far as {joint.name} goes.")
        lower[c], upper[c] = narrowed
    return lower, upper


def _torque_limits(
    model: Any,
    tree: Tree,
    description: HandDescription,
    drivers: list[int],
    moments: NDArray[np.float64],
    matrix: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Largest torque at each driver towards larger and towards smaller angles, (2, A) [N m].

    Power is the same at driver and joints, so it is the sum over what follows.
    """
    names = [tree.joints[j].name for j in drivers]
    for name in description.torque_limits:
        if name not in names:
            raise HandError(f"[torque_limits] names {name!r}; the hand's drivers are {', '.join(names)}.")
    forces = np.zeros((2, model.nu))
    for u in range(model.nu):
        if model.actuator_forcelimited[u]:
            forces[:, u] = _both_ways(model.actuator_forcerange[u])
        elif model.actuator_ctrllimited[u] and model.actuator_biastype[u] == mujoco.mjtBias.mjBIAS_NONE:
            gain = float(model.actuator_gainprm[u, 0])
            forces[:, u] = _both_ways(np.sort(gain * model.actuator_ctrlrange[u]))
    moved = moments @ matrix if model.nu else np.zeros((0, len(drivers)))
    forwards, backwards = np.maximum(moved, 0.0), np.maximum(-moved, 0.0)
    by_actuator = forces @ forwards + forces[::-1] @ backwards
    own = {
        tree.joint_of_id[j]: _both_ways(model.jnt_actfrcrange[j])
        for j in tree.joint_of_id
        if model.jnt_actfrclimited[j]
    }
    torques = np.zeros((2, len(drivers)))
    for column, (name, j) in enumerate(zip(names, drivers, strict=True)):
        limit = description.torque_limits.get(name)
        found = by_actuator[:, column] if by_actuator[:, column].all() else own.get(j, np.zeros(2))
        torques[:, column] = found if limit is None else limit
    missing = [name for name, torque in zip(names, torques.T, strict=True) if torque.min() <= 0]
    if missing:
        raise HandError(f"No torque limit is known for {', '.join(missing)}; give them in N m under [torque_limits].")
    return torques


def _both_ways(limits: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a range from low to high: how far it goes up and how far down from zero, (2,)."""
    return np.maximum([limits[1], -limits[0]], 0.0)
