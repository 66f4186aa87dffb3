"""Ray casting of one volume without light: every piece of a ray is a polynomial, and is integrated as one."""
