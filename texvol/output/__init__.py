"""Output of commands: pictures as their options ask for them, and sequences of pictures."""
