// Colors: sRGB, CIE and polar forms. The formulas are those of sRGB (IEC 61966-2-1) and CIE 1931.

#ifndef NODE_COLOR_H
#define NODE_COLOR_H

float color_srgb_to_scene_linear(float c)
{
    return c < 0.04045 ? max(c, 0.0) / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

float color_scene_linear_to_srgb(float c)
{
    return c < 0.0031308 ? 12.92 * max(c, 0.0) : 1.055 * pow(c, 1.0 / 2.4) - 0.055;
}

color color_srgb_to_scene_linear(color c)
{
    return color(color_srgb_to_scene_linear(c[0]), color_srgb_to_scene_linear(c[1]), color_srgb_to_scene_linear(c[2]));
}

color color_scene_linear_to_srgb(color c)
{
    return color(color_scene_linear_to_srgb(c[0]), color_scene_linear_to_srgb(c[1]), color_scene_linear_to_srgb(c[2]));
}

color color_unpremultiply(color c, float alpha)
{
    return alpha == 0.0 || alpha == 1.0 ? c : c / alpha;
}

color xyY_to_xyz(float x, float y, float Y)
{
    return y == 0.0 ? color(0.0, Y, 0.0) : color(x / y * Y, Y, (1.0 - x - y) / y * Y);
}

color xyz_to_rgb(float x, float y, float z)
{
    return color(3.240479 * x - 1.537150 * y - 0.498535 * z, -0.969256 * x + 1.875991 * y + 0.041556 * z,
                 0.055648 * x - 0.204043 * y + 1.057311 * z);
}

color rgb_to_hsv(color rgb) { return transformc("rgb", "hsv", rgb); }
color hsv_to_rgb(color hsv) { return transformc("hsv", "rgb", hsv); }
color rgb_to_hsl(color rgb) { return transformc("rgb", "hsl", rgb); }
color hsl_to_rgb(color hsl) { return transformc("hsl", "rgb", hsl); }

#endif
