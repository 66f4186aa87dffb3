"""Provenance: a picture's header holds the scene and the settings that made it, and gives them back."""
