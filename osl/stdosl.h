// The standard header of OSL as oslrun reads it before the first line of every shader.
//
// It holds what OSL can say itself: the constants, and what later versions of the language do otherwise. Built-in
// functions stand in the compiler's own table.
// Values: OSL language specification, mathematical constants.

#ifndef STDOSL_H
#define STDOSL_H

// A shader may bring its own set.
#ifndef M_PI
#define M_PI 3.1415926535897932         // pi
#define M_PI_2 1.5707963267948966       // pi / 2
#define M_PI_4 0.7853981633974483       // pi / 4
#define M_2_PI 0.6366197723675813       // 2 / pi
#define M_2PI 6.2831853071795865        // 2 pi
#define M_4PI 12.566370614359173        // 4 pi
#define M_2_SQRTPI 1.1283791670955126   // 2 / sqrt(pi)
#define M_E 2.7182818284590452          // e
#define M_LN2 0.6931471805599453        // ln(2)
#define M_LN10 2.3025850929940457       // ln(10)
#define M_LOG2E 1.4426950408889634      // log2(e)
#define M_LOG10E 0.4342944819032518     // log10(e)
#define M_SQRT2 1.4142135623730950      // sqrt(2)
#define M_SQRT1_2 0.7071067811865475    // sqrt(1/2)
#endif

#if OSL_VERSION >= 11502
// Before, the built-in function clamps x to the edges, which gives another ramp where edge0 is above edge1.
float linearstep(float edge0, float edge1, float x)
{
    return edge0 == edge1 ? step(edge0, x) : clamp((x - edge0) / (edge1 - edge0), 0.0, 1.0);
}

color linearstep(color edge0, color edge1, color x)
{
    return color(linearstep(edge0[0], edge1[0], x[0]), linearstep(edge0[1], edge1[1], x[1]),
                 linearstep(edge0[2], edge1[2], x[2]));
}

vector linearstep(vector edge0, vector edge1, vector x)
{
    return vector(linearstep(edge0[0], edge1[0], x[0]), linearstep(edge0[1], edge1[1], x[1]),
                  linearstep(edge0[2], edge1[2], x[2]));
}
#endif

#endif
