#ifndef SHAPE_H
#define SHAPE_H
#include "limits.h"
float ring(vector2 p, float radius) { return 1 - smoothstep(0.0, EDGE, abs(length(p) - radius)); }
#endif
