//! `cargo xtask circles`: finds circles of imports between the modules of a crate.
//!
//! A module is a file. It depends on another if a path in it, in a `use` or in code, leads to an item of the other. A path is
//! followed through re-exports to the module that defines the item. What counts:
//! - a child module that uses an item of its parent depends on the parent, also through `use super::*`;
//! - a parent depends on a child if it uses an item of it. `mod child;` alone, and a `pub use` of a child's items that the
//!   parent's own code does not use, are declarations and do not count;
//! - unit tests inside a file do not count, since nothing can depend on them.
//!
//! The sources are read as text that rustfmt has formatted. Methods are not followed: an `impl` block in a child module is a
//! dependency of the child on the type's module, and none of the type's module on the child.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path as FilePath;
use std::sync::LazyLock;

use anyhow::{Context, ensure};
use petgraph::algo::tarjan_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use regex::Regex;

use crate::workspace::Workspace;

/// How many re-exports a path may lead through.
const MOST_REEXPORTS: usize = 8;

/// Checks every target of every package; prints each circle with the imports that close it.
pub fn check() -> anyhow::Result<()> {
    let (mut circles, mut modules) = (0, 0);
    for workspace in Workspace::ALL {
        for target in workspace.packages()?.into_iter().flat_map(|package| package.targets) {
            let tree = Crate::read(&target.src_path)?;
            modules += tree.modules.len();
            for circle in tree.circles() {
                circles += 1;
                println!("{}:\n  {}", target.src_path.display(), circle.join("\n  "));
            }
        }
    }
    ensure!(circles == 0, "circles of imports: {circles}");
    eprintln!("no circle of imports between {modules} modules");
    Ok(())
}

/// The segments of a path in code.
type Path = Vec<String>;

/// A module: what it defines, imports and names.
#[derive(Debug, Default)]
struct Module {
    /// Its path, `crate::…`.
    name: String,
    /// The module around it; the root has none.
    parent: Option<usize>,
    /// The modules in it, by name.
    children: BTreeMap<String, usize>,
    /// The items that it defines.
    items: BTreeSet<String>,
    imports: Vec<Import>,
    /// The paths that its code names.
    paths: BTreeSet<Path>,
}

/// What a `use` item brings into scope by one name; by several if the name is `*`.
#[derive(Debug, PartialEq, Eq)]
struct Import {
    name: String,
    path: Path,
    /// Whether others may import the name from here.
    is_reexport: bool,
}

/// All modules of one target. The first is the root.
#[derive(Debug, Default)]
struct Crate {
    modules: Vec<Module>,
}

/// Unit tests at the end of a file, and what names nothing: comments, texts and attributes.
static SILENT: LazyLock<Regex> = LazyLock::new(|| {
    regex(
        r##"(?s)\n#\[cfg\(test\)\]\n(?:#\[[^\]]*\]\n)*mod tests \{.*|//[^\n]*|/\*.*?\*/|r#".*?"#|"(?:[^"\\]|\\.)*"|'(?:[^'\\\n]|\\.[^'\n]*)'|#!?\[[^\]]*\]"##,
    )
});
static VISIBLE: LazyLock<Regex> = LazyLock::new(|| regex(r"pub\(.*?\) "));
static CHILD: LazyLock<Regex> = LazyLock::new(|| regex(r"(?m)^(?:pub )?mod ([a-z0-9_]+);"));
static USE: LazyLock<Regex> = LazyLock::new(|| regex(r"(?m)^ *((?:pub )?)use ([^;]+);"));
static ITEM: LazyLock<Regex> = LazyLock::new(|| {
    regex(
        r"(?m)^(?:pub )?(?:(?:const|unsafe|async|extern) +)*(?:fn|mod|struct|enum|trait|type|const|static|union|macro_rules!) ([A-Za-z0-9_]+)",
    )
});
/// A path or a name, but no field or method.
static PATH: LazyLock<Regex> =
    LazyLock::new(|| regex(r"(\.)?([A-Za-z_][A-Za-z0-9_]*(?:::[A-Za-z0-9_]+)*)"));

#[expect(clippy::expect_used, reason = "a constant of this file, which every run compiles")]
fn regex(pattern: &str) -> Regex {
    Regex::new(pattern).expect("a regular expression")
}

impl Crate {
    /// Reads the modules that can be reached from a root file, `lib.rs` for instance.
    fn read(root: &FilePath) -> anyhow::Result<Self> {
        let mut tree = Self::default();
        tree.add("crate", None, root, root.parent().unwrap_or(root))?;
        Ok(tree)
    }

    /// Adds the module in a file, whose child modules have their files in a folder.
    fn add(
        &mut self,
        name: &str,
        parent: Option<usize>,
        file: &FilePath,
        folder: &FilePath,
    ) -> anyhow::Result<usize> {
        let code = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
        let code = SILENT.replace_all(&code, "");
        let code = VISIBLE.replace_all(&code, "pub ");
        let id = self.modules.len();
        self.modules.push(Module { name: name.to_owned(), parent, ..Module::read(&code) });
        for [child] in CHILD.captures_iter(&code).map(|child| child.extract().1) {
            let inside = folder.join(child);
            let files = [inside.with_extension("rs"), inside.join("mod.rs")];
            // A file elsewhere belongs to another crate.
            let Some(file) = files.iter().find(|file| file.exists()) else { continue };
            let inner = self.add(&format!("{name}::{child}"), Some(id), file, &inside)?;
            if let Some(module) = self.modules.get_mut(id) {
                module.children.insert(child.to_owned(), inner);
            }
        }
        Ok(id)
    }

