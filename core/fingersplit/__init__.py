"""Grasp planning for multi-fingered hands by finger splitting; ``planning.plan`` is the whole way."""
