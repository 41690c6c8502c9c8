//! Writes the shader with its levels: the source as it is, with a switch around its body and fades in it.
//!
//! This module must not know how levels are found or judged.

use super::frame::{Frame, applied};
use super::inputs::{Coordinate, Inputs};
use super::means::Statement;
use super::words::{percent, samples};
use crate::stability::fix::source::Source;
use osl_syntax::diagnostic::Edit;

/// What replaces an output: its mean or a linear form.
#[derive(Clone, Debug)]
pub(super) struct Form {
    pub(super) name: String,
    pub(super) text: String,
    /// An int cannot be blended.
    pub(super) is_int: bool,
    /// The [`columns`] in which it is linear; none for a mean.
    pub(super) along: Vec<usize>,
}

impl Form {
    fn assigned(&self) -> String {
        format!("{} = {}", self.name, self.text)
    }
}

/// All outputs are replaced.
#[derive(Clone, Debug)]
pub(super) struct Far {
    /// The footprint from which on nothing of the body runs.
    pub(super) full: f64,
    /// The share of this footprint at which the fade begins.
    pub(super) begin: f64,
    pub(super) forms: Vec<Form>,
    /// If all of them are means: the numbers, for each plane of the outputs.
    pub(super) planes: Option<Vec<f64>>,
}

impl Far {
    /// What replaces the outputs.
    pub(super) fn described(&self, inputs: &Inputs) -> String {
        let components = inputs.coordinate.components();
        let mut along: Vec<String> = Vec::new();
        for at in self.forms.iter().flat_map(|form| &form.along) {
            along.push(match (&inputs.coordinate, components.get(*at)) {
                (_, None) => "the width of a pixel".to_string(),
                (Coordinate::Point(name), _) => name.clone(),
                (Coordinate::Uv, Some(name)) => name.clone(),
            });
        }
        // The width comes last.
        along.sort_by_key(|name| (name.contains(' '), name.clone()));
        along.dedup();
        let linear = match along.split_last() {
            None => return "their means".to_string(),
            Some((last, [])) => format!("linear forms in {last}"),
            Some((last, rest)) => format!("linear forms in {} and {last}", rest.join(", ")),
        };
        let has_means = self.forms.iter().any(|form| form.along.is_empty());
        if has_means { format!("their means or {linear}") } else { linear }
    }
}

/// Statements and outputs that are replaced by their means.
#[derive(Clone, Debug)]
pub(super) struct Near {
    /// The footprint from which on they do not run.
    pub(super) full: f64,
    pub(super) statements: Vec<Statement>,
    /// Outputs that are replaced after the body.
    pub(super) outputs: Vec<Form>,
}

/// Changes that depend on the width of a pixel and stay in place at every footprint.
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
    /// The cost of the shader with them.
    pub(super) cost: f64,
}

impl Inner {
    pub(super) fn is_empty(&self) -> bool {
        self.edits.is_empty()
    }

    /// The edits that are not in one of these statements.
    pub(super) fn outside(&self, list: &[&Statement]) -> Vec<Edit> {
        let inside = |edit: &Edit| {
            let holds = |own: &&Statement| own.span.start <= edit.span.start && edit.span.end <= own.span.end;
            list.iter().any(holds)
        };
        self.edits.iter().filter(|edit| !inside(edit)).cloned().collect()
    }
}

/// What is replaced from which footprint on.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    pub(super) inner: Inner,
    pub(super) near: Vec<Near>,
    pub(super) far: Option<Far>,
}

impl Plan {
    pub(super) fn is_empty(&self) -> bool {
        self.near.is_empty() && self.far.is_none() && self.inner.is_empty()
    }
}

/// A fade begins at this share of the footprint at which it is complete.
pub(super) const BEGIN: f64 = 0.5;
/// Or at this one, if a longer fade would be worse than the original.
pub(super) const LATE: f64 = 0.75;

/// What the comment says of a level: the footprint and its error, as a share of the range.
pub(super) struct Said<'a> {
    /// For each near level, and then for the far one: the largest error from there on, and that of the
    /// original.
    pub(super) errors: &'a [[f64; 2]],
    /// The number of samples of the original.
    pub(super) samples: u32,
    /// Values that were given for parameters, if they were.
    pub(super) given: bool,
    /// The largest measured width.
    pub(super) largest: f64,
}

