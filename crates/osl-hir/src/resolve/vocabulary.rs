//! Words of other languages, with their equivalents in OSL: GLSL, HLSL, the RenderMan Shading Language, C and
//! Python.
//!
//! A newcomer writes `lerp` or `vec3`, for which the OSL name with the most similar spelling is the wrong
//! suggestion (`fract` is not `refract`). So this table is searched first.

/// The kind of name that is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NameKind {
    /// Something to call.
    Function,
    /// A variable.
    Variable,
    /// A type.
    Type,
}

/// The OSL equivalent of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Word {
    /// A sentence.
    pub(crate) advice: &'static str,
    /// The replacement, if only the word differs.
    pub(crate) instead: Option<&'static str>,
    /// The text to insert after the arguments of a call, if that and the word are the only differences.
    pub(crate) behind: Option<&'static str>,
}

const fn same(instead: &'static str, advice: &'static str) -> Word {
    Word { advice, instead: Some(instead), behind: None }
}

const fn more(instead: &'static str, behind: &'static str, advice: &'static str) -> Word {
    Word { advice, instead: Some(instead), behind: Some(behind) }
}

const fn said(advice: &'static str) -> Word {
    Word { advice, instead: None, behind: None }
}

/// The OSL equivalent of a word in another language.
pub(crate) fn word(wanted: NameKind, name: &str) -> Option<Word> {
    match wanted {
        NameKind::Function => function(name),
        NameKind::Variable => variable(name),
        NameKind::Type => ty(name),
    }
}

/// What to write instead of a call of a built-in function with this number of arguments, where other
/// languages and older versions have such a form.
///
/// `last` is the type of the last argument.
pub(super) fn other_form(name: &str, arguments: usize, last: Option<&str>) -> Option<String> {
    Some(match (name, arguments) {
        ("atan", 2) => "the arc tangent of a quotient is `atan2(y, x)`".to_string(),
        ("spline" | "splineinverse", 4..) => {
            let ty = last.filter(|ty| ["color", "point", "vector", "normal"].contains(ty)).unwrap_or("float");
            format!("the knots are an array: `{ty} knots[4] = {{ … }};`, then `{name}(\"linear\", x, knots)`")
        }
        ("emission" | "background" | "holdout" | "debug", 1) => {
            "a color scales a closure: `c * emission()`".to_string()
        }
        _ => return None,
    })
}

/// The constants of the language.
pub(super) const CONSTANTS: [&str; 14] = [
    "M_PI",
    "M_PI_2",
    "M_PI_4",
    "M_2_PI",
    "M_2PI",
    "M_4PI",
    "M_2_SQRTPI",
    "M_E",
    "M_LN2",
    "M_LN10",
    "M_LOG2E",
    "M_LOG10E",
    "M_SQRT2",
    "M_SQRT1_2",
];

/// The constant of a module of another language, such as `math.pi`.
pub(super) fn of_module(module: &str, name: &str) -> Option<Word> {
    const IS: &str = "OSL has no modules, and names its constants in capitals";
    if !["math", "Math", "np", "numpy", "glm"].contains(&module) {
        return None;
    }
    Some(match name {
        "pi" | "PI" => same("M_PI", IS),
        "tau" | "TAU" => same("M_2PI", IS),
        "e" | "E" => same("M_E", IS),
        _ => said(IS),
    })
}

/// What OSL has instead of a word of another language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elsewhere {
    /// A sentence.
    pub advice: &'static str,
    /// The name in OSL, if there is a single one.
    pub instead: Option<&'static str>,
}

/// What OSL has instead of a word of another language, whatever the word stands for.
pub fn elsewhere(name: &str) -> Option<Elsewhere> {
    let kinds = [NameKind::Function, NameKind::Variable, NameKind::Type];
    let word = kinds.into_iter().find_map(|wanted| word(wanted, name));
    word.or_else(|| reserved(name)).map(|word| Elsewhere { advice: word.advice, instead: word.instead })
}

/// Words that OSL reserves, and gives no meaning. A source cannot use them, so they are not looked up there.
fn reserved(name: &str) -> Option<Word> {
    Some(match name {
        "bool" => same("int", "OSL has no truth values: use `int`, where 0 is false"),
        "double" | "long" => same("float", "OSL has `float`, of 32 bits"),
        "short" | "char" | "unsigned" | "signed" => same("int", "OSL has `int`, of 32 bits"),
        "false" => same("int", "OSL has no truth values: 0 is false"),
        "switch" | "case" | "default" => same("if", "OSL has no `switch`: use a chain of `if` and `else if`"),
        "class" | "union" => same("struct", "OSL has `struct`, without functions of its own"),
        "enum" => same("int", "OSL has no `enum`: use ints, and macros for their names"),
        _ => return None,
    })
}