    /// The circles, each with an import between each two of its modules.
    fn circles(&self) -> Vec<Vec<String>> {
        let edges = self.edges();
        let graph = DiGraph::<(), (), usize>::from_edges(edges.keys());
        let circles = tarjan_scc(&graph).into_iter().filter(|modules| modules.len() > 1);
        let imports = |modules: Vec<NodeIndex<usize>>| {
            let is_in = |id: &usize| modules.contains(&NodeIndex::new(*id));
            let inside = edges.iter().filter(|((from, to), _)| is_in(from) && is_in(to));
            inside.map(|((from, to), path)| self.shown(*from, *to, path)).collect()
        };
        circles.map(imports).collect()
    }

    fn shown(&self, from: usize, to: usize, path: &Path) -> String {
        let name = |id| self.modules.get(id).map_or("", |module: &Module| &module.name);
        format!("{} → {} by `{}`", name(from), name(to), path.join("::"))
    }

    /// The dependencies between modules, with the first path that leads from one to another.
    fn edges(&self) -> BTreeMap<(usize, usize), &Path> {
        let mut edges = BTreeMap::new();
        for (from, module) in self.modules.iter().enumerate() {
            let imported = module.imports.iter().filter_map(|import| {
                let to = self.resolve(from, &import.path, 0)?;
                let is_declaration = import.is_reexport && self.is_inside(to, from);
                (!is_declaration).then_some((to, &import.path))
            });
            let named = module.paths.iter().filter_map(|path| {
                // A name without a path is a variable if a child has it.
                let is_variable = matches!(&path[..], [name] if module.children.contains_key(name));
                (!is_variable).then_some((self.resolve(from, path, 0)?, path))
            });
            for (to, path) in imported.chain(named).filter(|(to, _)| *to != from) {
                edges.entry((from, to)).or_insert(path);
            }
        }
        edges
    }

    /// Whether a module is in another, at any depth.
    fn is_inside(&self, inner: usize, outer: usize) -> bool {
        let parent = |&id: &usize| self.modules.get(id)?.parent;
        std::iter::successors(parent(&inner), parent).any(|id| id == outer)
    }

    /// The module that a path leads to, or that defines the item; nothing if it leads to another crate.
    fn resolve(&self, from: usize, path: &[String], depth: usize) -> Option<usize> {
        let (first, rest) = path.split_first()?;
        let start = match first.as_str() {
            "crate" => 0,
            "self" => from,
            name => self.look_up(from, name, depth)?,
        };
        let step = |at, name: &String| self.look_up(at, name, depth).ok_or(at);
        Some(rest.iter().try_fold(start, step).unwrap_or_else(|last| last))
    }

    /// The module that a name in the scope of a module leads to, or that defines its item.
    fn look_up(&self, id: usize, name: &str, depth: usize) -> Option<usize> {
        let module = self.modules.get(id).filter(|_| depth <= MOST_REEXPORTS)?;
        let own =
            if name == "super" { &module.parent } else { &module.children.get(name).copied() };
        let own = own.or_else(|| module.items.contains(name).then_some(id));
        // `use fmt::…` of another crate may have the name that it imports.
        let is_it =
            |import: &&Import| import.name == name && import.path.first() != Some(&import.name);
        let mut imports = module.imports.iter().filter(is_it);
        own.or_else(|| imports.find_map(|import| self.resolve(id, &import.path, depth + 1)))
    }
}

impl Module {
    /// What is in this code.
    fn read(code: &str) -> Self {
        let mut module = Self::default();
        for (_, [is_public, tree]) in USE.captures_iter(code).map(|found| found.extract()) {
            import(tree, &[], !is_public.is_empty(), &mut module.imports);
        }
        module.items =
            ITEM.captures_iter(code).map(|item| item.extract::<1>().1.concat()).collect();
        let code = USE.replace_all(code, "");
        let paths = PATH.captures_iter(&code).filter(|found| found.get(1).is_none());
        let segments = |path: &str| path.split("::").map(str::to_owned).collect();
        module.paths = paths.filter_map(|found| Some(segments(found.get(2)?.as_str()))).collect();
        module
    }
}

/// Adds what a tree of a `use` item brings into scope.
fn import(tree: &str, prefix: &[String], is_reexport: bool, imports: &mut Vec<Import>) {
    let (path, group) = tree.trim().split_once('{').unwrap_or((tree.trim(), ""));
    let (path, alias) = path.split_once(" as ").unwrap_or((path, ""));
    let segments = path.split("::").map(str::trim).filter(|part| !part.is_empty());
    let mut path: Path = prefix.iter().cloned().chain(segments.map(str::to_owned)).collect();
    if let Some(group) = group.strip_suffix('}') {
        let mut depth = 0;
        let is_end = |c: char| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            c == ',' && depth == 0
        };
        for tree in group.split(is_end).filter(|tree| !tree.trim().is_empty()) {
            import(tree, &path, is_reexport, imports);
        }
        return;
    }
    if path.len() > 1 {
        path.pop_if(|last| last == "self");
    }
    let name = path.pop_if(|last| last == "*").or_else(|| path.last().cloned()).unwrap_or_default();
    let name = if alias.is_empty() { name } else { alias.to_owned() };
    imports.push(Import { name, path, is_reexport });
}

#[cfg(test)]
mod tests;
