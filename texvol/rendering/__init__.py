"""Rendering: the method on one screen (`render`), the Renderer that keeps what pictures share, and error control."""
