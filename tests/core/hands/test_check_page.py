"""What `fingersplit hand check` prints and draws."""

import re

import pytest

from fingersplit.hands import load_hand
from fingersplit.hands.check import check_hand, report_lines
from fingersplit.hands.check.page import report_page
from own_hand import description, hand_mjcf, write_hand


@pytest.fixture(scope="module")
def hand(tmp_path_factory):
    return load_hand(write_hand(tmp_path_factory.mktemp("hand") / "own", hand_mjcf(), description()))


@pytest.fixture(scope="module")
def report(hand):
    """With a trial of two grips, of which the second holds nothing."""
    found = check_hand(hand)
    jaws = found["grips"][0]["jaws"]
    found["grips"].append(found["grips"][0] | {"jaws": jaws[::-1]})
    trial = {"object": "sphere of 40 mm", "width": 0.04, "starts": 16, "feasible": 9, "jaws": jaws, "advice": []}
    found["trial"] = [
        trial | {"terminations": {"converged": 9, "in_collision": 7}},
        trial | {"jaws": jaws[::-1], "feasible": 0, "terminations": {"in_collision": 16}, "advice": ["Move <away>."]},
    ]
    return found


def test_trials_stand_below_their_grip_with_the_advice_of_what_failed(report):
    lines = report_lines(report)
    first, second = (lines.index(line) for line in lines if re.match(r"grip \d: ", line))
    assert "  sphere of 40 mm: 9 of 16 feasible (converged 9, in_collision 7)" in lines[first:second]
    failed = lines.index("  sphere of 40 mm: 0 of 16 feasible (in_collision 16)")
    assert failed > second
    assert lines[failed + 1].strip() == "Move <away>."


def test_page_has_a_drawing_a_posture_and_escapes_what_it_says(hand, report):
    page = report_page(hand, report)
    postures = 1 + sum(len(grip.gripper.preshapes) for grip in hand.grips)
    assert page.count("<svg") == 2 * postures
    assert "Move &lt;away&gt;." in page
    assert "<script" not in page
    assert not re.search(r"(src|href)=", page)


def test_drawings_hold_everything_that_they_show(hand, report):
    page = report_page(hand, report)
    for x, y, r in re.findall(r"<circle cx='([-\d.]+)' cy='([-\d.]+)' r='([-\d.]+)'", page):
        assert float(r) - 0.1 <= float(x) <= 260.1 - float(r)
        assert float(r) - 0.1 <= float(y) <= 260.1 - float(r)
    for corners in re.findall(r"points='([^']+)'", page):
        assert all(0 <= float(value) <= 260 for value in re.split("[ ,]", corners))


def test_a_draft_without_motors_is_asked_for_couplings(tmp_path):
    joints = description()
    own = load_hand(write_hand(tmp_path / "own", hand_mjcf(), joints | {"drafted": True}))
    assert any("[couplings]" in text for text in check_hand(own)["advice"])
    motors = "".join(f'<motor joint="{name}" ctrlrange="-1 1"/>' for name in joints["torque_limits"])
    driven = write_hand(
        tmp_path / "driven", hand_mjcf(after=f"<actuator>{motors}</actuator>"), joints | {"drafted": True}
    )
    assert not any("[couplings]" in text for text in check_hand(load_hand(driven))["advice"])
