//! Words that the language gives a meaning within texts and metadata.

/// Coordinate spaces that renderers usually know. Source: OSL language specification, geometric functions.
pub(crate) const SPACES: [&str; 8] =
    ["common", "world", "object", "shader", "camera", "screen", "raster", "NDC"];

/// Color spaces. Source: OSL language specification, color functions.
pub(crate) const COLORS: [&str; 9] = ["rgb", "RGB", "hsv", "hsl", "YIQ", "XYZ", "xyY", "sRGB", "linear"];

/// Names of metadata with their types and meanings. Source: OSL language specification, metadata.
pub(crate) const METADATA: [(&str, &str, &str); 18] = [
    ("label", "string", "The name that users see."),
    ("units", "string", "The unit of the value, such as `cm`, `sec` or `deg`."),
    ("help", "string", "A sentence about the parameter."),
    ("page", "string", "The group of parameters to which it belongs; `/` separates groups within groups."),
    ("widget", "string", "How the parameter is edited."),
    (
        "options",
        "string",
        "The choices of a `popup` or `mapper`, separated by `|`; of a mapper, `name:value`.",
    ),
    ("min", "float", "The smallest permitted value."),
    ("max", "float", "The largest permitted value."),
    ("sensitivity", "float", "The smallest step of the value."),
    ("digits", "int", "The number of digits that are shown."),
    ("slider", "int", "Whether there is a slider: 1 or 0."),
    ("slidermin", "float", "The value at the left end of the slider."),
    ("slidermax", "float", "The value at the right end of the slider."),
    ("slidercenter", "float", "The value in the middle of the slider."),
    ("sliderexponent", "float", "How values are distributed along the slider."),
    ("lockgeom", "int", "0 if data of the geometry may replace the value."),
    ("connectable", "int", "0 if no layer may be connected to it."),
    ("URL", "string", "Where the documentation is."),
];

/// Values of the metadatum `widget`. Source: OSL language specification, metadata.
pub(crate) const WIDGETS: [(&str, &str); 8] = [
    ("number", "a field or slider for a number"),
    ("string", "a field for text"),
    ("boolean", "a pop-up with yes and no"),
    ("checkBox", "a box to check"),
    ("popup", "a menu of the `options`"),
    ("mapper", "a menu of the `options`, which stand for numbers"),
    ("filename", "a choice of files"),
    ("null", "hidden"),
];

/// Directives of the preprocessor.
pub(crate) const DIRECTIVES: [&str; 12] = [
    "include", "define", "undef", "if", "ifdef", "ifndef", "elif", "else", "endif", "pragma", "error",
    "warning",
];

/// Words of the grammar, as colors show them.
pub(crate) const KEYWORDS: [&str; 16] = [
    "break",
    "continue",
    "do",
    "else",
    "for",
    "if",
    "output",
    "return",
    "struct",
    "while",
    "shader",
    "surface",
    "displacement",
    "volume",
    "and",
    "or",
];

/// Types of the language.
pub(crate) const TYPES: [&str; 10] =
    ["int", "float", "color", "point", "vector", "normal", "matrix", "string", "void", "closure"];

/// Functions whose text arguments name coordinate spaces.
pub(crate) const TAKE_SPACES: [&str; 8] =
    ["transform", "point", "vector", "normal", "matrix", "getmatrix", "displace", "bump"];

/// Functions whose text arguments name color spaces.
pub(crate) const TAKE_COLORS: [&str; 2] = ["color", "transformc"];
