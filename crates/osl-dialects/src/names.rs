//! The form of `dialect.toml`.

use serde::Deserialize;
use std::collections::BTreeMap;

/// Why a folder is no dialect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the dialect `{dialect}`: {why}")]
pub struct Error {
    /// Its name.
    pub dialect: String,
    /// The reason.
    pub why: String,
}

/// The names of a dialect.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Names {
    /// The renderer.
    pub title: String,
    /// A paragraph about it, Markdown.
    pub about: String,
    /// Where the facts come from.
    #[serde(default)]
    pub sources: Vec<String>,
    /// The header that is read before every shader, in place of `stdosl.h`, which it includes.
    pub prelude: Option<String>,
    /// How a file shows that it is in this dialect.
    #[serde(default)]
    pub signs: Signs,
    /// How a value answers requests of other types than its own.
    #[serde(default)]
    pub types: Rule,
    /// Whether the name of an object is ignored unless the object is listed.
    #[serde(default)]
    pub any_object: bool,
    /// Attributes of the surface and the renderer.
    #[serde(default)]
    pub attributes: BTreeMap<String, Attribute>,
    /// Attributes that are asked of a named object.
    #[serde(default)]
    pub objects: BTreeMap<String, BTreeMap<String, Attribute>>,
    /// Spaces, with their meaning.
    #[serde(default)]
    pub spaces: BTreeMap<String, String>,
    /// Kinds of rays.
    #[serde(default)]
    pub rays: Vec<String>,
    /// Messages of `getmessage`, with their meaning.
    #[serde(default)]
    pub messages: BTreeMap<String, String>,
    /// Metadata, with their meaning.
    #[serde(default)]
    pub metadata: BTreeMap<String, String>,
    /// Outputs with a meaning.
    #[serde(default)]
    pub outputs: BTreeMap<String, Output>,
    /// What the renderer does otherwise than the language.
    #[serde(default)]
    pub quirks: Quirks,
    /// What the renderer lacks.
    #[serde(default)]
    pub lacks: Lacks,
    /// Names whose meaning is not public, with what happens here.
    #[serde(default)]
    pub unknown: BTreeMap<String, String>,
}

impl Names {
    /// Checks that each default has the type of its attribute.
    pub(crate) fn check(&self) -> Result<(), String> {
        let all = self.objects.values().flatten().chain(&self.attributes);
        for (name, attribute) in all {
            if let Some(default) = &attribute.default
                && Value::read(&attribute.ty, default).is_none()
            {
                return Err(format!("the default of `{name}` is no {}", attribute.ty));
            }
        }
        Ok(())
    }
}

/// An output with a meaning.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// What it is for.
    pub about: String,
    /// What a picture does with it, if anything.
    pub role: Option<Role>,
}

/// What a picture does with an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The part of the surface that lets the light behind it through.
    Transparency,
}

/// How a file shows that it is in a dialect. In names, a `*` is for any characters.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Signs {
    /// Included headers.
    pub includes: Vec<String>,
    /// Called functions, unless the file defines them: `name`, or `name(first` with the first token of the
    /// first argument.
    pub calls: Vec<String>,
    /// Names in calls of `getattribute`.
    pub attributes: Vec<String>,
    /// Names of metadata.
    pub metadata: Vec<String>,
    /// Outputs, with their types.
    pub outputs: Vec<String>,
    /// Macros and other words.
    pub words: Vec<String>,
}

/// How a value answers requests of other types than its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Only its own type; three floats answer any triple.
    #[default]
    Exact,
    /// A float answers triples; two or three floats answer a float (their mean) and triples; an int only an
    /// int.
    Mean,
    /// As assignments do: an int answers a float, a number a triple.
    Widen,
}

/// An attribute.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attribute {
    /// Its type: `int`, `float`, `string`, `matrix`, `float2`, `float3`, `float4`, or an array such as
    /// `int[2]`.
    #[serde(rename = "type")]
    pub ty: String,
    /// What of the points or the run it is; none if it is always the default.
    pub source: Option<Source>,
    /// Its value where nothing provides one; without one, it is not answered there.
    pub default: Option<toml::Value>,
    /// Whether the default is a choice of this project, because the renderer has none for a single surface.
    #[serde(default)]
    pub choice: bool,
    /// What it is.
    pub about: String,
}

/// What of the points or the run an attribute is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The surface coordinates.
    Uv,
    /// The first surface coordinate.
    U,
    /// The second surface coordinate.
    V,
    /// The position in the bounding box of the surface, from 0 to 1.
    Generated,
    /// The unit tangent along u.
    Tangent,
    /// The position in common space.
    Position,
    /// The normal in common space.
    Normal,
    /// The position in object space.
    #[serde(rename = "object-position")]
    ObjectPosition,
    /// The normal in object space.
    #[serde(rename = "object-normal")]
    ObjectNormal,
    /// The position in the picture, from 0 to 1.
    Window,
    /// The center of the object in common space.
    Location,
    /// A number for each object, from 0 to 1.
    Random,
    /// The number of the point.
    Index,
    /// The change of u to the next pixel.
    Du,
    /// The change of v to the next pixel.
    Dv,
    /// The time, in seconds.
    Time,
    /// The frame.
    Frame,
    /// Columns and rows of the picture.
    Resolution,
    /// The version of the language as a number.
    Version,
}

