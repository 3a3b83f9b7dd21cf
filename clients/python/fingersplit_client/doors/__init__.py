"""Doors for other kinds of programs than those in Python."""
