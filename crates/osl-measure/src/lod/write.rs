//! Writes the shader with its level: the source as it is, with a switch around its body and changes in it;
//! and the places of the source where text can be inserted.

use super::ground::By;
use super::inputs::{Coordinate, Inputs};
use super::words::{percent, samples};
use crate::stability::fix::source::Source;
use crate::words::{closes, trimmed};
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// What replaces an output.
#[derive(Clone, Debug)]
pub(super) struct Form {
    pub(super) name: String,
    /// Its mean as an expression.
    pub(super) text: String,
    /// An int cannot be blended.
    pub(super) is_int: bool,
}

impl Form {
    fn assigned(&self) -> String {
        format!("{} = {};", self.name, self.text)
    }
}

/// All outputs are replaced by their means.
#[derive(Clone, Debug)]
pub(super) struct Far {
    /// How a pixel is measured.
    pub(super) by: By,
    /// The size of a pixel, as a multiple of that at footprint 1, from which on nothing of the body runs.
    pub(super) full: f64,
    /// The share of this size at which the fade begins.
    pub(super) begin: f64,
    pub(super) forms: Vec<Form>,
    /// The means, for each plane of the outputs.
    pub(super) planes: Vec<f64>,
}

/// Changes that depend on the size of a pixel and stay in place.
#[derive(Clone, Debug, Default)]
pub(super) struct Inner {
    /// Number of calls of noise that fade.
    pub(super) calls: usize,
    /// The width of a pixel from which on they fade, in cells of the noise.
    pub(super) start: f64,
    /// Number of edges that become softer.
    pub(super) edges: usize,
    /// All changes, in order.
    pub(super) edits: Vec<Edit>,
}

impl Inner {
    pub(super) fn is_empty(&self) -> bool {
        self.edits.is_empty()
    }
}

/// What is replaced.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    pub(super) inner: Inner,
    pub(super) far: Option<Far>,
    /// How a pixel is measured.
    pub(super) by: By,
}

impl Plan {
    pub(super) fn is_empty(&self) -> bool {
        self.far.is_none() && self.inner.is_empty()
    }
}

/// What the comment says.
pub(super) struct Said {
    /// The largest error of the level, as a share of the range, and that of the original.
    pub(super) errors: [f64; 2],
    /// The number of samples of the original.
    pub(super) samples: u32,
    /// Whether values were given for parameters.
    pub(super) given: bool,
    /// The largest measured size.
    pub(super) largest: f64,
}

/// The source with its levels, with line breaks like those of the source.
pub(super) fn write(
    source: &Source<'_>,
    frame: &Frame,
    inputs: &Inputs,
    plan: &Plan,
    said: (f64, &Said),
) -> Option<String> {
    let text = with_levels(source, frame, inputs, plan, said)?;
    let own = source.reader.text;
    let is_dos = own.contains('\n') && own.matches('\n').count() == own.matches("\r\n").count();
    Some(if is_dos { text.replace("\r\n", "\n").replace('\n', "\r\n") } else { text })
}

fn with_levels(
    source: &Source<'_>,
    frame: &Frame,
    inputs: &Inputs,
    plan: &Plan,
    (width, said): (f64, &Said),
) -> Option<String> {
    let text = source.reader.text;
    let writer = Writer::new(source, width);
    let edits = &plan.inner.edits;
    if plan.far.is_none() && plan.inner.edges == 0 {
        return applied(text, (0, text.len()), edits);
    }
    let body = applied(text, (frame.open, frame.close), edits)?;
    let before = applied(text, (0, frame.open), edits)?;
    // What stands just before the closing brace belongs to the body.
    let after = format!("}}{}", applied(text, (frame.close + 1, text.len()), edits)?);
    let head = writer.head(inputs, plan, said);
    let Some(far) = &plan.far else {
        return Some(format!("{before}\n{head}\n{}{after}", opened(&body)));
    };
    if inputs.leaves {
        let left = writer.left(inputs, far, &head);
        return Some(format!("{before}\n{left}\n{}{after}", opened(&body)));
    }
    let indent = INDENT;
    let name = &writer.far;
    let tail = tail(name, &far.forms);
    let inner = indented(&body);
    Some(format!("{before}\n{head}\n{indent}if ({name} < 1) {{\n{inner}{indent}}}\n{tail}{after}"))
}

