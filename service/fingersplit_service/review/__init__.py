"""Runs to look at in a browser: pages, pictures, recordings and the viewer of recordings."""
