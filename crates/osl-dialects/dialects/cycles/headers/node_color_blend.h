// The blend modes of Blender's mix node: b over a, by a factor t.

#ifndef NODE_COLOR_BLEND_H
#define NODE_COLOR_BLEND_H

color node_mix_blend(float t, color a, color b) { return mix(a, b, t); }
color node_mix_add(float t, color a, color b) { return mix(a, a + b, t); }
color node_mix_mul(float t, color a, color b) { return mix(a, a * b, t); }
color node_mix_sub(float t, color a, color b) { return mix(a, a - b, t); }
color node_mix_diff(float t, color a, color b) { return mix(a, abs(a - b), t); }
color node_mix_exclusion(float t, color a, color b) { return max(mix(a, a + b - 2 * a * b, t), color(0)); }
color node_mix_dark(float t, color a, color b) { return mix(a, min(a, b), t); }
color node_mix_light(float t, color a, color b) { return mix(a, max(a, b), t); }
color node_mix_linear(float t, color a, color b) { return a + t * (2 * b - 1); }
color node_mix_clamp(color c) { return clamp(c, color(0), color(1)); }

color node_mix_screen(float t, color a, color b)
{
    return 1 - (1 - t + t * (1 - b)) * (1 - a);
}

color node_mix_soft(float t, color a, color b)
{
    color screened = 1 - (1 - b) * (1 - a);
    return mix(a, (1 - a) * b * a + a * screened, t);
}

float node_mix_overlay_of(float t, float a, float b)
{
    return a < 0.5 ? a * (1 - t + 2 * t * b) : 1 - (1 - t + 2 * t * (1 - b)) * (1 - a);
}

float node_mix_div_of(float t, float a, float b)
{
    return b != 0 ? mix(a, a / b, t) : a;
}

float node_mix_dodge_of(float t, float a, float b)
{
    float rest = 1 - t * b;
    return a == 0 ? 0 : (rest <= 0 ? 1 : min(a / rest, 1.0));
}

float node_mix_burn_of(float t, float a, float b)
{
    float rest = 1 - t + t * b;
    return rest <= 0 ? 0 : clamp(1 - (1 - a) / rest, 0.0, 1.0);
}

#define NODE_MIX_EACH(name) \
    color node_mix_##name(float t, color a, color b) \
    { \
        return color(node_mix_##name##_of(t, a[0], b[0]), node_mix_##name##_of(t, a[1], b[1]), \
                     node_mix_##name##_of(t, a[2], b[2])); \
    }
NODE_MIX_EACH(overlay)
NODE_MIX_EACH(div)
NODE_MIX_EACH(dodge)
NODE_MIX_EACH(burn)
#undef NODE_MIX_EACH

color node_mix_hue(float t, color a, color b)
{
    color ha = transformc("rgb", "hsv", a), hb = transformc("rgb", "hsv", b);
    return hb[1] == 0 ? a : mix(a, transformc("hsv", "rgb", color(hb[0], ha[1], ha[2])), t);
}

color node_mix_sat(float t, color a, color b)
{
    color ha = transformc("rgb", "hsv", a), hb = transformc("rgb", "hsv", b);
    return ha[1] == 0 ? a : transformc("hsv", "rgb", color(ha[0], mix(ha[1], hb[1], t), ha[2]));
}

color node_mix_val(float t, color a, color b)
{
    color ha = transformc("rgb", "hsv", a), hb = transformc("rgb", "hsv", b);
    return transformc("hsv", "rgb", color(ha[0], ha[1], mix(ha[2], hb[2], t)));
}

color node_mix_color(float t, color a, color b)
{
    color ha = transformc("rgb", "hsv", a), hb = transformc("rgb", "hsv", b);
    return hb[1] == 0 ? a : mix(a, transformc("hsv", "rgb", color(hb[0], hb[1], ha[2])), t);
}

#endif
