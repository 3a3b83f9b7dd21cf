"""Robot hands as data: one folder a hand, with its MJCF and a short description."""

from fingersplit.hands.hand import Finger, Gripper, Hand, available_hands, load_hand

__all__ = ["Finger", "Gripper", "Hand", "available_hands", "load_hand"]
