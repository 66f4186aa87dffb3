"""Measures of a scene: ruler, angle, box and profile, with their values."""
