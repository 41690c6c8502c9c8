// color2.h: a color channel with alpha.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.

#pragma once

#ifndef COLOR2_H
#define COLOR2_H

struct color2 {
    float r;
    float a;
};

// Operators: component by component. A color2 divided by a number is multiplied with its reciprocal.

color2 __operator__neg__(color2 a)
{
    return color2(-a.r, -a.a);
}

color2 __operator__add__(color2 a, color2 b)
{
    return color2(a.r + b.r, a.a + b.a);
}

color2 __operator__add__(color2 a, int b)
{
    return color2(a.r + b, a.a + b);
}

color2 __operator__add__(int a, color2 b)
{
    return color2(a + b.r, a + b.a);
}

color2 __operator__add__(color2 a, float b)
{
    return color2(a.r + b, a.a + b);
}

color2 __operator__add__(float a, color2 b)
{
    return color2(a + b.r, a + b.a);
}

color2 __operator__sub__(color2 a, color2 b)
{
    return color2(a.r - b.r, a.a - b.a);
}

color2 __operator__sub__(color2 a, int b)
{
    return color2(a.r - b, a.a - b);
}

color2 __operator__sub__(int a, color2 b)
{
    return color2(a - b.r, a - b.a);
}

color2 __operator__sub__(color2 a, float b)
{
    return color2(a.r - b, a.a - b);
}

color2 __operator__sub__(float a, color2 b)
{
    return color2(a - b.r, a - b.a);
}

color2 __operator__mul__(color2 a, color2 b)
{
    return color2(a.r * b.r, a.a * b.a);
}

color2 __operator__mul__(color2 a, int b)
{
    return color2(a.r * b, a.a * b);
}

color2 __operator__mul__(int a, color2 b)
{
    return color2(a * b.r, a * b.a);
}

color2 __operator__mul__(color2 a, float b)
{
    return color2(a.r * b, a.a * b);
}

color2 __operator__mul__(float a, color2 b)
{
    return color2(a * b.r, a * b.a);
}

color2 __operator__div__(color2 a, color2 b)
{
    return color2(a.r / b.r, a.a / b.a);
}

color2 __operator__div__(color2 a, int b)
{
    float inverse = 1.0 / b;
    return color2(a.r * inverse, a.a * inverse);
}

color2 __operator__div__(int a, color2 b)
{
    return color2(a / b.r, a / b.a);
}

color2 __operator__div__(color2 a, float b)
{
    float inverse = 1.0 / b;
    return color2(a.r * inverse, a.a * inverse);
}

color2 __operator__div__(float a, color2 b)
{
    return color2(a / b.r, a / b.a);
}

int __operator__eq__(color2 a, color2 b)
{
    return a.r == b.r && a.a == b.a;
}

int __operator__neq__(color2 a, color2 b)
{
    return a.r != b.r || a.a != b.a;
}

// Functions of one argument, component by component.

color2 abs(color2 a)
{
    return color2(abs(a.r), abs(a.a));
}

color2 ceil(color2 a)
{
    return color2(ceil(a.r), ceil(a.a));
}

color2 floor(color2 a)
{
    return color2(floor(a.r), floor(a.a));
}

color2 sqrt(color2 a)
{
    return color2(sqrt(a.r), sqrt(a.a));
}

color2 exp(color2 a)
{
    return color2(exp(a.r), exp(a.a));
}

color2 log(color2 a)
{
    return color2(log(a.r), log(a.a));
}

color2 log2(color2 a)
{
    return color2(log2(a.r), log2(a.a));
}

color2 sign(color2 a)
{
    return color2(sign(a.r), sign(a.a));
}

color2 sin(color2 a)
{
    return color2(sin(a.r), sin(a.a));
}

color2 cos(color2 a)
{
    return color2(cos(a.r), cos(a.a));
}

color2 tan(color2 a)
{
    return color2(tan(a.r), tan(a.a));
}

color2 asin(color2 a)
{
    return color2(asin(a.r), asin(a.a));
}

color2 acos(color2 a)
{
    return color2(acos(a.r), acos(a.a));
}

// Functions of more arguments, component by component; a number stands for a color2 of it.

color2 mix(color2 a, color2 b, float amount)
{
    return color2(mix(a.r, b.r, amount), mix(a.a, b.a, amount));
}

color2 smoothstep(color2 low, color2 high, color2 a)
{
    return color2(smoothstep(low.r, high.r, a.r), smoothstep(low.a, high.a, a.a));
}

color2 smoothstep(float low, float high, color2 a)
{
    return color2(smoothstep(low, high, a.r), smoothstep(low, high, a.a));
}

color2 clamp(color2 a, color2 low, color2 high)
{
    return color2(clamp(a.r, low.r, high.r), clamp(a.a, low.a, high.a));
}

color2 clamp(color2 a, float low, float high)
{
    return color2(clamp(a.r, low, high), clamp(a.a, low, high));
}

color2 max(color2 a, color2 b)
{
    return color2(max(a.r, b.r), max(a.a, b.a));
}

color2 max(color2 a, float b)
{
    return color2(max(a.r, b), max(a.a, b));
}

color2 min(color2 a, color2 b)
{
    return color2(min(a.r, b.r), min(a.a, b.a));
}

color2 min(color2 a, float b)
{
    return color2(min(a.r, b), min(a.a, b));
}

color2 fmod(color2 a, color2 b)
{
    return color2(fmod(a.r, b.r), fmod(a.a, b.a));
}

color2 fmod(color2 a, float b)
{
    return color2(fmod(a.r, b), fmod(a.a, b));
}

color2 fmod(color2 a, int b)
{
    return color2(fmod(a.r, b), fmod(a.a, b));
}

color2 pow(color2 a, color2 b)
{
    return color2(pow(a.r, b.r), pow(a.a, b.a));
}

color2 pow(color2 a, float b)
{
    return color2(pow(a.r, b), pow(a.a, b));
}

color2 atan2(color2 a, color2 b)
{
    return color2(atan2(a.r, b.r), atan2(a.a, b.a));
}

color2 atan2(color2 a, float b)
{
    return color2(atan2(a.r, b), atan2(a.a, b));
}

#endif
