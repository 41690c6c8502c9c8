//! Shader nodes as groups: the nodes that a node is linked to become earlier layers.
//!
//! A parameter whose value is the name of a node takes that node's first suitable output; `node.output` names
//! the output, `node.r` or `node.x` a component of the first one. If a parameter is a string, its value is
//! always that string.

use super::describe::Description;
use super::message::{Messages, SceneLocation};
use super::text::{Node, Param, Value};
use osl_exec::Program;
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_ir::types::{Base, Type};
use osl_limits::Limits;
use osl_lower::Requests;
use osl_lower::group::text::Shaders;
use osl_lower::group::{Group, Layer};
use osl_lower::params::{self, ParamError, ParamValues};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The purpose of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Use {
    /// The appearance of a surface: all outputs, and the closure.
    Surface,
    /// The displacement of its points: one vector, or a height.
    Displacement,
    /// The color of a sky.
    Sky,
}

/// A compiled network.
#[derive(Debug)]
pub struct Network {
    /// Name of its last node.
    pub name: String,
    /// Computes all required outputs.
    pub program: Program,
    /// For a surface, computes only its closure or the color in its place.
    pub lean: Program,
    /// Whether it has a closure.
    pub closure: bool,
    /// The output used if there is no closure: the displacement, or the color.
    pub output: Option<Arc<str>>,
    /// Whether that output is a single number.
    pub scalar: bool,
}

/// The shader nodes of a scene, as programs.
pub struct Networks<'a> {
    nodes: HashMap<&'a str, &'a Node>,
    shaders: &'a mut dyn Shaders,
    /// Types of nodes that were found to be shaders.
    known: HashSet<&'a str>,
    /// Values that replace those of the file: the node, the parameter, and the text.
    given: Vec<(&'a str, &'a str, &'a str)>,
}

impl<'a> Networks<'a> {
    /// The shader nodes of a description. Reports duplicate names and unknown node types.
    pub fn new(
        scene: &'a Description,
        shaders: &'a mut dyn Shaders,
        messages: &mut Messages,
    ) -> Networks<'a> {
        let mut networks =
            Networks { nodes: HashMap::new(), shaders, known: HashSet::new(), given: Vec::new() };
        for node in &scene.shaders {
            let Some(name) = name_of(node) else {
                messages.warning(
                    &node.place,
                    format!("node `{}` has no name, so that nothing can use it", node.kind),
                );
                continue;
            };
            if networks.nodes.insert(name, node).is_some() {
                messages.warning(&node.place, format!("several nodes are called `{name}`; the last counts"));
            }
            if !networks.known.contains(node.kind.as_str()) {
                match networks.shaders.load(&node.kind) {
                    Ok(_) => {
                        networks.known.insert(&node.kind);
                    }
                    Err(why) => {
                        let text = format!("`{}` is no node that is known, and no shader: {why}", node.kind);
                        messages.warning(&node.place, text);
                    }
                }
            }
        }
        networks
    }

    /// Gives parameters values in place of those of the file: each is named NODE.PARAMETER, with the text of
    /// its value.
    pub fn give(&mut self, values: &'a [(String, String)], messages: &mut Messages) {
        for (path, text) in values {
            let place = SceneLocation { file: format!("-p {path}={text}").into(), line: 0 };
            // The name of a node may have dots.
            let found = self
                .nodes
                .keys()
                .filter(|name| path.strip_prefix(**name).is_some_and(|rest| rest.starts_with('.')));
            match found.copied().max_by_key(|name| name.len()) {
                Some(node) => self.given.push((node, path.get(node.len() + 1..).unwrap_or_default(), text)),
                None => {
                    let mut names: Vec<&str> = self.nodes.keys().copied().collect();
                    names.sort_unstable();
                    let text = match path.contains('.') {
                        true => format!("the scene has no such shader node; it has {}", names.join(", ")),
                        false => format!("NODE.PARAMETER=VALUE, with one of the nodes {}", names.join(", ")),
                    };
                    messages.error(&place, text);
                }
            }
        }
    }

    /// Compiles the program of a node and its inputs; `None` after an error. `place` is where the node is
    /// referenced.
    pub fn compile(
        &mut self,
        name: &str,
        purpose: Use,
        place: &SceneLocation,
        messages: &mut Messages,
    ) -> Option<Network> {
        let Some(node) = self.nodes.get(name).copied() else {
            messages.error(place, format!("there is no shader node `{name}`"));
            return None;
        };
        let mut building = Building {
            networks: self,
            group: Group::new(name).with_limits(messages.limits()),
            open: Vec::new(),
            done: HashMap::new(),
            messages,
        };
        building.layer(node)?;
        let group = building.group;
        let last = group.layers().last()?.program.clone();
        let requests = Requests { limits: messages.limits().clone(), ..Requests::default() };
        let body = osl_lower::lower_group_for(&group, &requests);
        let body = body.map_err(|list| {
            let why = list.first().map_or_else(String::new, |d| d.message.clone());
            messages.error(&node.place, format!("node `{name}` cannot be compiled: {why}"));
        });
        finish(node, &last, body.ok()?, purpose, messages)
    }
}

