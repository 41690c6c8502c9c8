#ifndef STDVENDOR_H
#define STDVENDOR_H
#include "stdosl.h"
#include <vector2.h>
#define vector3 point
float safe_divide(float a, float b) { return b != 0 ? a / b : 0.0; }
vector2 safe_divide(vector2 a, vector2 b) { return vector2(safe_divide(a.x, b.x), safe_divide(a.y, b.y)); }
#endif
