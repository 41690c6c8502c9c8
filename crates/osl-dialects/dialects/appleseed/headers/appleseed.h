// The prelude of appleseed: its closures, beside the standard header.

#ifndef PRELUDE_APPLESEED_H
#define PRELUDE_APPLESEED_H

#include "stdosl.h"

#ifndef BUILTIN
#define BUILTIN [[int builtin = 1]]
#endif

closure color as_glossy(string mdf, normal N, vector T, float roughness, float highlight_falloff, float anisotropy,
                        float ior) BUILTIN;
closure color as_metal(string mdf, normal N, vector T, color face_tint, color edge_tint, float roughness, float falloff,
                       float anisotropy) BUILTIN;
closure color as_glass(string mdf, normal N, vector T, color surface_transmittance, color reflection_tint,
                       color refraction_tint, float roughness, float falloff, float anisotropy, float ior,
                       color volume_transmittance, float volume_distance) BUILTIN;
closure color as_subsurface(string profile, normal N, color albedo, color mfp, float ior) BUILTIN;
closure color as_disney(normal N, vector T, color base_color, float subsurface, float metallic, float specular,
                        float specular_tint, float anisotropic, float roughness, float sheen, float sheen_tint,
                        float clearcoat, float clearcoat_gloss) BUILTIN;
closure color as_ashikhmin_shirley(normal N, vector T, float nu, float nv) BUILTIN;
closure color as_velvet(normal N, float alpha) BUILTIN;
closure color as_npr_shading() BUILTIN;
closure color as_npr_contour(color tint, float opacity, float width, int object, int material, int occlusion,
                             float occlusion_threshold, int creases, float crease_threshold) BUILTIN;

// The albedo comes first here.
closure color oren_nayar(color albedo, normal N, float roughness) { return albedo * oren_nayar(N, roughness); }

#endif