/// Runs the passes for the purpose of a network.
fn finish(
    node: &Node,
    last: &hir::Program,
    body: Body,
    purpose: Use,
    messages: &mut Messages,
) -> Option<Network> {
    let name = name_of(node).unwrap_or_default().to_string();
    let closure = body.outputs.iter().any(|o| &*o.name == "Ci");
    let output = match purpose {
        Use::Displacement => {
            let vector = output_of(last, |ty| ty.is_triple() && !ty.is_array() && ty != Type::COLOR);
            vector
                .or_else(|| output_of(last, |ty| ty == Type::FLOAT))
                .or_else(|| output_of(last, |ty| ty == Type::COLOR))
        }
        _ if closure => None,
        _ => output_of(last, |ty| ty == Type::COLOR).or_else(|| output_of(last, |ty| ty == Type::FLOAT)),
    };
    if output.is_none() && (!closure || purpose == Use::Displacement) {
        let what = if purpose == Use::Displacement { "a displacement" } else { "a color" };
        messages.error(&node.place, format!("shader `{}` has no output that could be {what}", node.kind));
        return None;
    }
    if let (Use::Surface, Some((name, _))) = (purpose, &output) {
        let text =
            format!("shader `{}` yields no closure: its output `{name}` is shown as a matt color", node.kind);
        messages.warning(&node.place, text);
    }
    let outputs = match (&output, purpose) {
        (Some((name, _)), Use::Displacement | Use::Sky) => Some(vec![name.clone()]),
        (None, Use::Sky) => Some(vec!["Ci".into()]),
        _ => None,
    };
    let main = output.as_ref().map_or_else(|| "Ci".into(), |(name, _)| name.clone());
    let lean = program(body.clone(), Some(vec![main]), messages.limits());
    let program = program(body, outputs, messages.limits());
    let scalar = output.as_ref().is_some_and(|(_, ty)| *ty == Type::FLOAT);
    let output = output.map(|(name, _)| name);
    Some(Network { name, program, lean, closure, output, scalar })
}

/// The program for some outputs of a body.
fn program(mut body: Body, outputs: Option<Vec<Arc<str>>>, limits: &Limits) -> Program {
    let options = passes::Options { outputs, limits: limits.clone(), ..passes::Options::default() };
    passes::run(&mut body, &options);
    Program::new(&body)
}

/// The first output with a suitable type.
fn output_of(program: &hir::Program, wanted: impl Fn(Type) -> bool) -> Option<(Arc<str>, Type)> {
    let outputs = program.shader.params.iter().filter(|p| p.output);
    let mut outputs = outputs.filter_map(|p| program.vars.get(p.var.0 as usize));
    outputs.find(|var| wanted(var.ty)).map(|var| (var.name.clone(), var.ty))
}

fn name_of(node: &Node) -> Option<&str> {
    let param = node.params.iter().rev().find(|p| p.name == "name")?;
    match &param.value {
        Value::Words(words) => words.first().map(|w| w.text.as_str()),
        _ => None,
    }
}

/// A group under construction.
struct Building<'b, 'a> {
    networks: &'b mut Networks<'a>,
    group: Group,
    /// Nodes whose layers are being made, starting with the last node.
    open: Vec<String>,
    /// The finished layers, by node name.
    done: HashMap<String, Arc<hir::Program>>,
    messages: &'b mut Messages,
}

/// A pending link: output and parameter.
struct Link<'p> {
    from: (String, Option<String>),
    to: &'p Param,
}

