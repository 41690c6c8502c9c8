//! Reads the parameters of a node by name and type, and reports those that are unused.

use super::message::{Messages, SceneLocation};
use super::text::{Node, Param, Value, Word};
use glam::{Mat4, Vec3};

/// A node whose parameters are being read.
pub(super) struct Fields<'a> {
    node: &'a Node,
    used: Vec<bool>,
    pub(super) messages: &'a mut Messages,
}

impl<'a> Fields<'a> {
    pub(super) fn new(node: &'a Node, messages: &'a mut Messages) -> Fields<'a> {
        Fields { node, used: vec![false; node.params.len()], messages }
    }

    /// A parameter as written. If it is given twice, the last one counts.
    pub(super) fn take(&mut self, name: &str) -> Option<&'a Param> {
        let node = self.node;
        let mut found = None;
        for (param, used) in node.params.iter().zip(&mut self.used) {
            if param.name == name {
                *used = true;
                found = Some(param);
            }
        }
        found
    }

    fn wrong(&mut self, param: &Param, what: &str) {
        self.messages.error(&param.place, format!("parameter `{}` is to be {what}", param.name));
    }

    /// Exactly `N` numbers; an error if there are more or fewer, or if one is not finite.
    fn numbers_of<const N: usize>(&mut self, name: &str, what: &str) -> Option<[f32; N]> {
        let param = self.take(name)?;
        let found = numbers(&param.value).filter(|list| list.iter().all(|x| (*x as f32).is_finite()));
        let found = found.and_then(|list| <[f64; N]>::try_from(list).ok());
        if found.is_none() {
            self.wrong(param, what);
        }
        Some(found?.map(|x| x as f32))
    }

    pub(super) fn float(&mut self, name: &str, default: f32) -> f32 {
        self.numbers_of::<1>(name, "a number").map_or(default, |[x]| x)
    }

    /// A whole number in a range.
    pub(super) fn int(&mut self, name: &str, default: u32, (low, high): (u32, u32)) -> u32 {
        let Some(param) = self.take(name) else { return default };
        let found = match numbers(&param.value).as_deref() {
            Some([x]) if x.fract() == 0.0 && (f64::from(low)..=f64::from(high)).contains(x) => {
                Some(*x as u32)
            }
            _ => None,
        };
        if found.is_none() {
            self.wrong(param, &format!("a whole number from {low} to {high}"));
        }
        found.unwrap_or(default)
    }

    pub(super) fn triple(&mut self, name: &str, default: Vec3) -> Vec3 {
        self.numbers_of::<3>(name, "three numbers").map_or(default, Vec3::from_array)
    }

    /// A matrix for row vectors, row by row; a singular matrix is an error.
    pub(super) fn matrix(&mut self, name: &str) -> Mat4 {
        let numbers = self.numbers_of::<16>(name, "a matrix: 16 numbers, row by row");
        let Some(numbers) = numbers else { return Mat4::IDENTITY };
        let matrix = Mat4::from_cols_array(&numbers);
        let regular = matrix.inverse().is_finite() && matrix.determinant() != 0.0;
        if !regular {
            if let Some(param) = self.take(name) {
                self.wrong(param, "a matrix that has an inverse: this one is singular");
            }
            return Mat4::IDENTITY;
        }
        matrix
    }

    /// A single word.
    pub(super) fn word(&mut self, name: &str) -> Option<&'a Word> {
        let param = self.take(name)?;
        match &param.value {
            Value::Words(words) if words.len() == 1 => words.first(),
            _ => {
                self.wrong(param, "a single name");
                None
            }
        }
    }

    pub(super) fn flag(&mut self, name: &str, default: bool) -> bool {
        match self.word(name).map(|w| w.text.as_str()) {
            None => default,
            Some("on" | "true" | "1") => true,
            Some("off" | "false" | "0") => false,
            Some(_) => {
                if let Some(param) = self.take(name) {
                    self.wrong(param, "`on` or `off`");
                }
                default
            }
        }
    }

    /// The numbers of an array, in groups of `N`.
    pub(super) fn groups<const N: usize>(&mut self, name: &str) -> Option<Vec<[f32; N]>> {
        let param = self.take(name)?;
        let list = numbers(&param.value).filter(|list| list.len().is_multiple_of(N));
        if list.is_none() {
            self.wrong(param, &format!("an array of numbers, {N} by {N}"));
        }
        let list: Vec<f32> = list?.into_iter().map(|x| x as f32).collect();
        let (groups, _) = list.as_chunks::<N>();
        if let Some(at) = groups.iter().position(|g| g.iter().any(|x| !x.is_finite())) {
            self.messages.error(&param.place, format!("parameter `{name}`: element {at} is not finite"));
            return None;
        }
        Some(groups.to_vec())
    }

    /// The whole numbers of an array.
    pub(super) fn indices(&mut self, name: &str) -> Option<Vec<u32>> {
        let param = self.take(name)?;
        let whole = |x: &f64| x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(x);
        let list = numbers(&param.value).filter(|list| list.iter().all(whole));
        if list.is_none() {
            self.wrong(param, "an array of whole numbers from 0 on");
        }
        Some(list?.into_iter().map(|x| x as u32).collect())
    }

    /// Warns about parameters that were not used.
    pub(super) fn finish(self) {
        for (param, used) in self.node.params.iter().zip(&self.used) {
            if !used {
                let text = format!(
                    "parameter `{}` of `{}` is not known and has no effect",
                    param.name, self.node.kind
                );
                self.messages.warning(&param.place, text);
            }
        }
    }

    pub(super) fn place(&self) -> &'a SceneLocation {
        &self.node.place
    }
}

/// A value as numbers, if it consists of numbers.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Numbers(list) => Some(list.clone()),
        Value::Words(words) => words.iter().map(|w| w.text.parse().ok().filter(|_| !w.quoted)).collect(),
        Value::Texts(_) => None,
    }
}