/// The source with a further output for each measure of a pixel's size and nothing else in its body, and the
/// names of these outputs.
pub(super) fn probe(
    source: &Source<'_>,
    frame: &Frame,
    inputs: &Inputs,
    measures: [By; 2],
) -> Option<(String, [String; 2])> {
    let names = measures.map(|by| source.unused(&format!("probe_{by:?}").to_lowercase()));
    let outputs = names.each_ref().map(|name| format!("float {name} = 0"));
    let set = |(name, by): (&String, By)| format!("{INDENT}{name} = {};\n", size(inputs, by));
    let lines: String = names.iter().zip(measures).map(set).collect();
    let span = osl_syntax::span::Span::new(frame.open as u32, frame.close as u32);
    let edits = [frame.outputs(&outputs), Edit { span, text: format!("\n{lines}") }];
    Some((osl_syntax::repair::apply(source.reader.text, &edits)?, names))
}

/// The size of a pixel as an expression.
fn size(inputs: &Inputs, by: By) -> String {
    match (&inputs.coordinate, by) {
        (Coordinate::Point(name), By::Side) => format!("max(length(Dx({name})), length(Dy({name})))"),
        (Coordinate::Point(name), By::Area) => format!("sqrt(length(cross(Dx({name}), Dy({name}))))"),
        (Coordinate::Uv, By::Side) => "max(hypot(Dx(u), Dx(v)), hypot(Dy(u), Dy(v)))".to_string(),
        (Coordinate::Uv, By::Area) => "sqrt(abs(Dx(u) * Dy(v) - Dx(v) * Dy(u)))".to_string(),
    }
}

const INDENT: &str = "    ";
/// Maximum columns of a written line.
const COLUMNS: usize = 100;

/// The names of the new variables.
struct Writer {
    pixel: String,
    far: String,
    soft: String,
    /// The size of a pixel at footprint 1.
    width: f64,
}

/// The name of the variable by which edges become softer.
pub(super) fn soft(source: &Source<'_>) -> String {
    source.unused("soft")
}

impl Writer {
    fn new(source: &Source<'_>, width: f64) -> Writer {
        Writer { pixel: source.unused("pixel"), far: source.unused("far"), soft: soft(source), width }
    }

    /// The widths between which a level fades in. They are rounded so that nothing is replaced at the first
    /// and everything at the second.
    fn widths(&self, full: f64, begin: f64) -> [String; 2] {
        [rounded(self.width * full * begin, true), rounded(self.width * full, false)]
    }

    /// The comment and the variables.
    fn head(&self, inputs: &Inputs, plan: &Plan, said: &Said) -> String {
        let pixel = &self.pixel;
        let mut text = format!(
            "Levels of detail, made by oslrun lod. {pixel} is {} of a pixel in {}.",
            plan.by.name(),
            inputs.coordinate.name()
        );
        if let Some(far) = &plan.far {
            let [error, other] = said.errors.map(percent);
            let samples = samples(said.samples);
            let has = if said.samples == 1 { "has" } else { "have" };
            let [begin, end] = self.widths(far.full, far.begin);
            text += &if inputs.leaves {
                format!(" From {end} on the outputs are their means:")
            } else {
                format!(" Between {begin} and {end}, {} replaces all outputs by their means:", self.far)
            };
            text += &format!(
                " from there on the root mean square error is at most {error} of an output's range; {samples} \
                 of the original {has} up to {other}."
            );
        }
        if plan.inner.edges > 0 {
            text += &format!(" {} widens edges in proportion to a pixel.", self.soft);
        }
        text += &format!(" Pixels were measured up to a size of {}.", rounded(said.largest, false));
        if !inputs.guards.is_empty() {
            let which = if said.given { "the parameter values below" } else { "the default parameters" };
            let rest = if plan.inner.calls > 0 { "only noise fades" } else { "the original runs" };
            text += &format!(" All this holds for {which}; with others, {rest}.");
        }
        let mut out = comment(&text);
        out += &format!("{INDENT}float {pixel} = {};\n", size(inputs, plan.by));
        let mut sets: Vec<String> = Vec::new();
        if plan.inner.edges > 0 {
            sets.push(format!("{} = max({pixel} - {}, 0);", self.soft, rounded(self.width, true)));
        }
        if let Some(far) = plan.far.as_ref().filter(|_| !inputs.leaves) {
            let [begin, end] = self.widths(far.full, far.begin);
            sets.push(format!("{} = smoothstep({begin}, {end}, {pixel});", self.far));
        }
        if sets.is_empty() {
            return out;
        }
        if inputs.guards.is_empty() {
            sets.iter().for_each(|set| out += &format!("{INDENT}float {set}\n"));
            return out;
        }
        for set in &sets {
            let name = set.split(' ').next().unwrap_or_default();
            out += &format!("{INDENT}float {name} = 0;\n");
        }
        out += &condition(&inputs.guards);
        let several = sets.len() > 1;
        out += if several { " {\n" } else { "\n" };
        sets.iter().for_each(|set| out += &format!("{INDENT}{INDENT}{set}\n"));
        if several {
            out += &format!("{INDENT}}}\n");
        }
        out
    }

