"""Code that several ray casters share."""
