"""Ends of a run have names for programs and advice for people."""

from fingersplit.splitting.termination import Termination


def test_every_termination_has_a_name_and_advice():
    labels = [end.label for end in Termination]
    assert labels == [
        "converged",
        "stopped_by_collision",
        "stopped_by_pad_angle",
        "iteration_limit",
        "contact_off_surface",
        "pad_angle_violated",
        "in_collision",
        "joint_limit_violated",
        "stopped_by_obstacle",
        "stopped_by_region",
        "near_obstacle",
        "outside_workspace",
        "outside_region",
        "no_free_approach",
        "no_free_retreat",
        "in_self_collision",
    ]
    advice = {end.advice for end in Termination}
    assert len(advice) == len(labels)
    assert all(sentence[0].isupper() and sentence.endswith(".") for sentence in advice)
