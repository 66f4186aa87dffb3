// EACH_RAMP(F): F(name of a rise, name of a position, index) once for each of RAMPS ramps. The numbers of ramps are
// those of textures/ramps.py. There are names instead of arrays because drivers keep arrays in memory.

#define EACH_OF_2(F) F(rise_0, position_0, 0) F(rise_1, position_1, 1)
#define EACH_OF_3(F) EACH_OF_2(F) F(rise_2, position_2, 2)
#define EACH_OF_4(F) EACH_OF_3(F) F(rise_3, position_3, 3)
#define EACH_OF_6(F) EACH_OF_4(F) F(rise_4, position_4, 4) F(rise_5, position_5, 5)
#define EACH_OF_8(F) EACH_OF_6(F) F(rise_6, position_6, 6) F(rise_7, position_7, 7)
#define EACH_OF_12(F) EACH_OF_8(F) F(rise_8, position_8, 8) F(rise_9, position_9, 9) F(rise_10, position_10, 10) \
    F(rise_11, position_11, 11)
#define EACH_OF_16(F) EACH_OF_12(F) F(rise_12, position_12, 12) F(rise_13, position_13, 13) \
    F(rise_14, position_14, 14) F(rise_15, position_15, 15)
#define EACH_OF_24(F) EACH_OF_16(F) F(rise_16, position_16, 16) F(rise_17, position_17, 17) \
    F(rise_18, position_18, 18) F(rise_19, position_19, 19) F(rise_20, position_20, 20) \
    F(rise_21, position_21, 21) F(rise_22, position_22, 22) F(rise_23, position_23, 23)

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
