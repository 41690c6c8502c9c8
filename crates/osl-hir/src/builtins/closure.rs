//! Closures: how a surface scatters or emits light, as data for a renderer. A component has its name and the
//! values of its parameters; its weight comes from the arithmetic around it.

use super::print::values;
use super::{Builtin, Emitted, LeftOut, Site};
use osl_ir::ir::{Builder, Const, Kernel, Kind, Shape, ValueId};

/// A row for a component whose arguments are its parameters, in order.
macro_rules! component {
    ($name:literal, $sigs:expr, $names:literal, $about:literal, $example:literal) => {
        Builtin::compose($name, $sigs, $names, |b, s| component(b, s, $name), $about)
            .derivatives(NO_DERIVATIVES)
            .extremes(KEPT)
            .example($example)
    };
}

const NO_DERIVATIVES: &str = "none: closures have no derivatives";
const KEPT: &str =
    "Parameters are passed on unchanged, inf and nan too. A component with a weight of 0 is dropped.";

pub(super) static ROWS: &[Builtin] = &[
    component!("emission", &["K(*)"], "", "Emits light from the surface.", "Ci = emission();"),
    component!("background", &["K(*)"], "", "Emits the light of the background.", "Ci = background();"),
    component!(
        "transparent",
        &["K(*)"],
        "",
        "Lets light pass straight through the surface.",
        "Ci = 0.5 * transparent();"
    ),
    component!(
        "holdout",
        &["K(*)"],
        "",
        "Makes a hole in the alpha channel of the picture.",
        "Ci = holdout();"
    ),
    component!(
        "debug",
        &["K(s,*)"],
        "tag",
        "Marks a component with the text `tag`.",
        "Ci = debug(\"albedo\");"
    ),
    component!(
        "diffuse",
        &["K(n,*)"],
        "N",
        "Reflects light diffusely by Lambert's law, about the normal `N`.",
        "Ci = color(u, v, 0.5) * diffuse(N);"
    ),
    component!(
        "translucent",
        &["K(n,*)"],
        "N",
        "Transmits light diffusely by Lambert's law, about the normal `N`.",
        "Ci = translucent(N);"
    ),
    component!(
        "oren_nayar",
        &["K(n,f,*)"],
        "N, sigma",
        "Reflects light diffusely, as a rough surface does; `sigma` is its roughness.",
        "Ci = oren_nayar(N, 0.3);"
    ),
    component!(
        "phong",
        &["K(n,f,*)"],
        "N, exponent",
        "Reflects light by Phong's model, with an `exponent`.",
        "Ci = phong(N, 20);"
    ),
    component!(
        "ward",
        &["K(n,v,f,f,*)"],
        "N, T, ax, ay",
        "Reflects light by Ward's anisotropic model, about the tangent `T`.",
        "Ci = ward(N, dPdu, 0.1, 0.3);"
    ),
    Builtin::compose(
        "microfacet",
        &["K(s,n,v,f,f,f,i,*)", "K(s,n,f,f,i,*)"],
        "distribution, N, U, xalpha, yalpha, eta, refract | distribution, N, alpha, eta, refract",
        microfacet,
        "Reflects light, refracts it, or does both, by microfacets with a named `distribution`.",
    )
    .left_out(5, &[(2, LeftOut::ZeroVector), (3, LeftOut::Same(2))])
    .derivatives(NO_DERIVATIVES)
    .extremes(KEPT)
    .example("Ci = microfacet(\"ggx\", N, 0.2, 1.5, 0);"),
    Builtin::compose(
        "reflection",
        &["K(n,f,*)", "K(n,*)"],
        "N, eta",
        reflection,
        "Reflects light as a mirror does.",
    )
    .left_out(1, &[(1, LeftOut::Zero)])
    .derivatives(NO_DERIVATIVES)
    .extremes(KEPT)
    .example("Ci = reflection(N);"),
    component!(
        "refraction",
        &["K(n,f,*)"],
        "N, eta",
        "Refracts light sharply, without roughness.",
        "Ci = refraction(N, 1.5);"
    ),
    component!(
        "subsurface",
        &["K(f,f,c,c,*)"],
        "eta, g, mfp, albedo",
        "Scatters light below the surface; `mfp` is the mean free path.",
        "Ci = subsurface(1.4, 0, color(1, \
         0.4, 0.2), color(0.8));"
    ),
    component!(
        "oren_nayar_diffuse_bsdf",
        &["K(n,c,f,*)"],
        "N, albedo, roughness",
        "Reflects light diffusely by the model of Oren and Nayar.",
        "Ci = oren_nayar_diffuse_bsdf(N, color(0.8), 0.3);"
    ),
    component!(
        "burley_diffuse_bsdf",
        &["K(n,c,f,*)"],
        "N, albedo, roughness",
        "Reflects light diffusely by Burley's model.",
        "Ci = burley_diffuse_bsdf(N, color(0.8), 0.3);"
    ),
    component!(
        "dielectric_bsdf",
        &["K(n,v,c,c,f,f,f,s,*)"],
        "N, U, reflection_tint, transmission_tint, roughness_x, roughness_y, ior, distribution",
        "Reflects and transmits light at the surface of a dielectric, such as glass.",
        "Ci = dielectric_bsdf(N, dPdu, color(1), color(1), 0.1, 0.1, 1.5, \"ggx\");"
    ),
    component!(
        "conductor_bsdf",
        &["K(n,v,f,f,c,c,s,*)"],
        "N, U, roughness_x, roughness_y, ior, extinction, distribution",
        "Reflects light at the surface of a conductor, such as a metal.",
        "Ci = conductor_bsdf(N, dPdu, 0.1, 0.1, color(0.2, 0.9, 1.1), color(3.9, 2.4, 2.2), \"ggx\");"
    ),
    component!(
        "generalized_schlick_bsdf",
        &["K(n,v,c,c,f,f,c,c,f,s,*)"],
        "N, U, reflection_tint, transmission_tint, roughness_x, roughness_y, f0, f90, exponent, distribution",
        "Scatters light by microfacets with a generalised Schlick term.",
        "Ci = generalized_schlick_bsdf(N, dPdu, color(1), \
         color(0), 0.1, 0.1, color(0.04), color(1), 5, \"ggx\");"
    ),
    component!(
        "translucent_bsdf",
        &["K(n,c,*)"],
        "N, albedo",
        "Transmits light diffusely.",
        "Ci = translucent_bsdf(N, color(0.8));"
    ),
    component!(
        "transparent_bsdf",
        &["K(*)"],
        "",
        "Transmits light straight through the surface.",
        "Ci = transparent_bsdf();"
    ),
    component!(
        "subsurface_bssrdf",
        &["K(n,c,f,c,f,*)", "K(n,c,c,f,*)"],
        "N, albedo, transmission_depth, transmission_color, anisotropy | N, albedo, radius, anisotropy",
        "Scatters light below the surface.",
        "Ci = subsurface_bssrdf(N, color(0.8), color(1, 0.4, 0.2), 0);"
    ),
    component!(
        "sheen_bsdf",
        &["K(n,c,f,*)"],
        "N, albedo, roughness",
        "Scatters light back, as cloth does.",
        "Ci = sheen_bsdf(N, color(0.8), 0.3);"
    ),
    component!(
        "chiang_hair_bsdf",
        &["K(n,v,c,c,c,f,f,f,f,f,f,f,f,c,*)"],
        "N, curve_direction, tint_R, tint_TT, tint_TRT, ior, longitudinal_roughness_R, longitudinal_roughness_TT, longitudinal_roughness_TRT, azimuthal_roughness_R, azimuthal_roughness_TT, azimuthal_roughness_TRT, cuticle_angle, absorption_coefficient",
        "Scatters light as hair does.",
        "Ci = chiang_hair_bsdf(N, dPdu, color(1), color(1), color(1), 1.55, 0.1, 0.05, 0.2, 0.2, 0.1, 0.4, \
         2, color(0.3));"
    ),
    component!(
        "uniform_edf",
        &["K(c,*)"],
        "emittance",
        "Emits light uniformly.",
        "Ci = uniform_edf(color(2, 1, 0.5));"
    ),
    component!(
        "anisotropic_vdf",
        &["K(c,c,f,*)"],
        "albedo, extinction, anisotropy",
        "Scatters light in a volume.",
        "Ci = anisotropic_vdf(color(0.9), color(1), 0.3);"
    ),
    component!(
        "medium_vdf",
        &["K(c,f,c,f,f,i,*)"],
        "albedo, transmission_depth, transmission_color, anisotropy, ior, priority",
        "Describes a medium between dielectrics.",
        "Ci = medium_vdf(color(0.9), 1, color(0.5), 0, 1.33, 0);"
    ),
    component!(
        "layer",
        &["K(K,K,*)"],
        "top, base",
        "Puts the closure `top` over the closure `base`.",
        "Ci = layer(reflection(N, 1.5), diffuse(N));"
    ),
];