    /// The switch of a shader that can end before its last statement, so that nothing can follow its body.
    fn left(&self, inputs: &Inputs, far: &Far, head: &str) -> String {
        let [_, end] = self.widths(far.full, far.begin);
        let mut tests = vec![format!("{} >= {end}", self.pixel)];
        tests.extend(inputs.guards.iter().cloned());
        let set = |form: &Form| format!("{INDENT}{INDENT}{}\n", form.assigned());
        let sets: String = far.forms.iter().map(set).collect();
        format!("{head}{} {{\n{sets}{INDENT}{INDENT}return;\n{INDENT}}}\n", condition(&tests))
    }
}

/// `if (a && b …)`, on several lines if it is long.
fn condition(tests: &[String]) -> String {
    let mut out = format!("{INDENT}if (");
    let mut column = out.len();
    for (at, test) in tests.iter().enumerate() {
        let last = at + 1 == tests.len();
        if at > 0 {
            if column + test.len() + 6 > COLUMNS {
                out += &format!("\n{INDENT}    && ");
                column = INDENT.len() + 7;
            } else {
                out += " && ";
                column += 4;
            }
        }
        out += test;
        column += test.len();
        if last {
            out.push(')');
        }
    }
    out
}

/// The statements after the body: the means alone where nothing of the body runs, since a blend takes
/// longer.
fn tail(name: &str, forms: &[Form]) -> String {
    let block = |line: &dyn Fn(&Form) -> String| match forms {
        [form] => (format!("\n{INDENT}{INDENT}{}\n", line(form)), String::new()),
        forms => {
            let lines: String =
                forms.iter().map(|form| format!("{INDENT}{INDENT}{}\n", line(form))).collect();
            (format!(" {{\n{lines}"), format!("{INDENT}}}"))
        }
    };
    let (all, end) = block(&Form::assigned);
    let (blend, last) = block(&|Form { name: output, text, is_int }| match is_int {
        true => format!("{output} = {name} < 0.5 ? {output} : {text};"),
        false => format!("{output} = mix({output}, {text}, {name});"),
    });
    let between = if end.is_empty() { INDENT.to_string() } else { format!("{end} ") };
    let last = if last.is_empty() { last } else { format!("{last}\n") };
    format!("{INDENT}if ({name} >= 1){all}{between}else if ({name} > 0){blend}{last}")
}

/// A text as a comment of several lines.
fn comment(text: &str) -> String {
    let mut out = String::new();
    let mut line = format!("{INDENT}//");
    for word in text.split(' ') {
        if line.len() + 1 + word.len() > COLUMNS {
            out += &line;
            out.push('\n');
            line = format!("{INDENT}//");
        }
        line.push(' ');
        line += word;
    }
    out + &line + "\n"
}

/// A size with three digits, rounded up or down.
pub(super) fn rounded(x: f64, up: bool) -> String {
    if !(x > 0.0 && x.is_finite()) {
        return "0".to_string();
    }
    let mut digits = 0;
    let mut scaled = x;
    while scaled < 100.0 && digits < 12 {
        scaled *= 10.0;
        digits += 1;
    }
    let whole = if up { scaled.ceil() } else { scaled.floor() };
    trimmed(&format!("{:.digits$}", whole / pxfm::f_exp10(f64::from(digits as u32)))).to_string()
}

/// The body after a new head: without the line break that followed the brace.
fn opened(body: &str) -> &str {
    body.strip_prefix("\r\n").or(body.strip_prefix('\n')).unwrap_or(body)
}

