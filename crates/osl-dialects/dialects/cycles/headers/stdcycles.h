// The prelude of Blender Cycles: what its shaders may use without an include, beside the standard header.
//
// Closures that the language can express are functions over today's closures. The others are declared, so that a
// file compiles; a preview shows what it does not know as squares.

#ifndef CCL_STDCYCLESOSL_H
#define CCL_STDCYCLESOSL_H

#include "stdosl.h"

#define FLT_MAX 3.402823466e+38
#define BUMP_FILTER_WIDTH 0.1

#ifndef BUILTIN
#define BUILTIN [[int builtin = 1]]
#define BUILTIN_DERIV [[int builtin = 1, int deriv = 1]]
#endif

// In a camera shader, P is the place in the picture and N the random numbers.
point camera_shader_raster_position() { return P; }
vector camera_shader_random_sample() { return vector(N); }

// Closures of Cycles.
closure color diffuse_ramp(normal N, color colors[8]) BUILTIN;
closure color phong_ramp(normal N, float exponent, color colors[8]) BUILTIN;
closure color diffuse_toon(normal N, float size, float smooth) BUILTIN;
closure color glossy_toon(normal N, float size, float smooth) BUILTIN;
closure color ashikhmin_velvet(normal N, float sigma) BUILTIN;
closure color sheen(normal N, float roughness) BUILTIN;
closure color ambient_occlusion() BUILTIN;
closure color microfacet_f82_tint(string distribution, vector N, vector T, float ax, float ay, color f0, color f82) BUILTIN;
closure color thin_glass(normal N, vector T, color reflection, color transmission, float ior, float roughness,
                         float thinfilm_thickness, float thinfilm_ior) BUILTIN;
closure color thin_subsurface(normal N, vector T, color C, float anisotropy, float roughness) BUILTIN;
closure color bssrdf(string method, normal N, vector radius, color albedo) BUILTIN;
closure color hair_reflection(normal N, float roughnessu, float roughnessv, vector T, float offset) BUILTIN;
closure color hair_transmission(normal N, float roughnessu, float roughnessv, vector T, float offset) BUILTIN;
closure color hair_chiang(normal N, color sigma, float roughnessu, float roughnessv, float coat, float alpha,
                          float eta) BUILTIN;
closure color hair_huang(normal N, color sigma, float roughness, float tilt, float eta, float aspect_ratio,
                         float r_lobe, float tt_lobe, float trt_lobe) BUILTIN;
closure color henyey_greenstein(float g) BUILTIN;
closure color fournier_forand(float B, float IOR) BUILTIN;
closure color draine(float g, float alpha) BUILTIN;
closure color rayleigh() BUILTIN;
closure color absorption() BUILTIN;
closure color ray_portal_bsdf(vector position, vector direction) BUILTIN;

// Closures of Blender 2.6 to 4.x without a counterpart.
closure color principled_diffuse(normal N, float roughness) BUILTIN;
closure color principled_sheen(normal N) BUILTIN;
closure color principled_clearcoat(normal N, float clearcoat, float clearcoat_roughness) BUILTIN;
closure color principled_hair(normal N, color sigma, float roughnessu, float roughnessv, float coat, float alpha,
                              float eta) BUILTIN;
closure color bssrdf_cubic(normal N, vector radius, float texture_blur, float sharpness) BUILTIN;
closure color bssrdf_gaussian(normal N, vector radius, float texture_blur) BUILTIN;
closure color ashikhmin_shirley(normal N, vector T, float ax, float ay) BUILTIN;
closure color microfacet_ggx_fresnel(normal N, float ag, float eta, color C, color Cspec0) BUILTIN;
closure color microfacet_ggx_aniso_fresnel(normal N, vector T, float ax, float ay, float eta, color C,
                                           color Cspec0) BUILTIN;
closure color microfacet_multi_ggx(normal N, float ag, color C) BUILTIN;
closure color microfacet_multi_ggx_glass(normal N, float ag, float eta, color C) BUILTIN;
closure color microfacet_multi_ggx_aniso(normal N, vector T, float ax, float ay, color C) BUILTIN;
closure color microfacet_multi_ggx_fresnel(normal N, float ag, float eta, color C, color Cspec0) BUILTIN;
closure color microfacet_multi_ggx_glass_fresnel(normal N, float ag, float eta, color C, color Cspec0) BUILTIN;
closure color microfacet_multi_ggx_aniso_fresnel(normal N, vector T, float ax, float ay, float eta, color C,
                                                 color Cspec0) BUILTIN;

// Facets that reflect have no Fresnel term in Cycles, which the index 0 says.
closure color microfacet_ggx(normal N, float a) { return microfacet("ggx", N, vector(0), a, a, 0.0, 0); }
closure color microfacet_ggx(normal N, float a, float eta) { return microfacet("ggx", N, vector(0), a, a, eta, 0); }
closure color microfacet_beckmann(normal N, float a) { return microfacet("beckmann", N, vector(0), a, a, 0.0, 0); }
closure color microfacet_beckmann(normal N, float a, float eta)
{
    return microfacet("beckmann", N, vector(0), a, a, eta, 0);
}
closure color microfacet_ggx_aniso(normal N, vector T, float ax, float ay)
{
    return microfacet("ggx", N, T, ax, ay, 0.0, 0);
}
closure color microfacet_beckmann_aniso(normal N, vector T, float ax, float ay)
{
    return microfacet("beckmann", N, T, ax, ay, 0.0, 0);
}
closure color microfacet_ggx_refraction(normal N, float a, float eta)
{
    return microfacet("ggx", N, vector(0), a, a, eta, 1);
}
closure color microfacet_beckmann_refraction(normal N, float a, float eta)
{
    return microfacet("beckmann", N, vector(0), a, a, eta, 1);
}

#endif
