//! Calls: of built-ins, according to the signatures in their table, and of the program's own functions.

use super::place::Want;
use super::{Gen, Pass, Scope, Ty, VALUES, word};
use osl_hir::builtins::{self, ParamType, Signature, Tail};
use osl_ir::types::{Base, Extent, Type};
use std::sync::OnceLock;

/// A function in one of its forms.
#[derive(Clone, Copy)]
struct Form {
    name: &'static str,
    signature: &'static Signature,
    /// Whether another form differs only in the result, so that the call must have a cast.
    cast: bool,
}

/// Calls that are statements of another kind, or constructors with special names.
fn is_call(name: &str) -> bool {
    !name.contains(' ') && name != "exit"
}

fn forms(scope: Scope) -> &'static [Form] {
    static FORMS: [OnceLock<Vec<Form>>; 2] = [OnceLock::new(), OnceLock::new()];
    let of = |scope: Scope| {
        let mut forms = Vec::new();
        for row in builtins::all().filter(|row| is_call(row.name)) {
            let all = row.signatures();
            for signature in all {
                let twin = |s: &Signature| s.params == signature.params && s.ret != signature.ret;
                let form = Form { name: row.name, signature, cast: all.iter().any(twin) };
                if scope == Scope::All || is_walked(&form) {
                    forms.push(form);
                }
            }
        }
        forms
    };
    match scope {
        Scope::All => FORMS[0].get_or_init(|| of(scope)),
        Scope::Walked => FORMS[1].get_or_init(|| of(scope)),
    }
}

/// Whether the walker knows a form.
fn is_walked(form: &Form) -> bool {
    let params = &form.signature.params;
    let takes = |ty: Type| params.iter().any(|p| p.ty == ParamType::Of(ty));
    osl_walker::knows(form.name)
        && !takes(Type::CLOSURE)
        && match form.name {
            "noise" | "snoise" => !takes(Type::STRING),
            "faceforward" => params.len() == 3,
            _ => true,
        }
}

fn letter(ty: Type) -> char {
    match ty.base {
        Base::Int => 'i',
        Base::Float => 'f',
        Base::Color => 'c',
        Base::Point => 'p',
        Base::Vector => 'v',
        Base::Normal => 'n',
        Base::Matrix => 'm',
        Base::String => 's',
        Base::Closure => 'K',
        _ => 'x',
    }
}

/// Meaningful strings for a function, by position of the parameter.
fn texts(function: &str, position: usize) -> Option<&'static [&'static str]> {
    Some(match (function, position) {
        ("noise" | "snoise" | "pnoise" | "psnoise", 0) => {
            &["perlin", "uperlin", "noise", "snoise", "cell", "hash", "simplex", "usimplex", "gabor", "null"]
        }
        ("transformc", _) => &["rgb", "hsv", "hsl", "YIQ", "XYZ", "xyY", "sRGB", "linear"],
        ("transform" | "getmatrix", _) => SPACES,
        ("transformu", _) => &["mm", "mi", "common", "object", "s", "frames", "nowhere"],
        ("texture" | "environment" | "gettextureinfo", 0) => &["tex64.png", "none.png"],
        ("gettextureinfo", _) => &["exists", "resolution", "channels", "averagecolor", "nothing"],
        ("spline" | "splineinverse", _) => {
            &["linear", "catmull-rom", "bezier", "bspline", "hermite", "constant"]
        }
        ("regex_search" | "regex_match", n) if n > 0 => &["[a-z]+", "(h)(e)l*", "^.$", "[0-9.e-]*", "x|b"],
        ("microfacet", _) => &["ggx", "beckmann"],
        ("setmessage" | "getmessage", _) => &["m0", "m1", "m2"],
        ("getattribute", _) => &["s", "camera:resolution", "osl:version", "nothing"],
        ("dict_find", 0) => &["<a><b x='1 2 3'>text</b><b x='4'/></a>", "<", ""],
        ("dict_find", _) => &["/a/b", "b", "//b", "nothing"],
        ("dict_value", _) => &["x", "", "y"],
        ("raytype", _) => &["camera", "shadow"],
        ("format" | "printf" | "fprintf" | "error" | "warning", _) => &["f"],
        ("texture3d" | "debug" | "dielectric_bsdf" | "conductor_bsdf" | "generalized_schlick_bsdf", _) => {
            &["ggx"]
        }
        _ => return None,
    })
}

