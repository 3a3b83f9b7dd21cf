"""Fingersplit."""
