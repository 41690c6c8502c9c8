// The procedural textures of Blender 2.6x, which later versions dropped.

#ifndef NODE_TEXTURE_H
#define NODE_TEXTURE_H

float safe_noise(point p, int type)
{
    float f = type == 0 ? noise("snoise", p) : noise("noise", p);
    return isfinite(f) ? f : 0.5;
}

color cellnoise_color(point p)
{
    return color(cellnoise(p), cellnoise(point(p[1], p[0], p[2])), cellnoise(point(p[1], p[2], p[0])));
}

// The four nearest feature points of the 27 cells around p, with their squared distances, whatever the metric.
void voronoi(point p, string metric, float e, output float da[4], output point pa[4])
{
    point cell = floor(p);
    for (int i = 0; i < 4; i++)
        da[i] = 1e10;
    for (int x = -1; x <= 1; x++)
        for (int y = -1; y <= 1; y++)
            for (int z = -1; z <= 1; z++) {
                point corner = cell + point(x, y, z);
                point feature = corner + (vector)cellnoise_color(corner);
                vector way = p - feature;
                float d = dot(way, way);
                if (d < da[3]) {
                    int at = 3;
                    while (at > 0 && d < da[at - 1]) {
                        da[at] = da[at - 1];
                        pa[at] = pa[at - 1];
                        at--;
                    }
                    da[at] = d;
                    pa[at] = feature;
                }
            }
}

float voronoi_distance_of(point p, int nth)
{
    float da[4];
    point pa[4];
    voronoi(p, "Distance Squared", 0, da, pa);
    return da[nth];
}

float voronoi_F1(point p) { return voronoi_distance_of(p, 0); }
float voronoi_F2(point p) { return voronoi_distance_of(p, 1); }
float voronoi_F3(point p) { return voronoi_distance_of(p, 2); }
float voronoi_F4(point p) { return voronoi_distance_of(p, 3); }
float voronoi_F1F2(point p) { return voronoi_F2(p) - voronoi_F1(p); }
float voronoi_Cr(point p) { return min(10 * voronoi_F1F2(p), 1.0); }
float voronoi_F1S(point p) { return 2 * voronoi_F1(p) - 1; }
float voronoi_F2S(point p) { return 2 * voronoi_F2(p) - 1; }
float voronoi_F3S(point p) { return 2 * voronoi_F3(p) - 1; }
float voronoi_F4S(point p) { return 2 * voronoi_F4(p) - 1; }
float voronoi_F1F2S(point p) { return 2 * voronoi_F1F2(p) - 1; }
float voronoi_CrS(point p) { return 2 * voronoi_Cr(p) - 1; }

float noise_basis(point p, string basis)
{
    if (basis == "Perlin")
        return safe_noise(p, 1);
    if (basis == "Voronoi F1")
        return voronoi_F1S(p);
    if (basis == "Voronoi F2")
        return voronoi_F2S(p);
    if (basis == "Voronoi F3")
        return voronoi_F3S(p);
    if (basis == "Voronoi F4")
        return voronoi_F4S(p);
    if (basis == "Voronoi F2-F1")
        return voronoi_F1F2S(p);
    if (basis == "Voronoi Crackle")
        return voronoi_CrS(p);
    return basis == "Cell Noise" ? cellnoise(p) : 0.0;
}

float noise_basis_hard(point p, string basis, int hard)
{
    float t = noise_basis(p, basis);
    return hard ? fabs(2 * t - 1) : t;
}

// Octaves of half the amplitude each; the last one counts by the fraction of details.
float noise_turbulence(point p, string basis, float details, int hard)
{
    float octaves = clamp(details, 0.0, 16.0);
    int n = (int)octaves;
    float sum = 0, whole = 0;
    for (int i = 0; i <= n; i++)
        sum += noise_basis_hard(pow(2.0, i) * p, basis, hard) / pow(2.0, i);
    whole = sum * pow(2.0, n) / (pow(2.0, n + 1) - 1);
    float part = octaves - n;
    if (part == 0)
        return whole;
    sum += noise_basis_hard(pow(2.0, n + 1) * p, basis, hard) / pow(2.0, n + 1);
    return mix(whole, sum * pow(2.0, n + 1) / (pow(2.0, n + 2) - 1), part);
}

float nonzero(float f, float eps)
{
    return abs(f) >= eps ? f : (f < 0 ? -eps : eps);
}

#endif
