"""Ray casting of one volume without light: every piece of a ray is a polynomial, and is integrated as one.

`tracer` walks a ray from cell to cell. `cells` integrates over one cell: pre-classified, the corners' emission and
extinction are interpolated, so both are cubics along the ray; post-classified, the value is a cubic, which is cut where
it meets a control point of the transfer function.
"""
