"""Output of commands: picture files with annotation and metadata, and sequences of pictures."""