impl Building<'_, '_> {
    /// Adds the layer of a node after its inputs.
    fn layer(&mut self, node: &Node) -> Option<Arc<hir::Program>> {
        let name = name_of(node)?.to_string();
        if let Some(program) = self.done.get(&name) {
            return Some(program.clone());
        }
        if self.open.contains(&name) || self.open.len() as u64 >= self.messages.limits().scenes.node_depth {
            self.messages.error(&node.place, format!("node `{name}` needs itself, or too many others"));
            return None;
        }
        let (program, base) = match self.networks.shaders.load(&node.kind) {
            Ok(found) => found,
            Err(why) => {
                self.messages.error(&node.place, format!("shader `{}`: {why}", node.kind));
                return None;
            }
        };
        self.open.push(name.clone());
        let mut values = ParamValues::default();
        let mut links = Vec::new();
        let given: Vec<_> = self.networks.given.iter().filter(|(node, ..)| *node == name).copied().collect();
        let is_given = |param: &Param| given.iter().any(|(_, known, _)| *known == param.name);
        for param in node.params.iter().filter(|p| p.name != "name" && !is_given(p)) {
            match self.link(&program, param) {
                Some(from) => links.push(Link { from, to: param }),
                None => self.set(&program, &mut values, param),
            }
        }
        for (_, param, text) in &given {
            if let Err(why) = params::set(&program, &mut values, param, text) {
                let place = SceneLocation { file: format!("-p {name}.{param}={text}").into(), line: 0 };
                self.messages.error(&place, why.to_string());
            }
        }
        for link in &links {
            let source = self.networks.nodes.get(link.from.0.as_str()).copied()?;
            self.layer(source)?;
        }
        self.open.pop();
        let layer = Layer { name: name.as_str().into(), program: program.clone(), values, base };
        if self.group.add(layer).is_err() {
            self.messages.error(&node.place, "the network has too many nodes");
            return None;
        }
        for link in links {
            self.connect(&name, &link);
        }
        self.done.insert(name, program.clone());
        Some(program)
    }

    /// The node that a value refers to, and the named part of it; `None` if it is a plain value.
    fn link(&self, program: &hir::Program, param: &Param) -> Option<(String, Option<String>)> {
        let Value::Words(words) = &param.value else { return None };
        let [word] = &words[..] else { return None };
        if type_of(program, &param.name)?.base == Base::String || word.text.parse::<f64>().is_ok() {
            return None;
        }
        if self.networks.nodes.contains_key(word.text.as_str()) {
            return Some((word.text.clone(), None));
        }
        let (node, part) = word.text.split_once('.')?;
        self.networks.nodes.contains_key(node).then(|| (node.to_string(), Some(part.to_string())))
    }

    fn connect(&mut self, to: &str, link: &Link<'_>) {
        let (from, part) = &link.from;
        let Some(program) = self.done.get(from) else { return };
        let outputs = program.shader.params.iter().filter(|p| p.output);
        let outputs: Vec<&str> =
            outputs.filter_map(|p| program.vars.get(p.var.0 as usize)).map(|v| &*v.name).collect();
        let component = part.as_deref().and_then(|p| match p {
            "r" | "x" => Some(0),
            "g" | "y" => Some(1),
            "b" | "z" => Some(2),
            _ => None,
        });
        let ends: Vec<String> = match (part, component) {
            (Some(part), _) if outputs.contains(&part.split(['[', '.']).next().unwrap_or(part)) => {
                vec![part.clone()]
            }
            (_, Some(n)) => outputs.iter().map(|o| format!("{o}[{n}]")).collect(),
            (Some(part), None) => vec![part.clone()],
            (None, None) => outputs.iter().map(|o| (*o).to_string()).collect(),
        };
        let mut why = format!("node `{from}` has no output");
        for end in ends {
            match self.group.connect((from, &end), (to, &link.to.name)) {
                Ok(()) => return,
                Err(error) => why = error.to_string(),
            }
        }
        self.messages.error(&link.to.place, format!("parameter `{}`: {why}", link.to.name));
    }

    fn set(&mut self, program: &hir::Program, values: &mut ParamValues, param: &Param) {
        let ty = type_of(program, &param.name);
        let flag = ty.is_some_and(|ty| ty.base == Base::Int);
        let text = |word: &str| match word {
            "on" | "true" if flag => "1".to_string(),
            "off" | "false" if flag => "0".to_string(),
            word => word.to_string(),
        };
        let texts = ty.is_some_and(|ty| ty.base == Base::String);
        let text = match &param.value {
            Value::Words(list) => {
                list.iter().map(|w| text(&w.text)).collect::<Vec<_>>().join(if texts { "," } else { " " })
            }
            Value::Numbers(list) => list.iter().map(f64::to_string).collect::<Vec<_>>().join(" "),
            Value::Texts(list) => list.join(","),
        };
        match params::set(program, values, &param.name, &text) {
            Ok(()) => {}
            Err(why @ ParamError::Unknown { .. }) => {
                self.messages.warning(&param.place, format!("{why}: it has no effect"));
            }
            Err(why) => self.messages.error(&param.place, why.to_string()),
        }
    }
}

fn type_of(program: &hir::Program, name: &str) -> Option<Type> {
    let of = |p: &&hir::Param| program.vars.get(p.var.0 as usize).is_some_and(|v| &*v.name == name);
    let param = program.shader.params.iter().find(of)?;
    program.vars.get(param.var.0 as usize).map(|v| v.ty)
}