impl Source {
    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Source::Uv => "u, v",
            Source::U => "u",
            Source::V => "v",
            Source::Generated => "P in the box around the surface",
            Source::Tangent => "the direction of dPdu",
            Source::Position => "P",
            Source::Normal => "N",
            Source::ObjectPosition => "P in object space",
            Source::ObjectNormal => "N in object space",
            Source::Window => "the place in the picture; on the patch u, v",
            Source::Location => "the origin of object space",
            Source::Random => "a number for each surface of a scene; 0.5 without a scene",
            Source::Index => "the number of the point",
            Source::Du => "the derivative of u",
            Source::Dv => "the derivative of v",
            Source::Time => "the time",
            Source::Frame => "the frame",
            Source::Resolution => "the size of the picture",
            Source::Version => "OSL_VERSION",
        }
    }
}

/// What a renderer does otherwise than the language.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Quirks {
    /// A quotient of two constants with divisor 0 is infinite.
    pub infinite_quotients: bool,
    /// The int in `getattribute(name, int, array)` is the length of the array, not an element.
    pub index_is_length: bool,
    /// The metadata by which a parameter takes the time (float) or the frame (int).
    pub time_metadata: Option<String>,
}

/// What a renderer lacks, each with the reason or the effect.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Lacks {
    /// Why there are no closures at all.
    pub all_closures: Option<String>,
    /// The only closures that have an effect.
    pub only_closures: Vec<String>,
    /// Closures.
    pub closures: BTreeMap<String, String>,
    /// Functions.
    pub functions: BTreeMap<String, String>,
    /// Kinds of noise.
    pub noises: BTreeMap<String, String>,
    /// Globals.
    pub globals: BTreeMap<String, String>,
    /// Kinds of parameters: `struct`, `array`, `matrix`, `closure`.
    pub parameters: BTreeMap<String, String>,
    /// Kinds of shaders: `surface`, `displacement`, `volume`, `shader`.
    pub kinds: BTreeMap<String, String>,
    /// Why there are no includes.
    pub includes: Option<String>,
}

impl Lacks {
    /// All of it: what, with the reason.
    pub(crate) fn all(&self) -> BTreeMap<String, String> {
        let Lacks {
            all_closures,
            only_closures,
            closures,
            functions,
            noises,
            globals,
            parameters,
            kinds,
            includes,
        } = self;
        let one = |name: &str, why: &Option<String>| why.as_ref().map(|why| (name.to_string(), why.clone()));
        let mut all: BTreeMap<String, String> = BTreeMap::new();
        all.extend(one("closures", all_closures));
        all.extend(one("#include", includes));
        if !only_closures.is_empty() {
            all.insert(
                "other closures".to_string(),
                format!("only {} have an effect", only_closures.join(", ")),
            );
        }
        let named =
            |list: &BTreeMap<String, String>, form: &dyn Fn(&str) -> String| -> Vec<(String, String)> {
                list.iter().map(|(name, why)| (form(name), why.clone())).collect()
            };
        all.extend(named(closures, &str::to_string));
        all.extend(named(functions, &|name| format!("{name}()")));
        all.extend(named(noises, &|name| format!("noise(\"{name}\", …)")));
        all.extend(named(globals, &str::to_string));
        all.extend(named(parameters, &|name| format!("parameter: {name}")));
        all.extend(named(kinds, &|name| format!("kind: {name}")));
        all
    }
}

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Ints: one, or the elements of an array.
    Ints(Vec<i32>),
    /// Floats: one, the components of a triple, or the elements of an array.
    Floats(Vec<f32>),
    /// A string.
    Text(String),
}

impl Attribute {
    /// Its default; `None` if nothing answers in place of a scene.
    pub fn value(&self) -> Option<Value> {
        Value::read(&self.ty, self.default.as_ref()?)
    }

    /// Its default as text.
    pub fn shown(&self) -> String {
        self.value().map_or_else(String::new, |value| value.to_string())
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        fn list<T: std::fmt::Display>(values: &[T]) -> String {
            let all: Vec<String> = values.iter().map(T::to_string).collect();
            if all.len() == 1 { all.concat() } else { format!("({})", all.join(", ")) }
        }
        match self {
            Value::Ints(values) => f.write_str(&list(values)),
            Value::Floats(values) => f.write_str(&list(values)),
            Value::Text(text) => write!(f, "\"{text}\""),
        }
    }
}

impl Value {
    /// Reads a value of a type; `None` if it is of another one.
    pub fn read(ty: &str, value: &toml::Value) -> Option<Value> {
        let list = match value {
            toml::Value::Array(list) => list.as_slice(),
            one => std::slice::from_ref(one),
        };
        let float =
            |x: &toml::Value| x.as_float().or_else(|| x.as_integer().map(|n| n as f64)).map(|x| x as f32);
        let floats = || list.iter().map(float).collect::<Option<Vec<f32>>>();
        let ints = || list.iter().map(|x| i32::try_from(x.as_integer()?).ok()).collect::<Option<Vec<i32>>>();
        let (value, n) = match ty {
            "string" => return value.as_str().map(|text| Value::Text(text.to_string())),
            "int" => (Value::Ints(ints()?), 1),
            "float" => (Value::Floats(floats()?), 1),
            "float2" => (Value::Floats(floats()?), 2),
            "float3" => (Value::Floats(floats()?), 3),
            "float4" => (Value::Floats(floats()?), 4),
            "matrix" => (Value::Floats(floats()?), 16),
            array => {
                let (base, n) = array.strip_suffix(']')?.split_once('[')?;
                let n: usize = n.parse().ok()?;
                match base {
                    "int" => (Value::Ints(ints()?), n),
                    "float" => (Value::Floats(floats()?), n),
                    _ => return None,
                }
            }
        };
        (list.len() == n).then_some(value)
    }
}