/// What to do about a closure that the language does not have.
pub(super) const RENDERERS_CLOSURE: &str = "a closure of a renderer is declared above the shader, with its parameters: `closure color \
                                 sheen(normal N, color c, float r) [[ int builtin = 1 ]];`";

fn function(name: &str) -> Option<Word> {
    Some(match name {
        "lerp" => same("mix", "OSL calls it `mix(a, b, x)`"),
        "fract" | "frac" => more("mod", ", 1", "in OSL it is `mod(x, 1)`"),
        "saturate" => more("clamp", ", 0, 1", "in OSL it is `clamp(x, 0, 1)`"),
        "rsqrt" => same("inversesqrt", "OSL calls it `inversesqrt`"),
        "sqr" | "square" => said("OSL has none: write the value times itself, or `pow(x, 2)`"),
        "cube" => said("OSL has none: write the product, or `pow(x, 3)`"),
        "rcp" => said("OSL has none: write `1 / x`"),
        "mad" | "fma" => said("OSL has none: write `a * b + c`"),
        "rint" | "nearbyint" => same("round", "OSL calls it `round`"),
        "vlength" => same("length", "OSL calls it `length`"),
        "remap" | "fit" | "range" | "efit" => {
            said("in OSL it is `mix(newlow, newhigh, linearstep(low, high, x))`, within the bounds")
        }
        "fit01" => said("in OSL it is `mix(low, high, clamp(x, 0, 1))`"),
        "ifgreater" => said("in OSL it is `a > b ? x : y`"),
        "ifgreatereq" => said("in OSL it is `a >= b ? x : y`"),
        "ifequal" => said("in OSL it is `a == b ? x : y`"),
        "ch" | "chf" | "chi" | "chv" | "chp" | "chs" | "chramp" => {
            said("what a user sets is a parameter of the shader: `shader s(float gain = 1, …)`")
        }
        "clip" => said("OSL draws every point: what is not there is `transparent()`, a closure for `Ci`"),
        "avg" => said("OSL has none: write `(c[0] + c[1] + c[2]) / 3`"),
        "itoa" => said("in OSL it is `format(\"%d\", n)`"),
        "lum" => same("luminance", "OSL calls it `luminance`"),
        "exp10" => said("in OSL it is `pow(10, x)`"),
        "atan2f" => same("atan2", "OSL calls it `atan2`"),
        "sinf" => same("sin", "OSL calls it `sin`"),
        "cosf" => same("cos", "OSL calls it `cos`"),
        "tanf" => same("tan", "OSL calls it `tan`"),
        "sqrtf" => same("sqrt", "OSL calls it `sqrt`"),
        "powf" => same("pow", "OSL calls it `pow`"),
        "fabsf" => same("fabs", "OSL calls it `fabs`"),
        "floorf" => same("floor", "OSL calls it `floor`"),
        "fminf" | "fmin" => same("min", "OSL calls it `min`"),
        "fmaxf" | "fmax" => same("max", "OSL calls it `max`"),
        "dFdx" | "ddx" | "dfdx" | "ddx_fine" | "ddx_coarse" => same("Dx", "OSL calls it `Dx`"),
        "dFdy" | "ddy" | "dfdy" | "ddy_fine" | "ddy_coarse" => same("Dy", "OSL calls it `Dy`"),
        "Du" | "Dv" => said(
            "OSL differentiates by pixels: `Dx`, `Dy`, `Dz`; by the surface's u it is `Dx(f) * Dx(u)` and so on, divided by \
             `Dx(u) * Dx(u) + Dy(u) * Dy(u)`",
        ),
        "fwidth" => same("filterwidth", "OSL calls it `filterwidth`"),
        "texture2D" | "tex2D" | "tex2d" | "textureLod" | "texture2DLod" | "tex2Dlod" => said(
            "in OSL it is `texture(\"file.exr\", u, v)`: the file is named by a string, and there are no samplers",
        ),
        "textureCube" | "texCUBE" => said("in OSL it is `environment(\"file.exr\", direction)`"),
        "rgb" => same("color", "a color is made by `color(r, g, b)`"),
        "hsv" => said("in OSL it is `color(\"hsv\", h, s, v)`"),
        "hsv2rgb" => said("in OSL it is `transformc(\"hsv\", \"rgb\", c)`"),
        "rgb2hsv" => said("in OSL it is `transformc(\"rgb\", \"hsv\", c)`"),
        "ctransform" => same("transformc", "OSL calls it `transformc`"),
        "vtransform" => same("transform", "`transform` knows by its type that the value is a vector"),
        "ntransform" => same("transform", "`transform` knows by its type that the value is a normal"),
        "ptransform" => same("transform", "OSL calls it `transform`"),
        "mul" => {
            said("in OSL it is `transform(m, p)` for a point, a vector or a normal, and `*` for two matrices")
        }
        "inverse" => said("in OSL the inverse of a matrix is `1 / m`"),
        "identity" => said("in OSL the identity matrix is `matrix(1)`"),
        "comp" | "xcomp" | "ycomp" | "zcomp" | "setcomp" | "setxcomp" | "setycomp" | "setzcomp" => {
            said("in OSL components are `c[0]`, `c[1]`, `c[2]`, to read and to write")
        }
        "mod2" | "fmodf" => same("fmod", "OSL calls it `fmod`"),
        "rand" | "random" | "rnd" | "drand48" => said(
            "a shader has to be the same each time: `cellnoise(p)` or `noise(\"hash\", p)` is random, and fixed by `p`",
        ),
        "perlin" | "perlinnoise" | "perlin_noise" => {
            said("in OSL it is `noise(\"perlin\", p)` from -1 to 1, or `noise(\"uperlin\", p)` from 0 to 1")
        }
        "simplex" | "simplexnoise" | "simplex_noise" => {
            said("in OSL it is `noise(\"simplex\", p)` from -1 to 1, or `noise(\"usimplex\", p)` from 0 to 1")
        }
        "cell" | "cell_noise" | "cellNoise" => same("cellnoise", "OSL calls it `cellnoise`"),
        "voronoi" | "worley" | "fbm" | "turbulence" => {
            said("OSL has none built in: write it with `noise` or `cellnoise` in a loop")
        }
        "len" => said(
            "in OSL it is `strlen(s)` for a string, `arraylength(a)` for an array, `length(v)` for a vector",
        ),
        "print" | "println" | "cout" | "puts" => said("in OSL it is `printf(\"%g\\n\", x)`"),
        "sprintf" | "str" | "string" => said("in OSL it is `format(\"%g\", x)`"),
        "strcat" | "append" => same("concat", "OSL calls it `concat`"),
        "strstr" | "find" | "indexOf" => said("in OSL it is `regex_search(s, pattern)`"),
        "atoi" | "parseInt" => same("stoi", "OSL calls it `stoi`"),
        "atof" | "strtof" => same("stof", "OSL calls it `stof`"),
        "ambient" => {
            said("OSL has no ambient light: a surface assigns closures, such as `Ci = Cs * diffuse(N)`")
        }
        "specular" => {
            said("OSL has no lights to sum up: the closure is `microfacet(\"ggx\", N, roughness, eta, 0)`")
        }
        "trace_ray" | "rayTrace" => same("trace", "OSL calls it `trace`"),
        "vec2" | "float2" | "half2" | "Vec2" | "double2" => said(
            "OSL has no pairs of its own: use two floats, or `#include \"vector2.h\"` and `vector2(x, y)`",
        ),
        "vec3" | "float3" | "half3" | "Vec3" | "vec3f" | "double3" | "vector3" => {
            same("vector", "OSL has `vector`, `point`, `normal` and `color` for three numbers")
        }
        "color3" | "Color" | "colour" => same("color", "OSL has `color`"),
        "vec4" | "float4" | "half4" | "Vec4" | "double4" => said(
            "OSL has no fours of its own: use a color and a float, or `#include \"vector4.h\"` and `vector4(x, y, z, w)`",
        ),
        "mat4" | "float4x4" | "mat3" | "float3x3" => same("matrix", "OSL has `matrix`, four by four"),
        _ => return None,
    })
}

