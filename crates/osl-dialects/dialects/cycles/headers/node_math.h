// Arithmetic of Blender's math nodes: functions that have a value where their formula has none.

#ifndef NODE_MATH_H
#define NODE_MATH_H

#include "vector2.h"
#include "vector4.h"

#define vector3 point

float safe_divide(float a, float b) { return b != 0.0 ? a / b : 0.0; }
vector3 safe_divide(vector3 a, vector3 b)
{
    return vector3(safe_divide(a[0], b[0]), safe_divide(a[1], b[1]), safe_divide(a[2], b[2]));
}

float safe_modulo(float a, float b) { return b != 0.0 ? fmod(a, b) : 0.0; }
float safe_floored_modulo(float a, float b) { return b != 0.0 ? a - floor(a / b) * b : 0.0; }

float sqr(float a) { return a * a; }
float fract(float a) { return a - floor(a); }

float smoothmin(float a, float b, float c)
{
    if (c == 0.0)
        return min(a, b);
    float h = max(c - abs(a - b), 0.0) / c;
    return min(a, b) - h * h * h * c / 6.0;
}

float pingpong(float a, float b) { return b != 0.0 ? abs(fract((a - b) / (2 * b)) * 2 * b - b) : 0.0; }

float safe_sqrt(float a) { return a > 0.0 ? sqrt(a) : 0.0; }
float safe_log(float a, float b) { return a > 0.0 && b > 0.0 ? safe_divide(log(a), log(b)) : 0.0; }

vector3 project(vector3 v, vector3 onto)
{
    float square = dot(onto, onto);
    return square != 0.0 ? dot(v, onto) / square * onto : vector3(0.0);
}

vector3 snap(vector3 a, vector3 b) { return floor(safe_divide(a, b)) * b; }

float wrap(float value, float max, float min)
{
    float range = max - min;
    return range != 0.0 ? value - range * floor((value - min) / range) : min;
}

point wrap(point value, point max, point min)
{
    return point(wrap(value[0], max[0], min[0]), wrap(value[1], max[1], min[1]), wrap(value[2], max[2], min[2]));
}

vector3 compatible_faceforward(vector3 vec, vector3 incident, vector3 reference)
{
    return dot(reference, incident) < 0.0 ? vec : -vec;
}

// Rotations about x, then y, then z.
matrix euler_to_mat(point euler)
{
    float cx = cos(euler[0]), cy = cos(euler[1]), cz = cos(euler[2]);
    float sx = sin(euler[0]), sy = sin(euler[1]), sz = sin(euler[2]);
    return matrix(cy * cz, cy * sz, -sy, 0, sy * sx * cz - cx * sz, sy * sx * sz + cx * cz, cy * sx, 0,
                  sy * cx * cz + sx * sz, sy * cx * sz - sx * cz, cy * cx, 0, 0, 0, 0, 1);
}

float average(point a) { return (a[0] + a[1] + a[2]) / 3.0; }

vector2 round(vector2 a) { return vector2(round(a.x), round(a.y)); }
vector4 round(vector4 a) { return vector4(round(a.x), round(a.y), round(a.z), round(a.w)); }

#endif
