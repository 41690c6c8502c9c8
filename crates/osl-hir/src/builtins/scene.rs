//! A shader's queries about its surroundings: attributes, rays, point clouds, and its connections.

use super::{Asks, Builtin, Emitted, Site};
use osl_ir::global::Global;
use osl_ir::ir::{Builder, Const, Kernel, Kind, LaneOp, ValueId};
use osl_ir::types::Type;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "getattribute",
        &[
            "i(s,o?)",
            "i(s,o?[])",
            "i(s,s,o?)",
            "i(s,s,o?[])",
            "i(s name,i arrayindex,o?)",
            "i(s name,i arrayindex,o?[])",
            "i(s,s,i,o?)",
            "i(s,s,i,o?[])",
        ],
        "object, name, arrayindex, destination | object, name, destination | name, destination",
        attribute,
        "Stores the attribute `name` of the renderer, of `object` or of the point in `destination`. \
         Returns 1 if there is one of exactly this type, else 0.",
    )
    .query()
    .scene()
    .derivatives("those that the renderer provides, if it does")
    .extremes(
        "If there is no value of exactly this type, the result is 0, and `destination` is unchanged. \
         An `arrayindex` outside an array gives 0.",
    )
    .example("float fov = 90; int known = getattribute(\"camera:fov\", fov);"),
    Builtin::compose(
        "raytype",
        &["i(s)"],
        "name",
        |b, s| b.kernel(Kernel::RayType, s.args, Kind::Int).into(),
        "Returns 1 if the shader runs for a ray of the kind `name`, else 0. The kinds are camera, \
         shadow, reflection, refraction, diffuse, glossy, subsurface and displacement.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("A name that no renderer knows gives 0.")
    .example("int seen = raytype(\"camera\");"),
    Builtin::compose(
        "iscameraray",
        &["i()"],
        "",
        |b, _| ray(b, "camera"),
        "Returns 1 if the shader runs for a camera ray, else 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is that of raytype(\"camera\").")
    .example("int yes = iscameraray();"),
    Builtin::compose(
        "isdiffuseray",
        &["i()"],
        "",
        |b, _| ray(b, "diffuse"),
        "Returns 1 if the shader runs for a diffuse ray, else 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is that of raytype(\"diffuse\").")
    .example("int yes = isdiffuseray();"),
    Builtin::compose(
        "isglossyray",
        &["i()"],
        "",
        |b, _| ray(b, "glossy"),
        "Returns 1 if the shader runs for a glossy ray, else 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is that of raytype(\"glossy\").")
    .example("int yes = isglossyray();"),
    Builtin::compose(
        "isshadowray",
        &["i()"],
        "",
        |b, _| ray(b, "shadow"),
        "Returns 1 if the shader runs for a shadow ray, else 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is that of raytype(\"shadow\").")
    .example("int yes = isshadowray();"),
    Builtin::compose(
        "backfacing",
        &["i()"],
        "",
        |b, _| {
            let seen = b.global(Global::Backfacing, Kind::Float);
            b.lane(LaneOp::ToInt, &[seen]).into()
        },
        "Returns 1 if the surface is seen from behind, else 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is 0 on the unit patch.")
    .example("int behind = backfacing();"),
    Builtin::compose(
        "surfacearea",
        &["f()"],
        "",
        |b, _| b.global(Global::SurfaceArea, Kind::Float).into(),
        "Returns the area of the shaded surface. Lights divide their power by it.",
    )
    .scene()
    .derivatives("zero")
    .extremes(
        "The result is 1 on the unit patch, inf on a plane without end, and 0 if the renderer does not \
         provide the area.",
    )
    .example("float a = surfacearea();"),
    Builtin::compose(
        "isconnected",
        &["i(?)"],
        "parameter",
        |b, s| b.int(s.connected).into(),
        "Returns how `parameter` is connected: 0 not at all, 1 to an earlier layer, 2 to a later \
         layer, 3 to both.",
    )
    .asks(Asks::Connection)
    .scene()
    .derivatives("none: the result is an int")
    .extremes(
        "An output of the last of several layers counts as connected to a later layer, since its \
         value is requested. In a shader without other layers the result is 0.",
    )
    .example("int wired = isconnected(u);"),
    Builtin::compose(
        "isconstant",
        &["i(?)"],
        "expr",
        |b, s| b.kernel(Kernel::IsConstant, &[s.arg(0)], Kind::Int).into(),
        "Returns 1 if the value of `expr` is known before the shader runs, else 0.",
    )
    .asks(Asks::Constancy)
    .derivatives("none: the result is an int")
    .extremes("Literals, unconnected parameters and values computed from them give 1. Globals give 0.")
    .example("int known = isconstant(2 + 3);"),
    Builtin::compose(
        "trace",
        &["i(p,v,*)"],
        "pos, dir",
        |b, s| b.kernel(Kernel::Trace, &[s.arg(0), s.arg(1)], Kind::Int).into(),
        "Returns 1 if a ray from `pos` in the direction `dir` hits anything, else 0. Without a scene \
         it hits nothing.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes(
        "The result is 0 for every position and direction, except in `oslrun testshade`, which \
         answers as the reference's tool does. Options make no difference.",
    )
    .example("int hit = trace(P, N);"),
    Builtin::compose(
        "pointcloud_search",
        &["i(s,p,f,i,*)", "i(s,p,f,i,i,*)"],
        "ptcname, pos, radius, maxpoints, sort",
        |b, _| b.int(0).into(),
        "Returns the number of points within `radius` of `pos`; point clouds are not supported, so \
         the result is 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is always 0, and output arrays are unchanged.")
    .example("float near[4]; int n = pointcloud_search(\"dust.ptc\", P, 0.1, 4, \"distance\", near);"),
    Builtin::compose(
        "pointcloud_get",
        &["i(s,i[],i,s,o?[])"],
        "ptcname, indices, count, attr, data",
        |b, _| b.int(0).into(),
        "Stores the attribute `attr` of the found points in `data`; point clouds are not supported, \
         so the result is 0.",
    )
    .scene()
    .derivatives("none: the result is an int")
    .extremes("The result is always 0, and `data` is unchanged.")
    .example(
        "int which[4] = {0, 1, 2, 3}; float size[4]; int ok = pointcloud_get(\"dust.ptc\", which, 4, \
         \"size\", size);",
    ),
    Builtin::compose(
        "pointcloud_write",
        &["i(s,p,*)"],
        "ptcname, pos",
        |b, _| b.int(0).into(),
        "Saves a point at `pos`; point clouds are not supported, so the result is 0.",
    )
    .derivatives("none: the result is an int")
    .extremes("The result is always 0, and no file is written.")
    .example("int ok = pointcloud_write(\"dust.ptc\", P, \"u\", u);"),
    Builtin::compose(
        "dict_find",
        &["i(s,s)", "i(i nodeID,s)"],
        "dictionary, query",
        |b, s| b.kernel(Kernel::DictFind, s.args, Kind::Int).into(),
        "Returns the first node that the path `query` finds in the XML text `dictionary`, or below \
         the node `nodeID`. The result is 0 if there is none, and -1 if the text cannot be read.",
    )
    .derivatives("none: the result is an int")
    .extremes(
        "A text that is not XML gives -1. So does a file (a text that ends in .xml) that is missing \
         or too large. Both are run-time errors. An unknown node gives 0.",
    )
    .example("int node = dict_find(\"<a><b x=\\\"1\\\"/></a>\", \"//b\");"),
    Builtin::compose(
        "dict_next",
        &["i(i)"],
        "nodeID",
        |b, s| b.kernel(Kernel::DictNext, s.args, Kind::Int).into(),
        "Returns the next node after `nodeID` that the same path found, or 0 if there is none.",
    )
    .derivatives("none: the result is an int")
    .extremes("The result is 0 after the last node, and for an unknown node.")
    .example("int node = dict_next(dict_find(\"<a><b/><b/></a>\", \"//b\"));"),
    Builtin::compose(
        "dict_value",
        &["i(i,s,o?)", "i(i,s,o?[])"],
        "nodeID, attribname, value",
        dict_value,
        "Stores the attribute `attribname` of a node in `value`, or the node's text if the name is \
         empty. Returns 1 if there is one of this type, else 0.",
    )
    .query()
    .derivatives("none: the result is an int")
    .extremes(
        "If there is no such attribute, or if it has another type, the result is 0, and `value` is \
         unchanged.",
    )
    .example(
        "int node = dict_find(\"<a><b x=\\\"1\\\"/></a>\", \"//b\"); int x = 0; int ok = \
         dict_value(node, \"x\", x);",
    ),
    Builtin::exit("exit", &["x()"], "", "Ends the shader; its outputs keep the values that they have.")
        .derivatives("none: there is no result")
        .extremes("Other points go on. Outputs keep the values that were assigned before.")
        .example("if (u > 2) exit();"),
    Builtin::compose(
        "arraylength",
        &["i(?[])"],
        "A",
        |b, s| b.int(s.array(0).map_or(0, |a| a.len as i32)).into(),
        "Returns the number of elements of the array `A`.",
    )
    .asks(Asks::Length)
    .derivatives("none: the result is an int")
    .extremes(
        "For an array without a length in its declaration, the result is the length in this instance \
         of the shader.",
    )
    .example("float list[4]; int n = arraylength(list);"),
];

