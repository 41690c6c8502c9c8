// color4.h: a color with alpha.
// Written for oslrun from the description of the header of that name in the OSL distribution: the same functions.
// As there, no function divides an int by a color4; the one for floats takes it.

#pragma once

#ifndef COLOR4_H
#define COLOR4_H

struct color4 {
    color rgb;
    float a;
};

// Operators: component by component. A color4 divided by a number is multiplied with its reciprocal.

color4 __operator__neg__(color4 a)
{
    return color4(-a.rgb, -a.a);
}

color4 __operator__add__(color4 a, color4 b)
{
    return color4(a.rgb + b.rgb, a.a + b.a);
}

color4 __operator__add__(color4 a, int b)
{
    return color4(a.rgb + b, a.a + b);
}

color4 __operator__add__(int a, color4 b)
{
    return color4(a + b.rgb, a + b.a);
}

color4 __operator__add__(color4 a, float b)
{
    return color4(a.rgb + b, a.a + b);
}

color4 __operator__add__(float a, color4 b)
{
    return color4(a + b.rgb, a + b.a);
}

color4 __operator__sub__(color4 a, color4 b)
{
    return color4(a.rgb - b.rgb, a.a - b.a);
}

color4 __operator__sub__(color4 a, int b)
{
    return color4(a.rgb - b, a.a - b);
}

color4 __operator__sub__(int a, color4 b)
{
    return color4(a - b.rgb, a - b.a);
}

color4 __operator__sub__(color4 a, float b)
{
    return color4(a.rgb - b, a.a - b);
}

color4 __operator__sub__(float a, color4 b)
{
    return color4(a - b.rgb, a - b.a);
}

color4 __operator__mul__(color4 a, color4 b)
{
    return color4(a.rgb * b.rgb, a.a * b.a);
}

color4 __operator__mul__(color4 a, int b)
{
    return color4(a.rgb * b, a.a * b);
}

color4 __operator__mul__(int a, color4 b)
{
    return color4(a * b.rgb, a * b.a);
}

color4 __operator__mul__(color4 a, float b)
{
    return color4(a.rgb * b, a.a * b);
}

color4 __operator__mul__(float a, color4 b)
{
    return color4(a * b.rgb, a * b.a);
}

color4 __operator__div__(color4 a, color4 b)
{
    return color4(a.rgb / b.rgb, a.a / b.a);
}

color4 __operator__div__(color4 a, int b)
{
    float inverse = 1.0 / b;
    return color4(a.rgb * inverse, a.a * inverse);
}

color4 __operator__div__(color4 a, float b)
{
    float inverse = 1.0 / b;
    return color4(a.rgb * inverse, a.a * inverse);
}

color4 __operator__div__(float a, color4 b)
{
    return color4(a / b.rgb, a / b.a);
}

int __operator__eq__(color4 a, color4 b)
{
    return a.rgb == b.rgb && a.a == b.a;
}

int __operator__neq__(color4 a, color4 b)
{
    return a.rgb != b.rgb || a.a != b.a;
}

// Functions of one argument, component by component.

color4 abs(color4 a)
{
    return color4(abs(a.rgb), abs(a.a));
}

color4 ceil(color4 a)
{
    return color4(ceil(a.rgb), ceil(a.a));
}

color4 floor(color4 a)
{
    return color4(floor(a.rgb), floor(a.a));
}

color4 sqrt(color4 a)
{
    return color4(sqrt(a.rgb), sqrt(a.a));
}

color4 exp(color4 a)
{
    return color4(exp(a.rgb), exp(a.a));
}

color4 log(color4 a)
{
    return color4(log(a.rgb), log(a.a));
}

color4 log2(color4 a)
{
    return color4(log2(a.rgb), log2(a.a));
}

color4 sign(color4 a)
{
    return color4(sign(a.rgb), sign(a.a));
}

color4 sin(color4 a)
{
    return color4(sin(a.rgb), sin(a.a));
}

color4 cos(color4 a)
{
    return color4(cos(a.rgb), cos(a.a));
}

color4 tan(color4 a)
{
    return color4(tan(a.rgb), tan(a.a));
}

color4 asin(color4 a)
{
    return color4(asin(a.rgb), asin(a.a));
}

color4 acos(color4 a)
{
    return color4(acos(a.rgb), acos(a.a));
}

// Functions of more arguments, component by component; a number stands for a color4 of it.

color4 mix(color4 a, color4 b, float amount)
{
    return color4(mix(a.rgb, b.rgb, amount), mix(a.a, b.a, amount));
}

color4 smoothstep(color4 low, color4 high, color4 a)
{
    return color4(smoothstep(low.rgb, high.rgb, a.rgb), smoothstep(low.a, high.a, a.a));
}

color4 smoothstep(float low, float high, color4 a)
{
    return color4(smoothstep(color(low), color(high), a.rgb), smoothstep(low, high, a.a));
}

color4 clamp(color4 a, color4 low, color4 high)
{
    return color4(clamp(a.rgb, low.rgb, high.rgb), clamp(a.a, low.a, high.a));
}

color4 clamp(color4 a, float low, float high)
{
    return color4(clamp(a.rgb, color(low), color(high)), clamp(a.a, low, high));
}

color4 max(color4 a, color4 b)
{
    return color4(max(a.rgb, b.rgb), max(a.a, b.a));
}

color4 max(color4 a, float b)
{
    return color4(max(a.rgb, color(b)), max(a.a, b));
}

color4 min(color4 a, color4 b)
{
    return color4(min(a.rgb, b.rgb), min(a.a, b.a));
}

color4 min(color4 a, float b)
{
    return color4(min(a.rgb, color(b)), min(a.a, b));
}

color4 fmod(color4 a, color4 b)
{
    return color4(fmod(a.rgb, b.rgb), fmod(a.a, b.a));
}

color4 fmod(color4 a, float b)
{
    return color4(fmod(a.rgb, b), fmod(a.a, b));
}

color4 fmod(color4 a, int b)
{
    return color4(fmod(a.rgb, b), fmod(a.a, b));
}

color4 pow(color4 a, color4 b)
{
    return color4(pow(a.rgb, b.rgb), pow(a.a, b.a));
}

color4 pow(color4 a, float b)
{
    return color4(pow(a.rgb, b), pow(a.a, b));
}

color4 atan2(color4 a, color4 b)
{
    return color4(atan2(a.rgb, b.rgb), atan2(a.a, b.a));
}

color4 atan2(color4 a, float b)
{
    return color4(atan2(a.rgb, color(b)), atan2(a.a, b));
}

// Converts the color; alpha stays.

color4 transformc(string from, string to, color4 a)
{
    return color4(transformc(from, to, a.rgb), a.a);
}

#endif
