"""Ray casting of one volume with light, a depth cue or a medium that depends on the gradient.

Such a medium makes no polynomials. `cuts` cuts a ray wherever the integrand has a kink, by the `roots` of polynomials;
`collocation` integrates each smooth interval in between, and halves it until the parts agree with the whole. `shading`
holds the formulas of light and depth cue at one position, `shadows` the transmittance of each light, `arrays` the scene
as compiled code takes it, `workspace` the scratch memory, `cells` one cell, and `tracer` the walk through all.
"""
