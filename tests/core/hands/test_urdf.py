"""URDF files that MuJoCo would read as something else than they say."""

import pytest

from fingersplit.errors import HandError
from fingersplit.hands.urdf import rewrite_urdf
from urdf_hands import write_urdf


@pytest.mark.parametrize("driver", ["left_nearer_joint", "mount"])
def test_a_joint_that_mimics_no_moving_one_is_refused(tmp_path, driver):
    model = write_urdf(tmp_path, "three")
    model.write_text(model.read_text().replace('<mimic joint="left_near_joint"', f'<mimic joint="{driver}"'))
    with pytest.raises(HandError, match=f"left_far_joint' mimics '{driver}'.* right_near_joint"):
        rewrite_urdf(model, tmp_path)


def test_joints_that_mimic_moving_ones_are_left_as_they_are(tmp_path):
    model = write_urdf(tmp_path, "three")
    assert rewrite_urdf(model, tmp_path)[0].count("<mimic ") == 3
