"""Code that several ray casters share: rays, the walk from cell to cell, cells, polynomials, the medium, compilation.

`walk` holds the one loop that takes a ray from cell face to cell face. `cells` interpolates inside one cell, `medium`
integrates emission and absorption over a piece of a ray, `bernstein` holds the polynomials, and `compiling` is the only
module that imports numba.
"""
