// vector4.h: vectors of four components.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.

#pragma once

#ifndef VECTOR4_H
#define VECTOR4_H

struct vector4 {
    float x;
    float y;
    float z;
    float w;
};

// Operators: component by component. A vector4 divided by a number is multiplied with its reciprocal.

vector4 __operator__neg__(vector4 a)
{
    return vector4(-a.x, -a.y, -a.z, -a.w);
}

vector4 __operator__add__(vector4 a, vector4 b)
{
    return vector4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w);
}

vector4 __operator__add__(vector4 a, int b)
{
    return vector4(a.x + b, a.y + b, a.z + b, a.w + b);
}

vector4 __operator__add__(int a, vector4 b)
{
    return vector4(a + b.x, a + b.y, a + b.z, a + b.w);
}

vector4 __operator__add__(vector4 a, float b)
{
    return vector4(a.x + b, a.y + b, a.z + b, a.w + b);
}

vector4 __operator__add__(float a, vector4 b)
{
    return vector4(a + b.x, a + b.y, a + b.z, a + b.w);
}

vector4 __operator__sub__(vector4 a, vector4 b)
{
    return vector4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w);
}

vector4 __operator__sub__(vector4 a, int b)
{
    return vector4(a.x - b, a.y - b, a.z - b, a.w - b);
}

vector4 __operator__sub__(int a, vector4 b)
{
    return vector4(a - b.x, a - b.y, a - b.z, a - b.w);
}

vector4 __operator__sub__(vector4 a, float b)
{
    return vector4(a.x - b, a.y - b, a.z - b, a.w - b);
}

vector4 __operator__sub__(float a, vector4 b)
{
    return vector4(a - b.x, a - b.y, a - b.z, a - b.w);
}

vector4 __operator__mul__(vector4 a, vector4 b)
{
    return vector4(a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w);
}

vector4 __operator__mul__(vector4 a, int b)
{
    return vector4(a.x * b, a.y * b, a.z * b, a.w * b);
}

vector4 __operator__mul__(int a, vector4 b)
{
    return vector4(a * b.x, a * b.y, a * b.z, a * b.w);
}

vector4 __operator__mul__(vector4 a, float b)
{
    return vector4(a.x * b, a.y * b, a.z * b, a.w * b);
}

vector4 __operator__mul__(float a, vector4 b)
{
    return vector4(a * b.x, a * b.y, a * b.z, a * b.w);
}

vector4 __operator__div__(vector4 a, vector4 b)
{
    return vector4(a.x / b.x, a.y / b.y, a.z / b.z, a.w / b.w);
}

vector4 __operator__div__(vector4 a, int b)
{
    float inverse = 1.0 / b;
    return vector4(a.x * inverse, a.y * inverse, a.z * inverse, a.w * inverse);
}

vector4 __operator__div__(int a, vector4 b)
{
    return vector4(a / b.x, a / b.y, a / b.z, a / b.w);
}

vector4 __operator__div__(vector4 a, float b)
{
    float inverse = 1.0 / b;
    return vector4(a.x * inverse, a.y * inverse, a.z * inverse, a.w * inverse);
}

vector4 __operator__div__(float a, vector4 b)
{
    return vector4(a / b.x, a / b.y, a / b.z, a / b.w);
}

int __operator__eq__(vector4 a, vector4 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w;
}

int __operator__neq__(vector4 a, vector4 b)
{
    return a.x != b.x || a.y != b.y || a.z != b.z || a.w != b.w;
}

// Functions of one argument, component by component.

vector4 abs(vector4 a)
{
    return vector4(abs(a.x), abs(a.y), abs(a.z), abs(a.w));
}

vector4 ceil(vector4 a)
{
    return vector4(ceil(a.x), ceil(a.y), ceil(a.z), ceil(a.w));
}

vector4 floor(vector4 a)
{
    return vector4(floor(a.x), floor(a.y), floor(a.z), floor(a.w));
}

vector4 sqrt(vector4 a)
{
    return vector4(sqrt(a.x), sqrt(a.y), sqrt(a.z), sqrt(a.w));
}

vector4 exp(vector4 a)
{
    return vector4(exp(a.x), exp(a.y), exp(a.z), exp(a.w));
}

vector4 log(vector4 a)
{
    return vector4(log(a.x), log(a.y), log(a.z), log(a.w));
}

vector4 log2(vector4 a)
{
    return vector4(log2(a.x), log2(a.y), log2(a.z), log2(a.w));
}

vector4 sign(vector4 a)
{
    return vector4(sign(a.x), sign(a.y), sign(a.z), sign(a.w));
}

