// A uniform that a loop reads, held in registers.
//
// Mesa's software driver fetches a uniform anew at each place where it is read, for one pixel of a vector after the other:
// four numbers, read in a loop over slabs, take as long there as classifying does. What is fetched before the loop stays;
// but the compiler sees through a plain copy, and not through a maximum. A `flat uniform` (shaders.py) costs next to
// nothing to begin with, but there is no room for many.
#define HELD(number) max(number, -3e38)
