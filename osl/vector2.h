// vector2.h: vectors of two components.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.

#pragma once

#ifndef VECTOR2_H
#define VECTOR2_H

struct vector2 {
    float x;
    float y;
};

// Operators: component by component. A vector2 divided by a number is multiplied with its reciprocal.

vector2 __operator__neg__(vector2 a)
{
    return vector2(-a.x, -a.y);
}

vector2 __operator__add__(vector2 a, vector2 b)
{
    return vector2(a.x + b.x, a.y + b.y);
}

vector2 __operator__add__(vector2 a, int b)
{
    return vector2(a.x + b, a.y + b);
}

vector2 __operator__add__(int a, vector2 b)
{
    return vector2(a + b.x, a + b.y);
}

vector2 __operator__add__(vector2 a, float b)
{
    return vector2(a.x + b, a.y + b);
}

vector2 __operator__add__(float a, vector2 b)
{
    return vector2(a + b.x, a + b.y);
}

vector2 __operator__sub__(vector2 a, vector2 b)
{
    return vector2(a.x - b.x, a.y - b.y);
}

vector2 __operator__sub__(vector2 a, int b)
{
    return vector2(a.x - b, a.y - b);
}

vector2 __operator__sub__(int a, vector2 b)
{
    return vector2(a - b.x, a - b.y);
}

vector2 __operator__sub__(vector2 a, float b)
{
    return vector2(a.x - b, a.y - b);
}

vector2 __operator__sub__(float a, vector2 b)
{
    return vector2(a - b.x, a - b.y);
}

vector2 __operator__mul__(vector2 a, vector2 b)
{
    return vector2(a.x * b.x, a.y * b.y);
}

vector2 __operator__mul__(vector2 a, int b)
{
    return vector2(a.x * b, a.y * b);
}

vector2 __operator__mul__(int a, vector2 b)
{
    return vector2(a * b.x, a * b.y);
}

vector2 __operator__mul__(vector2 a, float b)
{
    return vector2(a.x * b, a.y * b);
}

vector2 __operator__mul__(float a, vector2 b)
{
    return vector2(a * b.x, a * b.y);
}

vector2 __operator__div__(vector2 a, vector2 b)
{
    return vector2(a.x / b.x, a.y / b.y);
}

vector2 __operator__div__(vector2 a, int b)
{
    float inverse = 1.0 / b;
    return vector2(a.x * inverse, a.y * inverse);
}

vector2 __operator__div__(int a, vector2 b)
{
    return vector2(a / b.x, a / b.y);
}

vector2 __operator__div__(vector2 a, float b)
{
    float inverse = 1.0 / b;
    return vector2(a.x * inverse, a.y * inverse);
}

vector2 __operator__div__(float a, vector2 b)
{
    return vector2(a / b.x, a / b.y);
}

int __operator__eq__(vector2 a, vector2 b)
{
    return a.x == b.x && a.y == b.y;
}

int __operator__neq__(vector2 a, vector2 b)
{
    return a.x != b.x || a.y != b.y;
}

// Functions of one argument, component by component.

vector2 abs(vector2 a)
{
    return vector2(abs(a.x), abs(a.y));
}

vector2 ceil(vector2 a)
{
    return vector2(ceil(a.x), ceil(a.y));
}

vector2 floor(vector2 a)
{
    return vector2(floor(a.x), floor(a.y));
}

vector2 sqrt(vector2 a)
{
    return vector2(sqrt(a.x), sqrt(a.y));
}

vector2 exp(vector2 a)
{
    return vector2(exp(a.x), exp(a.y));
}

vector2 log(vector2 a)
{
    return vector2(log(a.x), log(a.y));
}

vector2 log2(vector2 a)
{
    return vector2(log2(a.x), log2(a.y));
}

vector2 sign(vector2 a)
{
    return vector2(sign(a.x), sign(a.y));
}

vector2 sin(vector2 a)
{
    return vector2(sin(a.x), sin(a.y));
}

vector2 cos(vector2 a)
{
    return vector2(cos(a.x), cos(a.y));
}

vector2 tan(vector2 a)
{
    return vector2(tan(a.x), tan(a.y));
}

vector2 asin(vector2 a)
{
    return vector2(asin(a.x), asin(a.y));
}

vector2 acos(vector2 a)
{
    return vector2(acos(a.x), acos(a.y));
}

// Functions of more arguments, component by component; a number stands for a vector2 of it.

vector2 mix(vector2 a, vector2 b, float amount)
{
    return vector2(mix(a.x, b.x, amount), mix(a.y, b.y, amount));
}

vector2 smoothstep(vector2 low, vector2 high, vector2 a)
{
    return vector2(smoothstep(low.x, high.x, a.x), smoothstep(low.y, high.y, a.y));
}

vector2 smoothstep(float low, float high, vector2 a)
{
    return vector2(smoothstep(low, high, a.x), smoothstep(low, high, a.y));
}

vector2 clamp(vector2 a, vector2 low, vector2 high)
{
    return vector2(clamp(a.x, low.x, high.x), clamp(a.y, low.y, high.y));
}

vector2 clamp(vector2 a, float low, float high)
{
    return vector2(clamp(a.x, low, high), clamp(a.y, low, high));
}

vector2 max(vector2 a, vector2 b)
{
    return vector2(max(a.x, b.x), max(a.y, b.y));
}

vector2 max(vector2 a, float b)
{
    return vector2(max(a.x, b), max(a.y, b));
}

vector2 min(vector2 a, vector2 b)
{
    return vector2(min(a.x, b.x), min(a.y, b.y));
}

vector2 min(vector2 a, float b)
{
    return vector2(min(a.x, b), min(a.y, b));
}

vector2 fmod(vector2 a, vector2 b)
{
    return vector2(fmod(a.x, b.x), fmod(a.y, b.y));
}

vector2 fmod(vector2 a, float b)
{
    return vector2(fmod(a.x, b), fmod(a.y, b));
}

vector2 pow(vector2 a, vector2 b)
{
    return vector2(pow(a.x, b.x), pow(a.y, b.y));
}

vector2 pow(vector2 a, float b)
{
    return vector2(pow(a.x, b), pow(a.y, b));
}

vector2 atan2(vector2 a, vector2 b)
{
    return vector2(atan2(a.x, b.x), atan2(a.y, b.y));
}

vector2 atan2(vector2 a, float b)
{
    return vector2(atan2(a.x, b), atan2(a.y, b));
}

// Geometry.

float dot(vector2 a, vector2 b)
{
    return a.x * b.x + a.y * b.y;
}

float length(vector2 a)
{
    return hypot(a.x, a.y);
}

vector2 normalize(vector2 a)
{
    return a / length(a);
}

// The rest of a division that rounds down: unlike that of fmod it has the sign of b.

vector2 mod(vector2 a, vector2 b)
{
    return a - b * floor(a / b);
}

#endif
