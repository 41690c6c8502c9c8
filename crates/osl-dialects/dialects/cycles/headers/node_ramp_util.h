// Lookups in tables of colors and numbers from 0 to 1.

#ifndef NODE_RAMP_UTIL_H
#define NODE_RAMP_UTIL_H

color rgb_ramp_lookup(color ramp[], float at, int interpolate, int extrapolate)
{
    int last = arraylength(ramp) - 1;
    if (extrapolate && last > 0 && at < 0.0)
        return ramp[0] - (ramp[0] - ramp[1]) * at * last;
    if (extrapolate && last > 0 && at > 1.0)
        return ramp[last] + (ramp[last] - ramp[last - 1]) * (at - 1.0) * last;
    float f = clamp(at, 0.0, 1.0) * last;
    int i = (int)f;
    float t = f - i;
    return interpolate && t > 0.0 ? (1.0 - t) * ramp[i] + t * ramp[i + 1] : ramp[i];
}

float rgb_ramp_lookup(float ramp[], float at, int interpolate, int extrapolate)
{
    int last = arraylength(ramp) - 1;
    if (extrapolate && last > 0 && at < 0.0)
        return ramp[0] - (ramp[0] - ramp[1]) * at * last;
    if (extrapolate && last > 0 && at > 1.0)
        return ramp[last] + (ramp[last] - ramp[last - 1]) * (at - 1.0) * last;
    float f = clamp(at, 0.0, 1.0) * last;
    int i = (int)f;
    float t = f - i;
    return interpolate && t > 0.0 ? (1.0 - t) * ramp[i] + t * ramp[i + 1] : ramp[i];
}

#endif
