//! Closures: how a surface scatters or emits light, as data that a renderer reads. A component keeps its name and
//! the values of its parameters; weights come from the arithmetic around it.

use super::print::values;
use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Const, Kernel, Kind, Shape, ValueId};

/// A row for a component whose arguments are its parameters, in order.
macro_rules! component {
    ($name:literal, $sigs:expr, $about:literal) => {
        Builtin::compose($name, $sigs, |b, s| component(b, s, $name), $about)
    };
}

pub(super) static ROWS: &[Builtin] = &[
    component!("emission", &["K(*)"], "Light that the surface gives off."),
    component!("background", &["K(*)"], "Light of the background."),
    component!("transparent", &["K(*)"], "Light that passes straight through."),
    component!("holdout", &["K(*)"], "A hole in the picture's alpha."),
    component!("debug", &["K(s,*)"], "Marks a component with a tag."),
    component!("diffuse", &["K(n,*)"], "Lambert reflection about N."),
    component!("translucent", &["K(n,*)"], "Lambert transmission."),
    component!("oren_nayar", &["K(n,f,*)"], "Diffuse reflection of a rough surface; sigma is its roughness."),
    component!("phong", &["K(n,f,*)"], "Phong reflection with an exponent."),
    component!("ward", &["K(n,v,f,f,*)"], "Anisotropic Ward reflection about a tangent."),
    Builtin::compose(
        "microfacet",
        &["K(s,n,v,f,f,f,i,*)", "K(s,n,f,f,i,*)"],
        microfacet,
        "Microfacets of a distribution, reflecting, refracting or both.",
    ),
    Builtin::compose("reflection", &["K(n,f,*)", "K(n,*)"], reflection, "Mirror reflection."),
    component!("refraction", &["K(n,f,*)"], "Sharp refraction."),
    component!(
        "subsurface",
        &["K(f,f,c,c,*)"],
        "Scattering below the surface: eta, g, mean free path, albedo."
    ),
    component!("oren_nayar_diffuse_bsdf", &["K(n,c,f,*)"], "Oren-Nayar diffuse reflection."),
    component!("burley_diffuse_bsdf", &["K(n,c,f,*)"], "Burley diffuse reflection."),
    component!("dielectric_bsdf", &["K(n,v,c,c,f,f,f,s,*)"], "Reflection and transmission of a dielectric."),
    component!("conductor_bsdf", &["K(n,v,f,f,c,c,s,*)"], "Reflection of a conductor."),
    component!(
        "generalized_schlick_bsdf",
        &["K(n,v,c,c,f,f,c,c,f,s,*)"],
        "Microfacets with a generalised Schlick term."
    ),
    component!("translucent_bsdf", &["K(n,c,*)"], "Diffuse transmission."),
    component!("transparent_bsdf", &["K(*)"], "Straight transmission."),
    component!("subsurface_bssrdf", &["K(n,c,f,c,f,*)", "K(n,c,c,f,*)"], "Scattering below the surface."),
    component!("sheen_bsdf", &["K(n,c,f,*)"], "Back-scattering of cloth."),
    component!("chiang_hair_bsdf", &["K(n,v,c,c,c,f,f,f,f,f,f,f,f,c,*)"], "Scattering of hair."),
    component!("uniform_edf", &["K(c,*)"], "Uniform emission."),
    component!("anisotropic_vdf", &["K(c,c,f,*)"], "Scattering of a volume."),
    component!("medium_vdf", &["K(c,f,c,f,f,i,*)"], "A medium between dielectrics."),
    component!("layer", &["K(K,K,*)"], "One closure over another."),
];

/// Components whose `label` exists even where it is not given.
const LABELLED: [&str; 2] = ["diffuse", "phong"];

fn component(b: &mut Builder, s: &Site<'_>, name: &'static str) -> Emitted {
    let params = s.signature.params.len();
    let (values, shapes) = values(b, s, 0);
    finish(b, s, name, (values, shapes), params)
}

/// Makes the component of parameters and, behind them, names and values of keyword arguments.
fn finish(
    b: &mut Builder,
    s: &Site<'_>,
    name: &'static str,
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
        let tail = index.checked_sub(params);
        match tail {
            Some(n) if n % 2 == 0 => continue,
            Some(n) => shape.key = s.literal(s.args.len() - given + n - 1).cloned(),
            None => {}
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
