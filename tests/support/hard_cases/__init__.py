"""Hard cases: scenes that renderers get wrong, each with a bound of its error."""
