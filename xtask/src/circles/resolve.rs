//! Follows paths to the modules that define what they name.

use super::components::Edge;
use super::names::Import;
use super::tree::Crate;

/// How many re-exports a path may lead through. Globs of two modules may import each other.
const MOST_REEXPORTS: usize = 8;

/// What a path leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    Module(usize),
    /// An item of this module.
    ItemOf(usize),
}

/// The dependencies between modules: one edge for each path that leads from one to another.
pub fn edges(tree: &Crate) -> Vec<Edge> {
    let mut edges = Vec::new();
    for (from, module) in tree.modules.iter().enumerate() {
        for import in &module.imports {
            let Some(to) = imported(tree, from, import) else { continue };
            if to != from && !(import.is_reexport && is_inside(tree, to, from)) {
                let name = import.path.join("::");
                edges.push(Edge { from, to, line: import.line, name });
            }
        }
        for name in &module.names {
            // A path that ends at a module is a variable of the same name, unless a `use` contains it.
            let to = match resolve(tree, from, &name.path, 0) {
                Some(Found::ItemOf(to)) => to,
                Some(Found::Module(to)) if name.path.len() > 1 => to,
                _ => continue,
            };
            if to != from {
                edges.push(Edge { from, to, line: name.line, name: name.path.join("::") });
            }
        }
    }
    edges
}

/// The module that an import depends on. Of a glob: the module named, if it defines items itself.
fn imported(tree: &Crate, from: usize, import: &Import) -> Option<usize> {
    match resolve(tree, from, &import.path, 0)? {
        Found::Module(to) if import.name.is_none() => {
            tree.modules.get(to).filter(|module| !module.items.is_empty()).map(|_| to)
        }
        Found::Module(to) | Found::ItemOf(to) => Some(to),
    }
}

/// Whether a module is in another, at any depth.
fn is_inside(tree: &Crate, inner: usize, outer: usize) -> bool {
    let parent = |&id: &usize| tree.modules.get(id)?.parent;
    std::iter::successors(parent(&inner), parent).any(|id| id == outer)
}

fn resolve(tree: &Crate, from: usize, path: &[String], depth: usize) -> Option<Found> {
    let (first, rest) = path.split_first()?;
    let mut found = match first.as_str() {
        "crate" => Found::Module(0),
        "self" => Found::Module(from),
        "super" => Found::Module(tree.modules.get(from)?.parent?),
        name => look_up(tree, from, name, depth)?,
    };
    for segment in rest {
        let Found::Module(module) = found else { break };
        found = match segment.as_str() {
            "super" => Found::Module(tree.modules.get(module)?.parent?),
            name => look_up(tree, module, name, depth)?,
        };
    }
    Some(found)
}

/// What a name in the scope of a module leads to; nothing if it is of another crate.
fn look_up(tree: &Crate, module: usize, name: &str, depth: usize) -> Option<Found> {
    if depth > MOST_REEXPORTS {
        return None;
    }
    let scope = tree.modules.get(module)?;
    if let Some(&child) = scope.children.get(name) {
        return Some(Found::Module(child));
    }
    if scope.items.contains(name) {
        return Some(Found::ItemOf(module));
    }
    let named = scope.imports.iter().filter(|import| import.name.as_deref() == Some(name));
    for import in named {
        // `use fmt::…` of another crate may have the name that it imports.
        let is_itself = import.path.first().is_some_and(|first| first == name);
        if !is_itself && let Some(found) = resolve(tree, module, &import.path, depth + 1) {
            return Some(found);
        }
    }
    let globs = scope.imports.iter().filter(|import| import.name.is_none());
    globs.into_iter().find_map(|glob| match resolve(tree, module, &glob.path, depth + 1)? {
        Found::Module(through) if through != module => look_up(tree, through, name, depth + 1),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::tree::Crate;
    use super::*;

    /// The edges of a crate in one file, as `from → to`.
    fn shown(code: &str) -> Vec<String> {
        let tree = Crate::parse(code).unwrap();
        let path = |id: usize| &tree.modules[id].path["crate".len()..];
        let mut all: Vec<String> = edges(&tree)
            .iter()
            .map(|edge| format!("{} → {}", path(edge.from), path(edge.to)))
            .collect();
        all.sort();
        all.dedup();
        all
    }

    #[test]
    fn paths_lead_to_the_module_that_defines_the_item() {
        let code = "mod a { pub struct A; } mod b { pub use crate::a::A as B; } \
                    mod c { use crate::b; fn f(_: b::B, _: crate::a::A) {} }";
        assert_eq!(shown(code), ["::b → ::a", "::c → ::a", "::c → ::b"]);
    }

    #[test]
    fn a_reexport_of_a_childs_items_counts_only_if_used() {
        let module = "mod child { pub struct C; pub fn f() {} } pub use child::C;";
        assert!(shown(module).is_empty());
        assert_eq!(shown(&format!("{module} pub struct P(C);")), [" → ::child"]);
        assert_eq!(shown("mod child { pub struct C; } use child::C;"), [" → ::child"]);
    }

    #[test]
    fn a_child_depends_on_the_parent_whose_items_it_uses() {
        assert_eq!(shown("struct P; mod child { use super::P; }"), ["::child → "]);
        assert_eq!(shown("struct P; mod child { use super::*; fn f(_: P) {} }"), ["::child → "]);
        let through = "mod a { pub struct A; } use a::A; mod child { use super::A; }";
        assert_eq!(shown(through), [" → ::a", "::child → ::a"]);
    }

    #[test]
    fn other_crates_and_variables_are_no_dependencies() {
        let code = "mod core { } mod a { use std::fmt; fn f(pose: u8) -> fmt::Result { g(pose) } mod pose { } }";
        assert!(shown(code).is_empty());
    }
}
