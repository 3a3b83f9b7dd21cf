"""Whether a hand's description is right: numbers, pictures, and what to change."""

from fingersplit.hands.check.checking import check_hand, report_lines

__all__ = ["check_hand", "report_lines"]
