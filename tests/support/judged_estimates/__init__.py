"""Random scenes of every classification and mode, by which the three ways to know an error are judged."""
