//! Which parameters of a shader are inputs of its program instead of constants in it.
//!
//! A slider changes one parameter again and again. From its second value on, the parameter is an input, so
//! that the same program runs with all further ones. The results have the same bits. A parameter that decides
//! a branch or a loop, or by which something is divided, stays a constant: with a constant, the program is
//! shorter, or has another meaning.

use crate::Snapshot;
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_ir::passes::inputs_decide;
use osl_ir::types::{Base, Extent};
use osl_lower::Requests;
use osl_lower::params::{self, ParamValues};
use std::any::Any;
use std::sync::Arc;

/// The parameters of the last picture, and which of them are inputs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Open {
    /// What was read; kept, so that nothing else gets its address.
    source: Option<Arc<dyn Any + Send + Sync>>,
    /// What is wanted of it.
    key: String,
    params: Vec<(String, String)>,
    open: Vec<String>,
    /// Those that stay constants.
    shut: Vec<String>,
}

/// The parameters that are inputs of the program of a source, and the body in which they are. None if no
/// parameter is an input, or nothing is kept.
pub(crate) fn body(
    snapshot: &Snapshot,
    wanted: (Arc<dyn Any + Send + Sync>, String),
    (program, given): (&hir::Program, &[(String, String)]),
    requests: &Requests,
) -> Option<(Vec<String>, Body)> {
    let lower = |open: &[String]| {
        let mut values = ParamValues::default();
        for (name, text) in given {
            params::set(program, &mut values, name, text).ok()?;
        }
        open.iter().for_each(|name| values.make_live(name));
        osl_lower::lower_for(program, &values, requests).ok()
    };
    let mut kept = snapshot.kept()?;
    let before = kept.open.clone();
    let found = kept.open.next(wanted, (program, given), lower);
    if requests.limits.halted().is_some() {
        // Work that was cancelled does not tell whether a parameter can be an input.
        kept.open = before;
    }
    found
}

impl Open {
    /// The parameters to open for a picture with these values, and the body in which they are inputs; `lower`
    /// makes it from their names. None if there are no such parameters.
    fn next(
        &mut self,
        (source, key): (Arc<dyn Any + Send + Sync>, String),
        (program, params): (&hir::Program, &[(String, String)]),
        lower: impl Fn(&[String]) -> Option<Body>,
    ) -> Option<(Vec<String>, Body)> {
        let names = |list: &[(String, String)]| list.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        let is_same = self.source.as_ref().is_some_and(|known| Arc::ptr_eq(known, &source));
        if !is_same || self.key != key || names(&self.params) != names(params) {
            *self = Open { source: Some(source), key, params: params.to_vec(), ..Open::default() };
            return None;
        }
        let pairs = self.params.iter().zip(params);
        let moved = pairs.filter(|(before, now)| before != now).map(|(_, (name, _))| name.clone());
        let is_new = |name: &String| !self.open.contains(name) && !self.shut.contains(name);
        let moved: Vec<String> = moved.filter(is_new).collect();
        self.params = params.to_vec();
        let (wider, shut): (Vec<_>, Vec<_>) = moved.into_iter().partition(|name| is_number(program, name));
        self.shut.extend(shut);
        if !wider.is_empty() {
            let all = [&self.open[..], &wider].concat();
            match lower(&all).filter(|body| !inputs_decide(body)) {
                Some(body) => {
                    self.open = all;
                    return Some((self.open.clone(), body));
                }
                None => self.shut.extend(wider),
            }
        }
        (!self.open.is_empty()).then(|| Some((self.open.clone(), lower(&self.open)?))).flatten()
    }
}

/// Whether a parameter is a number, a triple or a matrix, and no array or struct.
fn is_number(program: &hir::Program, name: &str) -> bool {
    params::type_of(program, name).is_some_and(|ty| {
        ty.extent == Extent::One && !matches!(ty.base, Base::String | Base::Closure | Base::Struct(_))
    })
}
