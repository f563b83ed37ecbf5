//! Reads the modules of a crate from its source files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::names::{self, Import, Name, plain};

/// A module: what it defines, imports and names.
#[derive(Debug, Default)]
pub struct Module {
    /// Its path, `crate::…`.
    pub path: String,
    /// The source file that it is in.
    pub file: PathBuf,
    /// The module around it; the root has none.
    pub parent: Option<usize>,
    /// The modules in it, by name.
    pub children: BTreeMap<String, usize>,
    /// The items that it defines, modules apart.
    pub items: BTreeSet<String>,
    /// What its `use` items bring into scope.
    pub imports: Vec<Import>,
    /// The paths that its code names.
    pub names: Vec<Name>,
}

/// All modules of one target. The first is the root.
#[derive(Debug, Default)]
pub struct Crate {
    pub modules: Vec<Module>,
}

impl Crate {
    /// Reads the modules that can be reached from a root file, `lib.rs` for instance.
    pub fn read(root: &Path) -> anyhow::Result<Self> {
        let mut tree = Self::default();
        let folder = root.parent().unwrap_or(Path::new("")).to_owned();
        let place = Place { file: root.to_owned(), folder };
        let module =
            Module { path: "crate".to_owned(), file: root.to_owned(), ..Module::default() };
        tree.add_file(module, &place)?;
        Ok(tree)
    }

    /// Reads modules that are all in one text.
    #[cfg(test)]
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let mut tree = Self::default();
        let place = Place { file: PathBuf::new(), folder: PathBuf::new() };
        let module = Module { path: "crate".to_owned(), ..Module::default() };
        tree.add(module, &syn::parse_file(text)?.items, &place)?;
        Ok(tree)
    }

    fn add_file(&mut self, module: Module, place: &Place) -> anyhow::Result<usize> {
        let file = place.file.display();
        let text = std::fs::read_to_string(&place.file).with_context(|| file.to_string())?;
        let parsed = syn::parse_file(&text).with_context(|| file.to_string())?;
        self.add(module, &parsed.items, place)
    }

    fn add(&mut self, module: Module, items: &[syn::Item], place: &Place) -> anyhow::Result<usize> {
        let id = self.modules.len();
        self.modules.push(module);
        for item in items {
            if let syn::Item::Mod(declared) = item {
                self.add_child(id, declared, place)?;
            } else if let Some(module) = self.modules.get_mut(id) {
                module.add_item(item);
            }
        }
        Ok(id)
    }

    fn add_child(
        &mut self,
        parent: usize,
        declared: &syn::ItemMod,
        place: &Place,
    ) -> anyhow::Result<()> {
        let name = plain(&declared.ident);
        let around = self.modules.get(parent).context("a module without a parent")?;
        let path = format!("{}::{name}", around.path);
        let mut module =
            Module { path, file: place.file.clone(), parent: Some(parent), ..Module::default() };
        let child = if let Some((_, items)) = &declared.content {
            let inside = Place { file: place.file.clone(), folder: place.folder.join(&name) };
            self.add(module, items, &inside)?
        } else {
            let inside = place.of_child(declared, &name);
            module.file.clone_from(&inside.file);
            self.add_file(module, &inside)?
        };
        if let Some(around) = self.modules.get_mut(parent) {
            around.children.insert(name, child);
        }
        Ok(())
    }
}

impl Module {
    fn add_item(&mut self, item: &syn::Item) {
        if let syn::Item::Use(import) = item {
            let is_reexport = !matches!(import.vis, syn::Visibility::Inherited);
            let line = import.use_token.span.start().line;
            self.imports.extend(names::imports(&import.tree, line, is_reexport));
        } else {
            self.items.extend(names::defined(item));
            self.names.extend(names::of(item));
        }
    }
}

/// Where the source of a module is, and the folder that its child modules are in.
struct Place {
    file: PathBuf,
    folder: PathBuf,
}

impl Place {
    /// Where a child module is that has a file of its own.
    fn of_child(&self, declared: &syn::ItemMod, name: &str) -> Self {
        if let Some(path) = path_attribute(declared) {
            let file = self.file.parent().unwrap_or(Path::new("")).join(path);
            let folder = file.parent().unwrap_or(Path::new("")).to_owned();
            return Self { file, folder };
        }
        let folder = self.folder.join(name);
        let beside = self.folder.join(format!("{name}.rs"));
        let file = if beside.exists() { beside } else { folder.join("mod.rs") };
        Self { file, folder }
    }
}

/// The file in `#[path = "…"]`.
fn path_attribute(declared: &syn::ItemMod) -> Option<String> {
    let attribute = declared.attrs.iter().find(|attribute| attribute.path().is_ident("path"))?;
    let syn::Meta::NameValue(pair) = &attribute.meta else { return None };
    let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. }) = &pair.value else {
        return None;
    };
    Some(path.value())
}
