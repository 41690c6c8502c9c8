// Curves through knots at positions: the ends are doubled, so that the curve reaches the first and last value.

#ifndef GAFFEROSL_SPLINE_H
#define GAFFEROSL_SPLINE_H

float gafferSplineAt(float positions[], string basis, float x)
{
    return splineinverse(basis == "constant" ? "linear" : basis, x, arraylength(positions), positions);
}

float floatSpline(float positions[], float values[], string basis, float x)
{
    return spline(basis, gafferSplineAt(positions, basis, x), arraylength(values), values);
}

color colorSpline(float positions[], color values[], string basis, float x)
{
    return spline(basis, gafferSplineAt(positions, basis, x), arraylength(values), values);
}

#endif