/// The source with its levels, with line breaks like those of the source.
pub(super) fn write(
    source: &Source<'_>,
    frame: &Frame,
    inputs: &Inputs,
    plan: &Plan,
    said: (f64, &Said<'_>),
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
    (width, said): (f64, &Said<'_>),
) -> Option<String> {
    let text = source.reader.text;
    let writer = Writer::new(source, plan, width);
    let replaced: Vec<&Statement> = plan.near.iter().flat_map(|near| &near.statements).collect();
    let mut edits = plan.inner.outside(&replaced);
    if plan.near.is_empty() && plan.far.is_none() && plan.inner.edges == 0 {
        return applied(text, (0, text.len()), &edits);
    }
    for (near, fade) in plan.near.iter().zip(&writer.fades) {
        for own in &near.statements {
            let value = applied(text, (own.value.start as usize, own.value.end as usize), &plan.inner.edits)?;
            edits.push(writer.faded(source, own, (&value, fade)));
        }
    }
    let mut body = applied(text, (frame.open, frame.close), &edits)?;
    for (near, fade) in plan.near.iter().zip(&writer.fades).filter(|(near, _)| !near.outputs.is_empty()) {
        body = format!("{}\n{}", body.trim_end(), tail(fade, &near.outputs));
    }
    let before = applied(text, (0, frame.open), &edits)?;
    // What stands just before the closing brace belongs to the body.
    let after = format!("}}{}", applied(text, (frame.close + 1, text.len()), &edits)?);
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

/// The edit that replaces outputs at the end of the body.
pub(super) fn at_end(frame: &Frame, outputs: &[Form]) -> Option<Edit> {
    let at = osl_syntax::span::Span::new(frame.close as u32, frame.close as u32);
    let lines: String = outputs.iter().map(|form| format!("{INDENT}{};\n", form.assigned())).collect();
    (!outputs.is_empty()).then(|| Edit { span: at, text: format!("\n{lines}") })
}

/// What an output may be linear in, as expressions: the components of the coordinate and the width of a
/// pixel.
pub(super) fn columns(source: &Source<'_>, inputs: &Inputs) -> Vec<String> {
    let mut columns = inputs.coordinate.components();
    columns.push(pixel(source));
    columns
}

/// A source with another body, in which the width of a pixel is known.
fn bare(source: &Source<'_>, frame: &Frame, inputs: &Inputs, lines: &str) -> Edit {
    let writer = Writer::new(source, &Plan::default(), 1.0);
    let span = osl_syntax::span::Span::new(frame.open as u32, frame.close as u32);
    Edit { span, text: format!("\n{}{lines}", writer.pixel(inputs)) }
}

/// The source with further outputs, which are the [`columns`], and nothing else in its body.
pub(super) fn probe(source: &Source<'_>, frame: &Frame, inputs: &Inputs) -> Option<(String, Vec<String>)> {
    let base = source.unused("probe");
    let columns = columns(source, inputs);
    let names: Vec<String> = (0..columns.len()).map(|at| format!("{base}_{at}")).collect();
    let outputs: Vec<String> = names.iter().map(|name| format!("float {name} = 0")).collect();
    let set = |(name, column): (&String, &String)| format!("{INDENT}{name} = {column};\n");
    let lines: String = names.iter().zip(&columns).map(set).collect();
    let edits = [frame.outputs(&outputs), bare(source, frame, inputs, &lines)];
    Some((osl_syntax::repair::apply(source.reader.text, &edits)?, names))
}

/// The source with nothing but the far level in its body.
pub(super) fn alone(source: &Source<'_>, frame: &Frame, inputs: &Inputs, far: &Far) -> Option<String> {
    let lines: String = far.forms.iter().map(|form| format!("{INDENT}{};\n", form.assigned())).collect();
    osl_syntax::repair::apply(source.reader.text, &[bare(source, frame, inputs, &lines)])
}

const INDENT: &str = "    ";
/// Maximum columns of a written line.
const COLUMNS: usize = 100;

/// The names of the new variables, and the widths of pixels.
struct Writer {
    pixel: String,
    far: String,
    fades: Vec<String>,
    soft: String,
    /// The width of a pixel at footprint 1.
    width: f64,
}

/// The name of the variable with the width of a pixel.
fn pixel(source: &Source<'_>) -> String {
    source.unused("pixel")
}

/// The name of the variable by which edges become softer.
pub(super) fn soft(source: &Source<'_>) -> String {
    source.unused("soft")
}

impl Writer {
    fn new(source: &Source<'_>, plan: &Plan, width: f64) -> Writer {
        let fade = source.unused("fade");
        let fades = match plan.near.len() {
            0 | 1 => vec![fade; plan.near.len()],
            n => (1..=n).map(|level| source.unused(&format!("fade{level}"))).collect(),
        };
        Writer { pixel: pixel(source), far: source.unused("far"), fades, soft: soft(source), width }
    }

    /// The statement that sets the width of a pixel: the smaller side, so that a level is used only where a
    /// pixel is large along both.
    fn pixel(&self, inputs: &Inputs) -> String {
        let pixel = &self.pixel;
        match &inputs.coordinate {
            Coordinate::Point(name) => {
                format!("{INDENT}float {pixel} = min(length(Dx({name})), length(Dy({name})));\n")
            }
            Coordinate::Uv => {
                format!("{INDENT}float {pixel} = min(hypot(Dx(u), Dx(v)), hypot(Dy(u), Dy(v)));\n")
            }
        }
    }

    /// The widths between which a level fades in. They are rounded so that nothing is replaced at the first
    /// and everything at the second.
    fn widths(&self, full: f64, begin: f64) -> [String; 2] {
        [rounded(self.width * full * begin, true), rounded(self.width * full, false)]
    }

    /// The comment and the fades.
    fn head(&self, inputs: &Inputs, plan: &Plan, said: &Said<'_>) -> String {
        let pixel = &self.pixel;
        let mut text = format!(
            "Levels of detail, made by oslrun lod. {pixel} is the smaller side of a pixel in {}.",
            inputs.coordinate.name()
        );
        let near = plan.near.iter().map(|near| (near.full, BEGIN));
        let fulls = near.chain(plan.far.iter().map(|far| (far.full, far.begin)));
        let names = self.fades.iter().chain(plan.far.iter().map(|_| &self.far));
        for ((((full, begin), name), error), index) in fulls.zip(names).zip(said.errors).zip(0..) {
            let far = plan.far.as_ref().filter(|_| index == plan.near.len());
            let form = far.map_or("their means".to_string(), |far| far.described(inputs));
            let what = if far.is_some() { "all outputs" } else { "some values" };
            let [percent, other] = error.map(percent);
            let samples = samples(said.samples);
            let has = if said.samples == 1 { "has" } else { "have" };
            let [begin, end] = self.widths(full, begin);
            text += &if inputs.leaves && index == plan.near.len() {
                format!(
                    " From {end} on the outputs are {form}: the root mean square error is at most \
                     {percent} of an output's range there; {samples} of the original {has} up to {other}."
                )
            } else {
                format!(
                    " Between {begin} and {end}, {name} replaces {what} by {form}: from there on the \
                     root mean square error is at most {percent} of an output's range; {samples} of the \
                     original {has} up to {other}."
                )
            };
        }
        if plan.inner.edges > 0 {
            text += &format!(" {} widens edges in proportion to a pixel.", self.soft);
        }
        text += &format!(" Pixels were measured up to a width of {}.", rounded(said.largest, false));
        if !inputs.guards.is_empty() {
            let which = if said.given { "the parameter values below" } else { "the default parameters" };
            let rest = if plan.inner.calls > 0 { "only noise fades" } else { "the original runs" };
            text += &format!(" All this holds for {which}; with others, {rest}.");
        }
        let mut out = comment(&text);
        out += &self.pixel(inputs);
        if inputs.leaves && plan.near.is_empty() && plan.inner.edges == 0 {
            return out;
        }
        let mut sets: Vec<String> = Vec::new();
        if plan.inner.edges > 0 {
            sets.push(format!("{} = max({pixel} - {}, 0);", self.soft, rounded(self.width, true)));
        }
        for (near, name) in plan.near.iter().zip(&self.fades) {
            let [begin, end] = self.widths(near.full, BEGIN);
            sets.push(format!("{name} = smoothstep({begin}, {end}, {pixel});"));
        }
        if let Some(far) = plan.far.as_ref().filter(|_| !inputs.leaves) {
            let [begin, end] = self.widths(far.full, far.begin);
            sets.push(format!("{} = smoothstep({begin}, {end}, {pixel});", self.far));
        }
        if inputs.guards.is_empty() {
            sets.iter().for_each(|set| out += &format!("{INDENT}float {set}\n"));
            return out;
        }
        for set in &sets {
            let name = set.split(' ').next().unwrap_or_default();
            out += &format!("{INDENT}float {name} = 0;\n");
        }
        out += &condition(&inputs.guards, "");
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
        let set = |form: &Form| format!("{INDENT}{INDENT}{};\n", form.assigned());
        let sets: String = far.forms.iter().map(set).collect();
        format!("{head}{} {{\n{sets}{INDENT}{INDENT}return;\n{INDENT}}}\n", condition(&tests, ""))
    }

    /// A statement that fades to its mean.
    fn faded(&self, source: &Source<'_>, own: &Statement, (text, fade): (&str, &str)) -> Edit {
        let Statement { name, mean, .. } = own;
        let at = own.span.start as usize;
        let line = if source.is_first(at) { format!("\n{}", source.indent(at)) } else { " ".to_string() };
        let inner = if source.is_first(at) { format!("{line}{INDENT}") } else { line.clone() };
        let blend = format!("if ({fade} > 0){inner}{name} = mix({name}, {mean}, {fade});");
        let first = match own.declares {
            Some(ty) => format!("{ty} {name} = 0;{line}"),
            None => String::new(),
        };
        let text = format!("{first}if ({fade} < 1){inner}{name} = {text};{line}{blend}");
        Edit { span: own.span, text }
    }
}

/// `if (a && b …)`, on several lines if it is long.
fn condition(tests: &[String], before: &str) -> String {
    let mut out = format!("{INDENT}if ({before}");
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
    let (all, end) = block(&|form| format!("{};", form.assigned()));
    let (blend, last) = block(&|Form { name: output, text, is_int, .. }| match is_int {
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

/// A width with three digits, rounded up or down.
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
    let mut text = format!("{:.digits$}", whole / pxfm::f_exp10(f64::from(digits as u32)));
    if text.contains('.') {
        text = text.trim_end_matches('0').trim_end_matches('.').to_string();
    }
    text
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
