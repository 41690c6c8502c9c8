// The Fresnel equations for a dielectric (exact) and a conductor (the usual form for large indices).

#ifndef NODE_FRESNEL_H
#define NODE_FRESNEL_H

float fresnel_dielectric_cos(float cosi, float eta)
{
    float c = fabs(cosi);
    float g = eta * eta - 1 + c * c;
    if (g <= 0)
        return 1.0;
    g = sqrt(g);
    float a = (g - c) / (g + c);
    float b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * a * a * (1 + b * b);
}

color fresnel_conductor(float cosi, color eta, color k)
{
    color square = eta * eta + k * k;
    color twice = 2 * eta * cosi;
    color along = (square * cosi * cosi - twice + 1) / (square * cosi * cosi + twice + 1);
    color across = (square - twice + cosi * cosi) / (square + twice + cosi * cosi);
    return 0.5 * (along + across);
}

float F0_from_ior(float ior)
{
    float f = (ior - 1) / (ior + 1);
    return f * f;
}

float ior_from_F0(float f0)
{
    float root = sqrt(clamp(f0, 0.0, 0.99));
    return (1 + root) / (1 - root);
}

#endif