fn variable(name: &str) -> Option<Word> {
    Some(match name {
        "PI" | "pi" | "Pi" => same("M_PI", "OSL calls it `M_PI`"),
        "M_TAU" | "TAU" | "tau" | "TWO_PI" | "TWOPI" => same("M_2PI", "OSL calls it `M_2PI`"),
        "HALF_PI" | "PI_2" => same("M_PI_2", "OSL calls it `M_PI_2`"),
        "SQRT2" => same("M_SQRT2", "OSL calls it `M_SQRT2`"),
        "uv" | "st" | "UV" | "texcoord" | "TexCoord" | "vUv" | "v_uv" | "fragCoord" | "gl_FragCoord" => {
            said("in OSL the place on the surface is two floats, `u` and `v`")
        }
        "s" | "t" => said("OSL has `u` and `v`; renderers may give `s` and `t` as parameters of the shader"),
        "iTime" | "Time" | "iGlobalTime" | "u_time" => same("time", "OSL calls it `time`"),
        "Position" | "position" | "pos" | "worldPos" | "WorldPosition" | "gl_Position" => {
            same("P", "OSL calls it `P`, in common space")
        }
        "Normal" | "vNormal" | "worldNormal" => same("N", "OSL calls it `N`"),
        "Cs" | "Os" => said("OSL has no color of the surface: make it a parameter, `color Cs = 1`"),
        "Oi" => {
            said("OSL has no `Oi`: what shines through is a closure, `transparent()`, that is added to `Ci`")
        }
        "discard" => said("OSL draws every point: what is not there is `transparent()`, a closure for `Ci`"),
        "E" => said("OSL has no eye point: `I` is the way from the eye to `P`, so the eye is at `P - I`"),
        "L" | "Cl" | "Ol" => said("OSL has no lights in shaders: a surface assigns closures to `Ci`"),
        "gl_FragColor" | "fragColor" | "out_color" | "FragColor" => {
            said("an OSL shader returns by its outputs: `shader s(output color Cout = 0)`")
        }
        "true" | "True" | "TRUE" => same("1", "OSL has no truth values: 1 is true"),
        "False" | "FALSE" => same("0", "OSL has no truth values: 0 is false"),
        "NULL" | "nullptr" | "None" | "null" => same("0", "an empty closure is `0`, an empty string `\"\"`"),
        "inf" | "INFINITY" | "HUGE_VAL" | "FLT_MAX" => {
            said("OSL has no name for it: write `1e30`, or `1e38` for the largest")
        }
        _ => return None,
    })
}

