"""Ray casting of one volume with light, a depth cue or a medium that depends on the gradient."""
