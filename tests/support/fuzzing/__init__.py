"""Damaged files, and the processes that read them."""
