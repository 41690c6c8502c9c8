// The functions that Octane adds. An input is never connected to another node here, so a delayed input has the
// same value everywhere. Spectra become RGB through the functions of `wavelength_color`.

#ifndef OCTANE_OSLINTRIN_H
#define OCTANE_OSLINTRIN_H

struct _sdf {
    int objId;
    int matId;
    float u;
    float v;
    float dist;
};
#define _SDFDEF {0, 0, 0.0, 0.0, 0.0}

color _evaluateDelayed(color input, float u, float v) { return input; }
color _evaluateDelayedP(color input, point p) { return input; }

// The color of white light through a filter: intensities at equal steps from 380 to 720 nm.
color _filtered(float intensity[69])
{
    color sum = 0, whole = 0;
    for (int i = 0; i < 69; i++) {
        color c = wavelength_color(380 + 5 * i);
        sum += intensity[i] * c;
        whole += c;
    }
    return sum / whole;
}

color _gaussian(float mean, float sigma)
{
    float s[69];
    for (int i = 0; i < 69; i++) {
        float way = 380 + 5 * i - mean;
        s[i] = sigma == 0 ? way == 0 : exp(-way * way / (2 * sigma * sigma));
    }
    return _filtered(s);
}

color _squareSpectrum(float begin, float end)
{
    float s[69];
    for (int i = 0; i < 69; i++)
        s[i] = 380 + 5 * i >= begin && 380 + 5 * i <= end;
    return _filtered(s);
}

color _triangularSpectrum(float mean, float spread)
{
    float s[69];
    for (int i = 0; i < 69; i++)
        s[i] = spread == 0 ? 0 : max(1 - abs(380 + 5 * i - mean) / spread, 0.0);
    return _filtered(s);
}

color _spectrum(color c) { return c; }

color _arraySpectrum(float list[], int start, int length)
{
    float s[69];
    for (int i = 0; i < 69; i++) {
        float at = start + (length - 1) * i / 68.0;
        int below = min((int)at, start + length - 1), above = min(below + 1, start + length - 1);
        s[i] = mix(list[below], list[above], at - below);
    }
    return _filtered(s);
}

color _arraySpectrum(float list[]) { return _arraySpectrum(list, 0, arraylength(list)); }

// The surface is there at all coordinates.
int _findBakingPrimitive(float u, float v) { return 1; }

// Turns the hue; 6 is a full turn.
color _hueshift(color c, float shift)
{
    color hsv = transformc("rgb", "hsv", c);
    float turned = hsv[0] + shift / 6.0;
    return transformc("hsv", "rgb", color(turned - floor(turned), hsv[1], hsv[2]));
}

#endif