vector4 sin(vector4 a)
{
    return vector4(sin(a.x), sin(a.y), sin(a.z), sin(a.w));
}

vector4 cos(vector4 a)
{
    return vector4(cos(a.x), cos(a.y), cos(a.z), cos(a.w));
}

vector4 tan(vector4 a)
{
    return vector4(tan(a.x), tan(a.y), tan(a.z), tan(a.w));
}

vector4 asin(vector4 a)
{
    return vector4(asin(a.x), asin(a.y), asin(a.z), asin(a.w));
}

vector4 acos(vector4 a)
{
    return vector4(acos(a.x), acos(a.y), acos(a.z), acos(a.w));
}

// Functions of more arguments, component by component; a number stands for a vector4 of it.

vector4 mix(vector4 a, vector4 b, float amount)
{
    return vector4(mix(a.x, b.x, amount), mix(a.y, b.y, amount), mix(a.z, b.z, amount), mix(a.w, b.w, amount));
}

vector4 smoothstep(vector4 low, vector4 high, vector4 a)
{
    return vector4(smoothstep(low.x, high.x, a.x), smoothstep(low.y, high.y, a.y), smoothstep(low.z, high.z, a.z), smoothstep(low.w, high.w, a.w));
}

vector4 smoothstep(float low, float high, vector4 a)
{
    return vector4(smoothstep(low, high, a.x), smoothstep(low, high, a.y), smoothstep(low, high, a.z), smoothstep(low, high, a.w));
}

vector4 clamp(vector4 a, vector4 low, vector4 high)
{
    return vector4(clamp(a.x, low.x, high.x), clamp(a.y, low.y, high.y), clamp(a.z, low.z, high.z), clamp(a.w, low.w, high.w));
}

vector4 clamp(vector4 a, float low, float high)
{
    return vector4(clamp(a.x, low, high), clamp(a.y, low, high), clamp(a.z, low, high), clamp(a.w, low, high));
}

vector4 max(vector4 a, vector4 b)
{
    return vector4(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z), max(a.w, b.w));
}

vector4 max(vector4 a, float b)
{
    return vector4(max(a.x, b), max(a.y, b), max(a.z, b), max(a.w, b));
}

vector4 min(vector4 a, vector4 b)
{
    return vector4(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z), min(a.w, b.w));
}

vector4 min(vector4 a, float b)
{
    return vector4(min(a.x, b), min(a.y, b), min(a.z, b), min(a.w, b));
}

vector4 fmod(vector4 a, vector4 b)
{
    return vector4(fmod(a.x, b.x), fmod(a.y, b.y), fmod(a.z, b.z), fmod(a.w, b.w));
}

vector4 fmod(vector4 a, float b)
{
    return vector4(fmod(a.x, b), fmod(a.y, b), fmod(a.z, b), fmod(a.w, b));
}

vector4 pow(vector4 a, vector4 b)
{
    return vector4(pow(a.x, b.x), pow(a.y, b.y), pow(a.z, b.z), pow(a.w, b.w));
}

vector4 pow(vector4 a, float b)
{
    return vector4(pow(a.x, b), pow(a.y, b), pow(a.z, b), pow(a.w, b));
}

vector4 atan2(vector4 a, vector4 b)
{
    return vector4(atan2(a.x, b.x), atan2(a.y, b.y), atan2(a.z, b.z), atan2(a.w, b.w));
}

vector4 atan2(vector4 a, float b)
{
    return vector4(atan2(a.x, b), atan2(a.y, b), atan2(a.z, b), atan2(a.w, b));
}

// Geometry.

float dot(vector4 a, vector4 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

float length(vector4 a)
{
    return sqrt(a.x * a.x + a.y * a.y + a.z * a.z + a.w * a.w);
}

vector4 normalize(vector4 a)
{
    return a / length(a);
}

vector vec4ToVec3(vector4 a)
{
    return vector(a.x, a.y, a.z) / a.w;
}

// All four components as a row vector, times the matrix.

vector4 transform(matrix m, vector4 a)
{
    return vector4(
        a.x * m[0][0] + a.y * m[1][0] + a.z * m[2][0] + a.w * m[3][0],
        a.x * m[0][1] + a.y * m[1][1] + a.z * m[2][1] + a.w * m[3][1],
        a.x * m[0][2] + a.y * m[1][2] + a.z * m[2][2] + a.w * m[3][2],
        a.x * m[0][3] + a.y * m[1][3] + a.z * m[2][3] + a.w * m[3][3]);
}

vector4 transform(string from, string to, vector4 a)
{
    return transform(matrix(from, to), a);
}

#endif
