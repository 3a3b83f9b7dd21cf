"""Proposals for a hand's description, found by moving its model."""

from fingersplit.hands.draft.drafting import draft_folder, draft_hand
from fingersplit.hands.draft.toml_writer import description_to_toml

__all__ = ["description_to_toml", "draft_folder", "draft_hand"]
