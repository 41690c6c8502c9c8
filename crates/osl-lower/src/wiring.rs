//! How layers are connected: which are needed, and the connections between them.

use super::{Last, Requests, View};
use crate::group::{Connection, End, Rules};
use osl_hir::hir::{Param, Program};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// Which layers are needed, and how their parameters are connected.
pub(super) struct Wiring<'a> {
    /// Name of the last layer's shader.
    pub(super) name: Arc<str>,
    pub(super) rules: &'a Rules,
    /// Whether each layer has an outgoing connection.
    left: Vec<bool>,
    /// The layers that always run, in order.
    pub(super) entries: Vec<usize>,
    pub(super) needed: Vec<bool>,
    /// For each layer and parameter, its incoming connections; those of components come first.
    pub(super) to: Vec<FxHashMap<usize, Vec<&'a Connection>>>,
    /// For each layer, the connected parts of its parameters.
    pub(super) ends: Vec<Joints>,
    /// Which parameters of the last layer are outputs of the body.
    pub(super) delivered: Vec<bool>,
    /// Requested outputs of layers before the last.
    pub(super) asked: Vec<Asked>,
}

/// The connected parts of each parameter, by the index of the parameter; each part once, however many
/// connections it has.
pub(super) type Joints = FxHashMap<usize, FxHashSet<Joint>>;

/// A parameter, or a field of one, that is connected.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Joint {
    /// The path of fields to the part.
    pub(super) fields: Vec<usize>,
    /// 1 upstream; 2 downstream, or to the renderer.
    pub(super) bit: i32,
}

/// An output of a layer before the last: the layer runs at every point.
pub(super) struct Asked {
    pub(super) layer: usize,
    pub(super) param: usize,
    /// Whether it is an output of the body.
    pub(super) deliver: bool,
}

impl<'a> Wiring<'a> {
    pub(super) fn new(
        views: &[View<'_>],
        connections: &'a [Connection],
        rules: &'a Rules,
        requests: &Requests,
    ) -> Wiring<'a> {
        let name = views.last().map_or_else(|| "".into(), |v| v.program.shader.name.clone());
        let mut wiring = Wiring {
            name,
            rules,
            entries: rules
                .entries
                .clone()
                .unwrap_or_else(|| views.len().checked_sub(1).into_iter().collect()),
            needed: vec![rules.is_eager(); views.len()],
            to: vec![FxHashMap::default(); views.len()],
            ends: vec![Joints::default(); views.len()],
            left: vec![false; views.len()],
            delivered: Vec::new(),
            asked: Vec::new(),
        };
        for connection in connections {
            for (End { layer, param, fields, .. }, bit) in [(&connection.to, 1), (&connection.from, 2)] {
                let joints = wiring.ends[*layer].entry(*param).or_default();
                joints.insert(Joint { fields: fields.clone(), bit });
            }
            wiring.left[connection.from.layer] = true;
            let list = wiring.to[connection.to.layer].entry(connection.to.param).or_default();
            list.push(connection);
        }
        for list in wiring.to.iter_mut().flat_map(FxHashMap::values_mut) {
            list.sort_by_key(|c| c.to.component.is_none());
        }
        let before = views.split_last().map_or(&[][..], |(_, before)| before);
        for name in &requests.outputs {
            let (of, output) =
                name.split_once('.').map_or((None, &**name), |(of, output)| (Some(of), output));
            for (layer, View { program, names, .. }) in before.iter().enumerate() {
                if of.is_none_or(|of| of == &*names.layer) {
                    let found = program.param(output);
                    let found = found.filter(|at| program.shader.params.get(*at).is_some_and(|p| p.output));
                    wiring.asked.extend(found.map(|param| Asked { layer, param, deliver: of.is_some() }));
                }
            }
        }
        for Asked { layer, param, .. } in &wiring.asked {
            let joints = wiring.ends[*layer].entry(*param).or_default();
            joints.insert(Joint { fields: Vec::new(), bit: 2 });
            // If there is a list of entries, it runs only if it is an entry or an entry needs it.
            wiring.needed[*layer] |= rules.entries.is_none();
        }
        if let ([.., view], [.., ends]) = (views, &mut wiring.ends[..]) {
            let requested = requested(view, requests);
            let named: FxHashSet<usize> = requested.iter().map(|(param, _)| *param).collect();
            let named = |index: usize| named.contains(&index);
            let every = !matches!(requests.last, Last::Named(_));
            let params = view.program.shader.params.iter().enumerate();
            wiring.delivered = params.map(|(index, p)| p.output && (every || named(index))).collect();
            for (param, joint) in requested {
                ends.entry(param).or_default().insert(joint);
            }
        }
        for entry in &wiring.entries {
            wiring.needed.get_mut(*entry).into_iter().for_each(|needed| *needed = true);
        }
        for layer in (0..views.len()).rev().filter(|l| wiring.needed[*l]).collect::<Vec<_>>() {
            wiring.need(layer);
        }
        wiring
    }

    /// Whether a layer runs at every point because one of its outputs is requested.
    pub(super) fn asks(&self, layer: usize) -> bool {
        self.rules.entries.is_none() && self.asked.iter().any(|asked| asked.layer == layer)
    }

    /// Whether a layer has an outgoing connection.
    pub(super) fn leaves(&self, layer: usize) -> bool {
        self.left.get(layer).is_some_and(|left| *left)
    }

    /// Marks the layers that a layer needs, directly and indirectly.
    fn need(&mut self, layer: usize) {
        let mut open = vec![layer];
        while let Some(layer) = open.pop() {
            let sources: Vec<usize> = self.to[layer].values().flatten().map(|c| c.from.layer).collect();
            for source in sources {
                if !std::mem::replace(&mut self.needed[source], true) {
                    open.push(source);
                }
            }
        }
    }
}

/// The outputs of the last layer that the renderer takes.
fn requested(view: &View<'_>, requests: &Requests) -> Vec<(usize, Joint)> {
    let View { program, names, .. } = view;
    let outputs = program.shader.params.iter().enumerate().filter(|(_, p)| p.output);
    let mut found = Vec::new();
    for (param, of) in outputs {
        match &requests.last {
            Last::All => found.push((param, Joint { fields: Vec::new(), bit: 2 })),
            Last::None => {}
            Last::Named(list) => {
                let parts = list.iter().filter_map(|name| {
                    let own = name.strip_prefix(&*names.layer).and_then(|rest| rest.strip_prefix('.'));
                    [Some(&**name), own].into_iter().flatten().find_map(|path| fields(program, of, path))
                });
                found.extend(parts.map(|fields| (param, Joint { fields, bit: 2 })));
            }
        }
    }
    found
}

/// The fields of a path like `p.x.y` to a part of a parameter.
fn fields(program: &Program, param: &Param, path: &str) -> Option<Vec<usize>> {
    let var = program.vars.get(param.var.0 as usize)?;
    let mut names = path.split('.');
    if names.next()? != &*var.name {
        return None;
    }
    let mut ty = var.ty;
    let mut fields = Vec::new();
    for name in names {
        let (index, field) = program.structs.field(ty.as_struct()?, name)?;
        fields.push(index);
        ty = field.ty;
    }
    Some(fields)
}
