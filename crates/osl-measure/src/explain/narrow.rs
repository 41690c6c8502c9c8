//! Parts of an explanation: some variables, some lines, one call, or calls up to a depth.

use super::{Explanation, Fact, Line, State, What};

/// Which part of an explanation to keep; without entries, all.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Variables.
    pub variables: Vec<String>,
    /// Numbers of lines.
    pub lines: Vec<u32>,
    /// The number of a call; 0 is the shader itself.
    pub call: Option<usize>,
    /// The largest number of calls around a line; 0 keeps the lines of the shader itself.
    pub depth: Option<usize>,
}

impl Explanation {
    /// Keeps a part.
    ///
    /// # Errors
    /// A variable, a line or a call that the explanation does not have, as text.
    pub fn narrow(&mut self, part: &Selection) -> Result<(), String> {
        if let Some(call) = part.call.filter(|call| *call > self.calls.len()) {
            let most = self.calls.len();
            return Err(format!(
                "there is no call {call}: the point makes {most} calls of the file's functions"
            ));
        }
        if let Some(line) = part.lines.iter().find(|line| !self.lines.iter().any(|l| l.number == **line)) {
            return Err(format!("line {line} does nothing that could be shown"));
        }
        self.calls_only(part);
        if !part.lines.is_empty() {
            self.lines.retain(|line| part.lines.contains(&line.number));
            self.globals.clear();
            self.outputs.clear();
        }
        self.variables_only(&part.variables)
    }

    fn calls_only(&mut self, part: &Selection) {
        let depths: Vec<usize> = std::iter::once(0).chain(self.calls.iter().map(|c| c.depth)).collect();
        let keeps = |call: usize| {
            part.call.is_none_or(|only| call == only)
                && part.depth.is_none_or(|most| depths.get(call).is_some_and(|depth| *depth <= most))
        };
        if part.call.is_none() && part.depth.is_none() {
            return;
        }
        for line in &mut self.lines {
            line.calls.retain(|call| keeps(*call));
            line.facts.retain(|fact| keeps(fact.call));
        }
        self.lines
            .retain(|line| !line.calls.is_empty() || (line.state == State::Skipped && part.call.is_none()));
    }

    fn variables_only(&mut self, variables: &[String]) -> Result<(), String> {
        if variables.is_empty() {
            return Ok(());
        }
        let is = |name: &str, wanted: &str| {
            name.strip_prefix(wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let told =
            |fact: &Fact, wanted: &str| matches!(&fact.what, What::Set { name, .. } if is(name, wanted));
        for wanted in variables {
            let somewhere = self.lines.iter().flat_map(|line| &line.facts).any(|fact| told(fact, wanted));
            let global = self.globals.iter().any(|(name, _)| is(name, wanted));
            if !somewhere && !global {
                return Err(format!("no variable `{wanted}` gets a value at this point"));
            }
        }
        let any = |fact: &Fact| variables.iter().any(|wanted| told(fact, wanted));
        self.lines.iter_mut().for_each(|line: &mut Line| line.facts.retain(any));
        self.lines.retain(|line| !line.facts.is_empty());
        self.globals.retain(|(name, _)| variables.iter().any(|wanted| is(name, wanted)));
        self.outputs.retain(|(name, _)| variables.iter().any(|wanted| is(name, wanted)));
        Ok(())
    }
}
