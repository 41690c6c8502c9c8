//! The operations that renderers' run times know, with the operands that each accepts.

use super::{Operation, Options};

/// The options of texture lookups. An option `missingalpha` with an int is an error at run time.
const LOOKUP: Options = Options::These(&[
    ("width swidth twidth rwidth blur sblur tblur rblur fill time", "n"),
    ("firstchannel", "i"),
    ("subimage", "t"),
    ("wrap swrap twrap rwrap interp errormessage", "s"),
    ("missingcolor", "v"),
    ("missingalpha alpha", "f"),
]);
const GABOR: Options =
    Options::Among(&[("anisotropic do_filter", "i"), ("direction", "v"), ("bandwidth impulses", "n")]);
const TRACE: Options = Options::These(&[("mindist maxdist", "f"), ("shade", "i"), ("traceset", "s")]);

const fn of(names: &'static str, forms: &'static [&'static str]) -> Operation {
    Operation { names, forms, options: Options::Any, jumps: 0, advice: "" }
}

/// All operations. Several names share a row if they take the same operands.
pub(super) const OPERATIONS: &[Operation] = &[
    // Assignment, arithmetic, comparison, logic.
    of("assign", &[">i n", ">f n", ">v a", ">m m", ">m n", ">s s", ">C C", ">C $i", ">T[] T[]"]),
    of("arraycopy", &[">T[] T[]"]),
    of("add", &[">i n n", ">f n n", ">v w w", ">m m m", ">m m f", ">C C C"]),
    of("sub", &[">i n n", ">f n n", ">v w w", ">m m m", ">m m f"]),
    of("mul", &[">i n n", ">f n n", ">v w w", ">m m m", ">m m f", ">m f m", ">C C w", ">C w C"]),
    of("div", &[">i n n", ">f n n", ">v w w", ">m m m", ">m m f", ">m f m"]),
    of("mod fmod", &[">i i i", ">f n n", ">v v w"]),
    of("neg", &[">i n", ">f n", ">v w", ">m m"]),
    of("min max", &[">i n n", ">f n n", ">v w w"]),
    of("clamp", &[">i n n n", ">f n n n", ">v w w w"])
        .advice("it applies the lower bound first, unlike the function: write `min`, then `max`"),
    of("mix", &[">f n n n", ">v w w w"]),
    of("select", &[">f n n a", ">v w w a"]),
    of("eq neq", &[">i a a", ">i m m", ">i m n", ">i n m", ">i s s", ">i C $i", ">i $i C"]),
    of("lt le gt ge", &[">i a a"]),
    of("and or", &[">i n n"]),
    of("bitand bitor xor shl shr", &[">i i i"]),
    of("compl", &[">i i"]),
    // Functions of numbers.
    of(
        "sin cos tan asin acos atan sinh cosh tanh exp exp2 expm1 log log2 log10 sqrt inversesqrt cbrt erf erfc \
         logb floor ceil round trunc sign",
        &[">f f", ">v v"],
    ),
    of("abs fabs", &[">f f", ">v v", ">i i"]),
    of("atan2 step", &[">f f f", ">v v v"]),
    of("pow", &[">f f f", ">v v v", ">v v f"]),
    of("smoothstep", &[">f f f f"]),
    of("isnan isinf isfinite", &[">i f"]),
    of("sincos", &["f >f >f", "v >v >v"]),
    of("dot distance", &[">f v v"]),
    of("cross", &[">v v v"]),
    of("length luminance", &[">f v"]),
    of("normalize", &[">v v"]),
    of("determinant", &[">f m"]),
    of("transpose", &[">m m"]),
    of("hash", &[">i i", ">i f", ">i f f", ">i v", ">i v f", ">i s"]),
    of("degrees radians", &[">f $f", ">v $v"]).advice("it needs a constant operand"),
    of("strlen stoi", &[">i s"]),
    of("stof", &[">f s"]),
    of("getchar", &[">i s i"]),
    of("startswith endswith", &[">i s s"]),
    of("concat", &[">s s s", ">s $s $s $s…"]),
    of("substr", &[">s s i i"]),
    of("strtoi", &[">i $s"]).advice("write `stoi`"),
    of("strtof", &[">f $s"]).advice("write `stof`"),
    // Constructors and spaces.
    of("color point vector normal", &[">v n n n", ">v s n n n"]),
    of("matrix", &[">m f", ">m f16", ">m s f", ">m s f16", ">m s s"]),
    of("getmatrix", &[">i s s >m"]),
    of("transform transformv transformn", &[">v m v", ">v s s v"]),
    of("transformc", &[">v s s v"]),
    of("blackbody wavelength_color", &[">v f"]),
    // Components and arrays.
    of("compref", &[">f v i"]),
    of("compassign", &[">v i n"]),
    of("mxcompref", &[">f m i i"]),
    of("mxcompassign", &[">m i i n"]),
    of("aref", &[">T T[] i"]),
    of("aassign", &[">T[] i T", ">i[] i n", ">f[] i n", ">v[] i f"]),
    of("arraylength", &[">n @[]"]),
    // Derivatives and the state of shading.
    of("Dx Dy Dz filterwidth", &[">f 'f", ">v 'v"]),
    of("area", &[">f 'v"]),
    of("calculatenormal", &[">v 'v"]),
    of("backfacing", &[">i"]),
    of("surfacearea", &[">f"]),
    of("raytype", &[">i s"]),
    of("isconnected isconstant", &[">i @"]),
    // Noise. A name that is a constant other than "gabor" needs no derivatives.
    of(
        "noise",
        &[">w f", ">w f f", ">w v", ">w v f", ">w s 'f *", ">w s 'f 'f *", ">w s 'v *", ">w s 'v 'f *"],
    )
    .options(GABOR),
    of(
        "pnoise",
        &[
            ">w f f",
            ">w f f f f",
            ">w v v",
            ">w v f v f",
            ">w s 'f 'f *",
            ">w s 'f 'f 'f 'f *",
            ">w s 'v 'v *",
            ">w s 'v 'f 'v 'f *",
        ],
    )
    .options(GABOR),
    of("snoise cellnoise hashnoise", &[">w f", ">w f f", ">w v", ">w v f"]),
    of("psnoise", &[">w f f", ">w f f f f", ">w v v", ">w v f v f"]),
    // Lookups, rays, closures.
    of("texture", &[">w s 'f 'f *", ">w s f f f f f f *"]).options(LOOKUP),
    of("texture3d", &[">w s 'v *", ">w s v v v v *"]).options(LOOKUP),
    of("environment", &[">w s 'v *", ">w s v v v *"]).options(LOOKUP),
    of("gettextureinfo", &[">i s s >x", ">i s f f s >x"]),
    of("trace", &[">i 'v 'v *"]).options(TRACE),
    of("closure", &[">C $s ?…"]),
    of("spline", &[">f s f f[]", ">f s f i f[]", ">v s f v[]", ">v s f i v[]"]),
    of("splineinverse", &[">f s f f[]", ">f s f i f[]"]),
    of("pointcloud_search", &[">i s v f i *", ">i s v f i i *"]).options(Options::Written),
    of("pointcloud_get", &[">i s i[] i s >x[]"]),
    of("pointcloud_write", &[">i s v *"]),
    // Questions to the renderer, messages, texts.
    of("getattribute", &[">i s >x", ">i s i >x", ">i s s >x", ">i s s i >x"]),
    of("getmessage", &[">i s >?", ">i s s >?"]),
    of("setmessage", &["s ?"]),
    of("regex_search regex_match", &[">i s s", ">i s >i[] s"]),
    of("split", &[">i s >s[]", ">i s >s[] s", ">i s >s[] s i"]),
    of("dict_find", &[">i s s", ">i i s"]),
    of("dict_next", &[">i i"]),
    of("dict_value", &[">i i s >x"]),
    of("printf warning error", &["s ?…"]),
    of("format", &[">s s ?…"]),
    of("fprintf", &["s s ?…"]),
    // Control. The run time tests numbers and triples in `if`, but only ints in loops.
    of("if", &["a", "m"]).jumps(2),
    of("for while dowhile", &["i"]).jumps(4),
    of("functioncall functioncall_nr", &["$s"]).jumps(1),
    of("break continue return exit end", &[""]),
    of("useparam nop", &["@…", ""]),
];
