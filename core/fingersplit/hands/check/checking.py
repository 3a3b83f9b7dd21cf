"""The report about a hand, as plain data and as lines of text."""

from typing import Any

import numpy as np

from fingersplit.hands.check import measures
from fingersplit.hands.draft.sampling import sample_postures
from fingersplit.hands.hand import Hand
from fingersplit.hands.limits import MAX_SHAPES

__all__ = ["check_hand", "report_lines", "torque_text"]

POSTURES, COMPARED, DIFFERENCES, SEED = 20_000, 200, 10, 7
"""Random postures for reach, for the comparison with MuJoCo, for differences, and their seed."""

MAX_KINEMATICS_ERROR, MAX_JACOBIAN_ERROR = 1e-9, 1e-6
"""[m], [m/rad]."""
MIN_VOLUME = 5e-6
"""[m^3]; less room for jaw centres is hardly a hand."""
MAX_OVERHANG = 0.01
"""[m]; a fitted shape that reaches farther beyond its link keeps the hand away from objects."""
MAX_PAD_ANGLE = 0.9
"""[rad]; a pad that looks farther aside at a preshape does not oppose the other jaw."""


def check_hand(hand: Hand) -> dict[str, Any]:
    """What a description makes of a hand, for every grip; ``advice`` says what to change where a number is bad.

    Returns:
        Plain JSON data: lengths [m], angles [rad], torques [N m].
    """
    rng = np.random.default_rng(SEED)
    samples = sample_postures(hand.model, POSTURES, rng)
    compared = sample_postures(hand.model, COMPARED, rng)
    few = sample_postures(hand.model, DIFFERENCES, rng)
    coupling = hand.model.coupling
    grips = [
        {
            "jaws": [
                [f.name for f, g in zip(grip.fingers, grip.gripper.groups, strict=True) if g == jaw] for jaw in (0, 1)
            ],
            "drivers": list(grip.driver_names),
            "reach": measures.reaches(grip, samples),
            "opposition": measures.opposition_volume(grip, samples),
            "kinematics_error": measures.kinematics_error(grip, compared),
            "jacobian_error": measures.jacobian_error(grip, few),
            "self_collision": measures.self_collisions(grip),
            "pads": measures.pads_in_jaws(grip),
        }
        for grip in hand.grips
    ]
    report: dict[str, Any] = {
        "name": hand.name,
        "title": hand.title,
        "sha256": hand.sha256,
        "drafted": hand.description.drafted,
        "joints": [{"name": j.name, "lower": j.lower, "upper": j.upper} for j in hand.model.joints],
        "drivers": [
            {"name": name, "lower": low, "upper": high, "torque": up, "torque_backwards": down}
            for name, low, high, up, down in zip(
                coupling.drivers,
                coupling.lower.tolist(),
                coupling.upper.tolist(),
                *coupling.torque_ranges.tolist(),
                strict=True,
            )
        ],
        "motors": hand.model.motors,
        "couplings": measures.couplings(hand),
        "shapes": [
            {"name": s.name, "link": hand.model.links[s.link].name, "overhang": s.overhang, "sources": list(s.sources)}
            for s in hand.model.shapes
        ],
        "grips": grips,
        "notes": list(hand.model.notes),
    }
    report["advice"] = _advice(report)
    return report


def _advice(report: dict[str, Any]) -> list[str]:
    advice = []
    if report["drafted"]:
        advice.append("Nobody has looked at this draft: correct hand.toml and delete `drafted = true`.")
        if not report["motors"] and not report["couplings"]:
            advice.append(
                f"The model names no motors, so each of the {len(report['joints'])} joints has one of its own. Where a "
                "motor turns several joints, write so under [couplings]; joints that never move belong under [fixed]."
            )
    beyond: dict[str, float] = {}
    for shape in report["shapes"]:
        if shape["overhang"] > MAX_OVERHANG:
            beyond[shape["link"]] = max(beyond.get(shape["link"], 0.0), shape["overhang"])
    if beyond:
        links = ", ".join(f"{link} ({1e3 * reach:.0f} mm)" for link, reach in beyond.items())
        more = ", or raise `budget` under [shapes]" if len(report["shapes"]) < MAX_SHAPES else ""
        advice.append(
            f"Shapes fitted to meshes reach beyond them and keep the hand from objects there: {links}. Give the model "
            f"primitives on these links{more}."
        )
    for number, grip in enumerate(report["grips"], 1):
        advice += [f"Grip {number}: {text}" for text in _advice_of_grip(grip)]
    return advice