fn ty(name: &str) -> Option<Word> {
    Some(match name {
        "vec3" | "float3" | "half3" | "Vec3" | "vec3f" | "Vector" | "Vector3" | "dvec3" | "double3"
        | "vector3" => same("vector", "OSL has `vector`, `point`, `normal` and `color` for three numbers"),
        "vec2" | "float2" | "half2" | "Vec2" | "vec2f" | "Vector2" | "dvec2" => {
            said("OSL has no pairs of its own: use two floats, or `#include \"vector2.h\"` and `vector2`")
        }
        "vec4" | "float4" | "half4" | "Vec4" | "vec4f" | "Vector4" | "dvec4" => said(
            "OSL has no fours of its own: use a color and a float, or `#include \"vector4.h\"` and `vector4`",
        ),
        "ivec2" | "ivec3" | "int2" | "int3" | "int4" => {
            said("OSL has no vectors of ints: use an array, `int a[3]`")
        }
        "mat4" | "float4x4" | "mat4x4" | "Matrix" => same("matrix", "OSL has `matrix`, four by four"),
        "mat3" | "float3x3" | "mat2" | "mat3x3" => {
            said("OSL has `matrix`, four by four; `#include \"matrix33.h\"` has one of three by three")
        }
        "half" | "fixed" | "real" | "Float" | "float32" | "f32" => same("float", "OSL has `float`"),
        "uint" | "integer" | "Int" | "int32" | "uint32_t" | "int32_t" | "size_t" | "i32" | "byte" => {
            same("int", "OSL has `int`, of 32 bits")
        }
        "Bool" | "boolean" | "Boolean" => same("int", "OSL has no truth values: use `int`, where 0 is false"),
        "Color" | "rgb" | "RGB" | "colour" | "Colour" | "color3" | "colour3" => {
            same("color", "OSL has `color`")
        }
        "filename" | "File" => same("string", "OSL names files by strings"),
        "then" => same("", "OSL has no `then`: leave it out"),
        "String" | "str" => same("string", "OSL has `string`"),
        "sampler2D" | "samplerCube" | "Texture2D" | "texture2d" | "sampler" => {
            same("string", "OSL names textures by strings")
        }
        "Point" | "point3" => same("point", "OSL has `point`"),
        "Normal" | "normal3" => same("normal", "OSL has `normal`"),
        "let" | "var" | "auto" | "def" => said("a declaration begins with a type: `float x = 1`"),
        "const" | "uniform" | "varying" | "inline" | "static" | "constexpr" | "in" | "inout" => {
            said("OSL has no such word: leave it out")
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtins;

    /// The table must not contain functions or types of OSL, which would never be looked up.
    #[test]
    fn no_word_is_one_of_osl_and_every_replacement_is() {
        for name in builtins::names() {
            assert_eq!(word(NameKind::Function, name), None, "{name}");
        }
        for name in
            ["lerp", "fract", "rsqrt", "dFdx", "saturate", "ctransform", "strcat", "fwidth", "fmin", "atof"]
        {
            let instead = word(NameKind::Function, name).and_then(|word| word.instead);
            assert!(instead.is_some_and(|to| builtins::names().any(|known| known == to)), "{name}");
        }
    }
}