fn dict_value(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let (kind, count, kinds) = wanted(b, s, 2);
    let mut values = b.kernel_of(Kernel::DictValue { kind, count }, &[s.arg(0), s.arg(1)], &kinds);
    let Some(found) = values.pop() else { return Emitted::default() };
    store_found(b, s, 2, found, &values)
}

/// Kind and number of the values of an output argument, and the kinds of a query's results: the values, then
/// whether they were found.
pub(super) fn wanted(b: &Builder, s: &Site<'_>, target: usize) -> (Kind, u8, Vec<Kind>) {
    let array = s.array(target);
    let kind = array.map_or_else(|| b.body.kind(s.arg(target)), |a| b.body.slot(a.slot).kind);
    let count = array.map_or(0, |a| a.len.min(255) as u8);
    let mut kinds = vec![kind; usize::from(count).max(1)];
    kinds.push(Kind::Int);
    (kind, count, kinds)
}

fn ray(b: &mut Builder, name: &str) -> Emitted {
    let name = b.constant(Const::Str(name.into()));
    b.kernel(Kernel::RayType, &[name], Kind::Int).into()
}

fn attribute(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let last = s.args.len().saturating_sub(1);
    let (mut object, mut element) = (None, None);
    let mut name: Option<ValueId> = None;
    for arg in s.args.iter().take(last) {
        match b.body.kind(*arg) {
            Kind::Str => {
                object = name.replace(*arg);
            }
            _ => element = Some(*arg),
        }
    }
    let object = object.unwrap_or_else(|| b.constant(Const::Str("".into())));
    let element = element.unwrap_or_else(|| b.int(-1));
    let Some(name) = name else { return Emitted::default() };
    if let Some(known) = known(b, s).filter(|_| last == 1) {
        return Emitted { result: Some(b.int(1)), outputs: vec![(last, known)] };
    }
    let (kind, count, kinds) = wanted(b, s, last);
    let kernel = Kernel::Attribute { kind, count, has_derivs: false };
    let mut values = b.kernel_of(kernel, &[object, name, element], &kinds);
    let Some(found) = values.pop() else { return Emitted::default() };
    store_found(b, s, last, found, &values)
}

/// Writes the result of a query to its output argument, which otherwise keeps its value; returns whether it
/// was found.
pub(super) fn store_found(
    b: &mut Builder,
    s: &Site<'_>,
    target: usize,
    found: ValueId,
    values: &[ValueId],
) -> Emitted {
    let Some(array) = s.array(target) else {
        let value = b.choose(found, values.first().copied().unwrap_or(found), s.arg(target));
        return Emitted { result: Some(found), outputs: vec![(target, value)] };
    };
    b.if_else(
        found,
        |b| {
            for (index, value) in values.iter().enumerate() {
                let at = b.int(index as i32);
                b.store_element(array.slot, at, *value);
            }
        },
        |_| (),
    );
    found.into()
}

/// Attributes of the shader itself.
fn known(b: &mut Builder, s: &Site<'_>) -> Option<ValueId> {
    let text = match &**s.literal(0)? {
        "shader:shadername" => &s.names.shader,
        "shader:layername" => &s.names.layer,
        "shader:groupname" => &s.names.group,
        _ => return None,
    };
    let string = s.types.get(1) == Some(&Type::STRING);
    string.then(|| b.constant(Const::Str(text.clone())))
}
