// EACH_RAMP(F): F(name for a rise, name for a place, index) once for each of RAMPS ramps. Their numbers are those of
// ramps.py; names instead of arrays, since drivers keep arrays in memory.

#define EACH_OF_2(F) F(rise_0, place_0, 0) F(rise_1, place_1, 1)
#define EACH_OF_3(F) EACH_OF_2(F) F(rise_2, place_2, 2)
#define EACH_OF_4(F) EACH_OF_3(F) F(rise_3, place_3, 3)
#define EACH_OF_6(F) EACH_OF_4(F) F(rise_4, place_4, 4) F(rise_5, place_5, 5)
#define EACH_OF_8(F) EACH_OF_6(F) F(rise_6, place_6, 6) F(rise_7, place_7, 7)
#define EACH_OF_12(F) EACH_OF_8(F) F(rise_8, place_8, 8) F(rise_9, place_9, 9) F(rise_10, place_10, 10) \
    F(rise_11, place_11, 11)
#define EACH_OF_16(F) EACH_OF_12(F) F(rise_12, place_12, 12) F(rise_13, place_13, 13) F(rise_14, place_14, 14) \
    F(rise_15, place_15, 15)
#define EACH_OF_24(F) EACH_OF_16(F) F(rise_16, place_16, 16) F(rise_17, place_17, 17) F(rise_18, place_18, 18) \
    F(rise_19, place_19, 19) F(rise_20, place_20, 20) F(rise_21, place_21, 21) F(rise_22, place_22, 22) \
    F(rise_23, place_23, 23)

#if RAMPS == 2
#define EACH_RAMP(F) EACH_OF_2(F)
#elif RAMPS == 3
#define EACH_RAMP(F) EACH_OF_3(F)
#elif RAMPS == 4
#define EACH_RAMP(F) EACH_OF_4(F)
#elif RAMPS == 6
#define EACH_RAMP(F) EACH_OF_6(F)
#elif RAMPS == 8
#define EACH_RAMP(F) EACH_OF_8(F)
#elif RAMPS == 12
#define EACH_RAMP(F) EACH_OF_12(F)
#elif RAMPS == 16
#define EACH_RAMP(F) EACH_OF_16(F)
#elif RAMPS == 24
#define EACH_RAMP(F) EACH_OF_24(F)
#endif
