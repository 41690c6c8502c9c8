//! Checks that the modules of a crate have an order: of two modules in the same folder, at most one may name
//! the other, also by way of further modules. A module and the parts in its folder count as one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A module: the names that lead to it from the root of its crate.
type Module = Vec<String>;
/// The text of each module of a crate, without comments and tests.
type Modules = BTreeMap<Module, String>;

/// Adds the modules in a folder and in its folders.
fn read(folder: &Path, module: &[String], modules: &mut Modules) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_string();
        let here = || module.iter().cloned().chain([stem.clone()]).collect::<Module>();
        if stem == "tests" {
            continue;
        } else if path.is_dir() {
            read(&path, &here(), modules);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let product = text.split("\n#[cfg(test)]\nmod tests {").next().unwrap();
            let is_code = |line: &&str| !line.trim_start().starts_with("//");
            let code = product.lines().filter(is_code).collect::<Vec<_>>().join("\n");
            let is_root = matches!(stem.as_str(), "lib" | "main" | "mod");
            modules.insert(if is_root { module.to_vec() } else { here() }, code);
        }
    }
}

/// Adds the paths of a tree as in `use a::{b, c::d};`, and returns what follows it.
fn paths<'t>(mut text: &'t str, from: Module, paths_of: &mut Vec<Module>) -> &'t str {
    let mut path = from;
    loop {
        text = text.trim_start();
        if let Some(list) = text.strip_prefix('{') {
            text = list;
            while !text.trim_start().starts_with('}') && !text.is_empty() {
                text = paths(text, path.clone(), paths_of);
                // Skips a new name: `as b`.
                text = text.find([',', '}']).map_or("", |end| &text[end..]);
                text = text.strip_prefix(',').unwrap_or(text);
            }
            return text.trim_start().strip_prefix('}').unwrap_or("");
        }
        let length = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
        match &text[..length] {
            "" => return text,
            "self" => {}
            "super" => drop(path.pop()),
            name => path.push(name.to_string()),
        }
        text = &text[length..];
        match text.strip_prefix("::") {
            Some(rest) => text = rest,
            None => {
                paths_of.push(path);
                return text;
            }
        }
    }
}

/// The paths in the text of a module that start with `crate`, `super` or `self`.
fn named(module: &Module, text: &str) -> Vec<Module> {
    let mut list = Vec::new();
    let mut before = ' ';
    for (at, c) in text.char_indices() {
        let rest = &text[at..];
        let starts = !before.is_alphanumeric() && !"_:$".contains(before);
        before = c;
        if !starts {
            continue;
        } else if let Some(rest) = rest.strip_prefix("crate::") {
            paths(rest, Module::new(), &mut list);
        } else if rest.starts_with("super::") || rest.starts_with("self::") {
            paths(rest, module.clone(), &mut list);
        }
    }
    list
}

/// The modules of one folder that are named by one of them, directly or by way of others.
fn reached<'g>(from: &'g str, names: &'g BTreeMap<String, BTreeSet<String>>) -> BTreeSet<&'g str> {
    let mut seen = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        for next in names.get(module).into_iter().flatten() {
            if seen.insert(next.as_str()) {
                open.push(next);
            }
        }
    }
    seen
}

#[test]
fn modules_have_an_order() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut circles = Vec::new();
    for entry in std::fs::read_dir(crates).unwrap() {
        let folder = entry.unwrap().path();
        let source = folder.join("src");
        if !source.is_dir() {
            continue;
        }
        let mut modules = Modules::new();
        read(&source, &[], &mut modules);
        // For each folder, which of its modules name which.
        let mut folders: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
        for (module, text) in &modules {
            for path in named(module, text) {
                let longest = (0..=path.len()).rev().find(|n| modules.contains_key(&path[..*n]));
                let target = &path[..longest.unwrap_or(0)];
                let common = module.iter().zip(target).take_while(|(a, b)| a == b).count();
                if let (Some(a), Some(b)) = (module.get(common), target.get(common)) {
                    let names = folders.entry(module[..common].to_vec()).or_default();
                    names.entry(a.clone()).or_default().insert(b.clone());
                }
            }
        }
        for (place, names) in &folders {
            for module in names.keys() {
                let circle: Vec<_> = reached(module, names)
                    .into_iter()
                    .filter(|m| reached(m, names).contains(module.as_str()))
                    .collect();
                if circle.first() == Some(&module.as_str()) {
                    circles.push(format!("{}, in `{}`: {circle:?}", folder.display(), place.join("::")));
                }
            }
        }
    }
    assert!(circles.is_empty(), "modules that name each other in a circle:\n{}", circles.join("\n"));
}

#[test]
fn trees_of_paths_are_read() {
    let module = vec!["a".to_string(), "b".to_string()];
    let text = "use crate::{x, y::{Z, self}, w as v};\nuse super::c::D;\nlet e = crate::f(self::G);";
    let list: Vec<String> = named(&module, text).iter().map(|path| path.join("::")).collect();
    assert_eq!(list, ["x", "y::Z", "y", "w", "a::c::D", "f", "a::b::G"]);
}
