// HELD(number): a copy of a uniform for a loop, which stays in registers.
//
// Mesa's software driver fetches a uniform anew wherever it is read, for one pixel of a vector after the other: four
// numbers that a loop over slabs reads take as long as classification does. Numbers that are fetched before the loop
// stay in registers, but the compiler sees through a plain copy. It does not see through a maximum. A `flat uniform`
// (opengl/shaders.py) costs next to nothing to begin with, but there is no room for many.
#define HELD(number) max(number, -3e38)