/// Components with a `label` even if it is not given.
const LABELLED: [&str; 2] = ["diffuse", "phong"];

/// Writes a component of a name.
pub fn component(b: &mut Builder, s: &Site<'_>, name: &str) -> Emitted {
    let params = s.signature.params.len();
    let (values, shapes) = values(b, s, 0);
    finish(b, s, name, (values, shapes), params)
}

/// Makes the component from parameters and the names and values of keyword arguments after them. A name that
/// is not a literal, or has no value, is itself a value.
fn finish(
    b: &mut Builder,
    s: &Site<'_>,
    name: &str,
    (values, shapes): (Vec<ValueId>, Vec<Shape>),
    params: usize,
) -> Emitted {
    let mut kept: (Vec<ValueId>, Vec<Shape>) = (Vec::new(), Vec::new());
    let mut at = 0;
    let given = s.args.len() - s.signature.params.len();
    for (index, mut shape) in shapes.into_iter().enumerate() {
        let count = shape.count as usize;
        let own = values.get(at..at + count).unwrap_or(&[]);
        at += count;
        let key = |n: usize| s.literal(s.args.len() - given + n);
        match index.checked_sub(params) {
            Some(n) if n % 2 == 0 && n + 1 < given && key(n).is_some() => continue,
            Some(n) if n % 2 == 1 => shape.key = key(n - 1).cloned(),
            _ => {}
        }
        kept.0.extend_from_slice(own);
        kept.1.push(shape);
    }
    let labelled = kept.1.iter().any(|shape| shape.key.as_deref() == Some("label"));
    if LABELLED.contains(&name) && !labelled {
        kept.0.push(b.constant(Const::Str("".into())));
        kept.1.push(Shape { kind: Kind::Str, count: 1, key: Some("label".into()) });
    }
    b.kernel(Kernel::Component { name: name.into(), shapes: kept.1 }, &kept.0, Kind::Closure).into()
}

fn microfacet(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.signature.params.len() == 7 {
        return component(b, s, "microfacet");
    }
    // The short form has no tangent, and one roughness for both directions.
    let (mut values, mut shapes) = values(b, s, 0);
    let tangent = b.constant(Const::Triple([0.0; 3]));
    let alpha = s.arg(2);
    values.splice(2..2, [tangent, alpha]);
    let shape = |kind| Shape { kind, count: 1, key: None };
    shapes.splice(2..2, [shape(Kind::Triple), shape(Kind::Float)]);
    finish(b, s, "microfacet", (values, shapes), 7)
}

fn reflection(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.signature.params.len() == 2 {
        return component(b, s, "reflection");
    }
    let (mut values, mut shapes) = values(b, s, 0);
    values.insert(1, b.float(0.0));
    shapes.insert(1, Shape { kind: Kind::Float, count: 1, key: None });
    finish(b, s, "reflection", (values, shapes), 2)
}