const SPACES: &[&str] =
    &["common", "world", "shader", "object", "camera", "screen", "NDC", "raster", "nowhere"];

impl Gen<'_> {
    fn quoted(&mut self, list: &[&str]) -> String {
        format!("\"{}\"", self.bytes.pick(list))
    }

    pub(super) fn space(&mut self) -> String {
        if self.bytes.chance(20) {
            return self.leaf_string();
        }
        self.quoted(SPACES)
    }

    fn leaf_string(&mut self) -> String {
        self.expr('s', 0)
    }

    pub(super) fn color_space(&mut self) -> String {
        self.quoted(&["rgb", "hsv", "hsl", "YIQ", "XYZ", "xyY"])
    }

    /// A call that returns a type, given by its letter; `'x'` for no result. `None` if the necessary
    /// arguments are not available.
    pub(super) fn call_of(&mut self, ret: char, depth: usize) -> Option<String> {
        if self.bytes.chance(70)
            && let Some(call) = self.own_call(Ty::One(ret), depth)
        {
            return Some(call);
        }
        let fitting: Vec<Form> =
            forms(self.scope).iter().filter(|form| letter(form.signature.ret) == ret).copied().collect();
        if fitting.is_empty() {
            return None;
        }
        let at = (self.bytes.byte() as usize) << 8 | self.bytes.byte() as usize;
        self.form_call(fitting[at % fitting.len()], depth)
    }

    pub(super) fn own_call(&mut self, ret: Ty, depth: usize) -> Option<String> {
        let fitting: Vec<usize> =
            (0..self.functions.len()).filter(|n| self.functions[*n].ret == ret).collect();
        let at = *fitting.get(self.bytes.below(fitting.len()))?;
        let function = self.functions[at].clone();
        let mut args: Vec<String> = Vec::new();
        for (n, (ty, pass)) in function.params.iter().enumerate() {
            // Sometimes one variable is the argument of two formals.
            let twin = |m: &usize| {
                let (other, how) = function.params[*m];
                other == *ty && (*pass == Pass::In || how != Pass::In)
            };
            let twin = (0..n).find(twin);
            let arg = match twin {
                Some(twin) if self.bytes.chance(60) => args[twin].clone(),
                _ => self.argument(*ty, *pass, depth)?,
            };
            args.push(arg);
        }
        Some(format!("{}({})", function.name, args.join(", ")))
    }

    fn argument(&mut self, ty: Ty, pass: Pass, depth: usize) -> Option<String> {
        let write = pass != Pass::In;
        let depth = depth.saturating_sub(1);
        match ty {
            Ty::One(letter) if write => {
                let triple = matches!(letter, 'c' | 'p' | 'v' | 'n');
                let letter =
                    if triple && self.bytes.chance(30) { self.bytes.pick(&['c', 'v', 'p']) } else { letter };
                self.place(Ty::One(letter), true)
            }
            Ty::One(letter) => Some(self.expr(letter, depth)),
            Ty::Struct(_) if write => self.place(ty, true),
            Ty::Struct(id) => Some(self.struct_value(id, depth, true)),
            ty => {
                let want = match ty {
                    Ty::Open(letter) => Want::Array(letter),
                    Ty::OpenStructs(id) => Want::Structs(id),
                    ty => Want::Exactly(ty),
                };
                if !write && self.bytes.chance(60) {
                    return Some(self.list(ty, depth));
                }
                self.find(want, write)
            }
        }
    }

    fn form_call(&mut self, form: Form, depth: usize) -> Option<String> {
        let mut args = Vec::new();
        for (position, param) in form.signature.params.iter().enumerate() {
            args.push(match param.ty {
                ParamType::Of(ty) if ty.extent == Extent::Unsized => self.array(letter(ty), param.output)?,
                ParamType::Of(ty) if param.output => self.place(Ty::One(letter(ty)), true)?,
                ParamType::Of(ty) if letter(ty) == 's' => self.string_for(form.name, position, depth),
                ParamType::Of(ty) => self.expr(letter(ty), depth.saturating_sub(1)),
                ParamType::Any { array } => self.anything(array, param.output, depth)?,
            });
        }
        match form.signature.tail {
            Tail::None => {}
            Tail::Any => self.printed(&mut args, depth),
            Tail::KeyValue | Tail::Keywords => self.options(form.name, &mut args, depth),
        }
        let call = format!("{}({})", form.name, args.join(", "));
        Some(if form.cast { format!("({}){call}", word(letter(form.signature.ret))) } else { call })
    }

    fn anything(&mut self, array: bool, output: bool, depth: usize) -> Option<String> {
        let letter = self.value_letter();
        match (array, output) {
            (true, _) => self.array(letter, output),
            (false, true) => self.place(Ty::One(letter), true),
            (false, false) => Some(self.expr(letter, depth.saturating_sub(1))),
        }
    }

    fn string_for(&mut self, function: &str, position: usize, depth: usize) -> String {
        match texts(function, position) {
            Some(list) => {
                // Names that must be literals, and names that may be computed.
                let open = matches!(function, "transform" | "transformc" | "noise" | "spline" | "texture");
                if open && self.bytes.chance(16) { self.leaf_string() } else { self.quoted(list) }
            }
            None => self.expr('s', depth.saturating_sub(1)),
        }
    }

    /// The format, which is the last argument so far, and values for it.
    fn printed(&mut self, args: &mut Vec<String>, depth: usize) {
        let mut format = String::from("=");
        let mut values = Vec::new();
        for _ in 0..self.bytes.below(4) {
            let letter = self.bytes.pick(&['f', 'i', 's', 'c', 'm', 'p', 'K']);
            let letter = if letter == 'K' && self.scope == Scope::Walked { 'v' } else { letter };
            format += match letter {
                'i' => self.bytes.pick(&[" %d", " %x", " %5d"]),
                's' | 'K' => " %s",
                _ => self.bytes.pick(&[" %g", " %.3f", " %e"]),
            };
            values.push(self.expr(letter, depth.saturating_sub(1)));
        }
        args.pop();
        args.push(format!("\"{format}\\n\""));
        args.append(&mut values);
    }

    fn options(&mut self, function: &str, args: &mut Vec<String>, depth: usize) {
        let known: &[(&str, char)] = match function {
            "noise" | "snoise" | "pnoise" | "psnoise" => &[
                ("anisotropic", 'i'),
                ("do_filter", 'i'),
                ("direction", 'v'),
                ("bandwidth", 'f'),
                ("impulses", 'f'),
            ],
            "texture" | "environment" => &[
                ("blur", 'f'),
                ("width", 'f'),
                ("wrap", 's'),
                ("fill", 'f'),
                ("firstchannel", 'i'),
                ("missingcolor", 'c'),
            ],
            _ => return,
        };
        for _ in 0..self.bytes.below(3) {
            let (name, letter) = self.bytes.pick(known);
            let value = match letter {
                's' => self.quoted(&["black", "clamp", "periodic", "mirror"]),
                'f' if name == "impulses" => self.bytes.pick(&["1.0", "4.0", "8.0"]).to_string(),
                _ => self.expr(letter, depth.saturating_sub(1)),
            };
            args.push(format!("\"{name}\""));
            args.push(value);
        }
    }

    /// A value of any type that a statement can print or send.
    pub(super) fn any_value(&mut self) -> char {
        self.bytes.pick(VALUES)
    }
}
