"""Materials for the pictures: each is a name, the surface node, and values of its inputs.

A value that is a tuple (node, inputs) is a node of its own that drives the input.
"""

NOISE = ("fractal3d_float", {"octaves": 4})


def looks(base, metal, rough, through, coat, other):
    """Seven looks of a model, by the names that its inputs have."""
    return {
        "default": {},
        "red": {base: (0.7, 0.06, 0.04), rough: 0.25},
        "gold": {base: (1.0, 0.72, 0.3), metal: 1.0, rough: 0.15},
        "rough_metal": {base: (0.6, 0.62, 0.65), metal: 1.0, rough: 0.5},
        "glass": {**through, rough: 0.0},
        "coated": {base: (0.02, 0.1, 0.4), coat: 1.0, rough: 0.4},
        "other": other,
    }


MODELS = {
    "standard_surface": looks(
        "base_color", "metalness", "specular_roughness", {"transmission": 1.0}, "coat",
        {"emission": 1.0, "emission_color": (1.0, 0.5, 0.1)},
    ),
    "open_pbr_surface": looks(
        "base_color", "base_metalness", "specular_roughness", {"transmission_weight": 1.0}, "coat_weight",
        {"emission_luminance": 1.0, "emission_color": (0.2, 0.6, 1.0)},
    ),
    "gltf_pbr": looks(
        "base_color", "metallic", "roughness", {"transmission": 1.0, "metallic": 0.0}, "clearcoat", {"emissive": (0.1, 0.9, 0.3)}
    ),
    "UsdPreviewSurface": looks(
        "diffuseColor", "metallic", "roughness", {"opacity": 0.1}, "clearcoat", {"emissiveColor": (0.9, 0.2, 0.6)}
    ),
    "disney_principled": looks(
        "baseColor", "metallic", "roughness", {"specTrans": 1.0}, "clearcoat", {"sheen": 1.0, "roughness": 0.9}
    ),
}

EXTRA = {
    "velvet": ("standard_surface", {"base_color": (0.2, 0.0, 0.1), "sheen": 1.0, "sheen_roughness": 0.4}),
    "wax": ("standard_surface", {"subsurface": 1.0, "subsurface_color": (0.9, 0.6, 0.3)}),
    "film": ("standard_surface", {"thin_film_thickness": 400.0, "metalness": 1.0}),
    "brushed": ("standard_surface", {"metalness": 1.0, "specular_roughness": 0.4, "specular_anisotropy": 0.9}),
    "thin_red": ("standard_surface", {"opacity": (0.3, 0.3, 0.3), "base_color": (0.8, 0.1, 0.1)}),
    "noise_bumps": ("standard_surface", {"specular_roughness": NOISE, "base_color": (0.5, 0.5, 0.5)}),
    "fuzz": ("open_pbr_surface", {"fuzz_weight": 1.0, "base_color": (0.1, 0.2, 0.05)}),
    "bubble": ("open_pbr_surface", {"thin_film_weight": 1.0, "thin_film_thickness": 0.4, "base_metalness": 1.0}),
    "jade": ("open_pbr_surface", {"subsurface_weight": 1.0, "subsurface_color": (0.2, 0.6, 0.3)}),
    "honey": ("open_pbr_surface", {"transmission_weight": 1.0, "transmission_color": (1.0, 0.6, 0.1)}),
    "sheen": ("gltf_pbr", {"sheen_color": (0.8, 0.7, 0.9), "metallic": 0.0}),
    "iridescence": ("gltf_pbr", {"iridescence": 1.0, "roughness": 0.2}),
    "unlit": ("surface_unlit", {"emission_color": (0.3, 0.7, 0.2)}),
    "toon": ("gooch_shade", {}),
    "marble": ("fractal3d_color3", {"octaves": 5}),
}


def materials():
    """Names, nodes and inputs of all."""
    for (model, styles) in MODELS.items():
        for (style, inputs) in styles.items():
            yield f"{model}_{style}", model, inputs
    for (name, (model, inputs)) in EXTRA.items():
        yield name, model, inputs