def _advice_of_grip(grip: dict[str, Any]) -> list[str]:
    advice = []
    if grip["kinematics_error"] > MAX_KINEMATICS_ERROR or grip["jacobian_error"] > MAX_JACOBIAN_ERROR:
        advice.append(
            "kinematics differ from MuJoCo's; that is a fault of this program, please report it with the model."
        )
    if grip["opposition"]["volume"] < MIN_VOLUME:
        advice.append("the jaws hardly face each other anywhere: look at jaw_axis and at the pads' normals.")
    for pads in grip["pads"]:
        advice += [
            f"the pads of jaw {jaw} look {angle:.2f} rad aside at preshape {pads['preshape']}: change one of them."
            for jaw, angle in enumerate(pads["angles"])
            if angle > MAX_PAD_ANGLE
        ]
    advice += [
        f"{pair['shapes'][0]} and {pair['shapes'][1]} overlap by {-1e3 * pair['distance']:.1f} mm at preshape "
        f"{pair['preshape']}: change the preshape, or park the finger elsewhere."
        for pair in grip["self_collision"]
        if pair["distance"] < 0
    ]
    return advice


def report_lines(report: dict[str, Any]) -> list[str]:
    """The report as text, a line for each number."""
    lines = [f"{report['title']} ({report['name']}, {report['sha256'][:12]})"]
    lines.append(f"{len(report['joints'])} joints, {len(report['drivers'])} drivers")
    lines += [
        f"  {driver['name']}: {driver['lower']:.3f} to {driver['upper']:.3f} rad, {torque_text(driver)} N m"
        for driver in report["drivers"]
    ]
    for coupling in report["couplings"]:
        terms = " ".join(f"{ratio:+.4g} {name}" for name, ratio in coupling["ratios"].items())
        lines.append(
            f"  {coupling['joint']} = {terms} {coupling['offset']:+.4g}; half-way {coupling['half_way']:.3f} rad"
        )
    worst = max(report["shapes"], key=lambda shape: float(shape["overhang"]))
    lines.append(
        f"{len(report['shapes'])} collision shapes; {worst['name']} reaches {1e3 * worst['overhang']:.1f} mm beyond"
    )
    for number, grip in enumerate(report["grips"], 1):
        lines += _grip_lines(number, grip)
        for trial in report.get("trial", []):
            if trial["jaws"] == grip["jaws"]:
                ends = ", ".join(f"{name} {count}" for name, count in trial["terminations"].items())
                lines.append(f"  {trial['object']}: {trial['feasible']} of {trial['starts']} feasible ({ends})")
                lines += [f"    {advice}" for advice in trial["advice"]]
    lines += [f"note: {note}" for note in report["notes"]]
    lines += [f"change: {text}" for text in report["advice"]] or ["Nothing to change."]
    return lines


def torque_text(driver: dict[str, Any]) -> str:
    """Largest torque of a driver of a report, and from backwards to forwards where these differ."""
    forwards, backwards = driver["torque"], driver["torque_backwards"]
    return f"{forwards:g}" if forwards == backwards else f"{-backwards:g} to {forwards:g}"


def _grip_lines(number: int, grip: dict[str, Any]) -> list[str]:
    jaws = " | ".join(", ".join(jaw) for jaw in grip["jaws"])
    opposition = grip["opposition"]
    openings = opposition["openings"]
    span = f"{1e3 * openings[0]:.0f} to {1e3 * openings[1]:.0f} mm" if openings else "none"
    lines = [
        f"grip {number}: {jaws}",
        f"  jaws face each other in {1e6 * opposition['volume']:.0f} cm^3, openings {span}",
        f"  within {grip['kinematics_error']:.1e} m of MuJoCo, Jacobians within {grip['jacobian_error']:.1e} m/rad",
    ]
    lines += [
        f"  {reach['finger']}: pad {1e3 * reach['nearest']:.0f} to {1e3 * reach['farthest']:.0f} mm from the palm"
        for reach in grip["reach"]
    ]
    if grip["self_collision"]:
        nearest = min(grip["self_collision"], key=lambda pair: float(pair["distance"]))
        lines.append(
            f"  nearest at the preshapes: {' and '.join(nearest['shapes'])}, {1e3 * nearest['distance']:.1f} mm"
        )
    return lines