/// The body, indented by one step. Lines of the preprocessor and texts of several lines stay as they are.
fn indented(body: &str) -> String {
    let body = opened(body).trim_end();
    let mut out = String::with_capacity(body.len() * 5 / 4);
    let mut inside = false;
    for line in body.lines() {
        let is_plain = line.trim().is_empty() || line.trim_start().starts_with('#') || inside;
        if !is_plain {
            out += INDENT;
        }
        out += line;
        out.push('\n');
        // A text that does not end in its line goes on in the next one.
        let code = line.split("//").next().unwrap_or(line).replace("\\\\", "").replace("\\\"", "");
        if code.matches('"').count() % 2 == 1 {
            inside = !inside;
        }
    }
    out
}

/// Offsets in the text of the main file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Where the line of the shader's keyword begins.
    pub(super) shader: usize,
    /// The closing parenthesis of the parameters.
    pub(super) params: usize,
    /// Whether a comma precedes it.
    pub(super) has_comma: bool,
    /// Just after the opening brace of the body.
    pub(super) open: usize,
    /// The closing brace of the body.
    pub(super) close: usize,
}

impl Frame {
    /// Finds the places. `None` if the shader's body is not in the main file, or made by a macro.
    pub(super) fn of(source: &Source<'_>) -> Option<Frame> {
        let bare = source.bare();
        let first = source.program.shader.body.first()?.span.start as usize;
        let open = closes(bare.get(..first)?.char_indices().rev(), '}', '{')? + 1;
        let close = open + closes(bare.get(open..)?.char_indices(), '{', '}')?;
        let last = source.program.shader.body.last()?.span.end as usize;
        let before = bare.get(..open - 1)?.trim_end();
        let params = before.strip_suffix(')')?.len();
        let has_comma = bare.get(..params)?.trim_end().ends_with(',');
        // The keyword stands before the name, which stands before the parameters or the metadata.
        let name = &*source.program.shader.name;
        let words = |text: &str, at: usize| {
            let is_part = |c: char| c.is_alphanumeric() || c == '_';
            let ends = !text.get(at + name.len()..).is_some_and(|rest| rest.starts_with(is_part));
            ends && !text.get(..at).is_some_and(|before| before.ends_with(is_part))
        };
        let head = bare.get(..params)?;
        let kind = |at: usize| {
            let before = head.get(..at)?.trim_end();
            let kinds = ["shader", "surface", "displacement", "volume", "light"];
            let kind = kinds.into_iter().find(|kind| before.ends_with(kind))?;
            Some(before.len() - kind.len())
        };
        let found = head.match_indices(name).filter(|(at, _)| words(head, *at));
        let keyword = found.filter_map(|(at, _)| kind(at)).last()?;
        let shader = bare.get(..keyword)?.rfind('\n').map_or(0, |at| at + 1);
        (last <= close).then_some(Frame { shader, params, has_comma, open, close })
    }

    /// The edit that adds output parameters, written as `float name = 0`.
    pub(super) fn outputs(&self, list: &[String]) -> Edit {
        let mut text: String = list.iter().map(|output| format!(", output {output}")).collect();
        if self.has_comma {
            text = text.trim_start_matches(", ").to_string();
        }
        let at = self.params as u32;
        Edit { span: Span::new(at, at), text }
    }
}

/// Applies those edits that lie in a part of the text, to this part alone.
pub(super) fn applied(text: &str, (from, to): (usize, usize), edits: &[Edit]) -> Option<String> {
    let inside = |edit: &&Edit| edit.span.start as usize >= from && edit.span.end as usize <= to;
    let moved = |edit: &Edit| {
        let span = Span::new(edit.span.start - from as u32, edit.span.end - from as u32);
        Edit { span, text: edit.text.clone() }
    };
    let mut edits: Vec<Edit> = edits.iter().filter(inside).map(moved).collect();
    edits.sort_by_key(|edit| edit.span.start);
    osl_syntax::repair::apply(text.get(from..to)?, &edits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_round_to_the_safe_side() {
        assert_eq!(rounded(0.062_992_1, false), "0.0629");
        assert_eq!(rounded(0.062_992_1, true), "0.063");
        assert_eq!((rounded(2.015, true), rounded(512.0, false)), ("2.02".to_string(), "512".to_string()));
    }
}
