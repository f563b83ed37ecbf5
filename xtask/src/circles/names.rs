//! The names in an item: what it defines, what it imports, which paths its code contains.

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

/// A path in code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name {
    pub path: Vec<String>,
    pub line: usize,
}

/// One name that a `use` item brings into scope.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Import {
    /// The name in scope; none for a glob.
    pub name: Option<String>,
    /// The path that is imported.
    pub path: Vec<String>,
    /// Where the `use` item starts.
    pub line: usize,
    /// Whether others may import the name from here.
    pub is_reexport: bool,
}

/// The name that an item defines.
pub fn defined(item: &syn::Item) -> Option<String> {
    let ident = match item {
        syn::Item::Const(item) => &item.ident,
        syn::Item::Enum(item) => &item.ident,
        syn::Item::Fn(item) => &item.sig.ident,
        syn::Item::Macro(item) => item.ident.as_ref()?,
        syn::Item::Static(item) => &item.ident,
        syn::Item::Struct(item) => &item.ident,
        syn::Item::Trait(item) => &item.ident,
        syn::Item::TraitAlias(item) => &item.ident,
        syn::Item::Type(item) => &item.ident,
        syn::Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(plain(ident))
}

/// The paths in an item's code, those of `use` items in its blocks among them.
pub fn of(item: &syn::Item) -> Vec<Name> {
    let mut collector = Collector::default();
    collector.visit_item(item);
    collector.names
}

/// What a `use` item brings into scope.
pub fn imports(tree: &syn::UseTree, line: usize, is_reexport: bool) -> Vec<Import> {
    let mut imports = Vec::new();
    flatten(tree, &mut Vec::new(), &mut |name, path| {
        imports.push(Import { name, path, line, is_reexport });
    });
    imports
}

fn flatten(
    tree: &syn::UseTree,
    prefix: &mut Vec<String>,
    add: &mut impl FnMut(Option<String>, Vec<String>),
) {
    let ends_here = |prefix: &[String], name: &str| {
        let mut path = prefix.to_vec();
        if name != "self" || path.is_empty() {
            path.push(name.to_owned());
        }
        path
    };
    match tree {
        syn::UseTree::Path(part) => {
            prefix.push(plain(&part.ident));
            flatten(&part.tree, prefix, add);
            prefix.pop();
        }
        syn::UseTree::Name(last) => {
            let path = ends_here(prefix, &plain(&last.ident));
            add(path.last().cloned(), path);
        }
        syn::UseTree::Rename(last) => {
            add(Some(plain(&last.rename)), ends_here(prefix, &plain(&last.ident)));
        }
        syn::UseTree::Glob(_) => add(None, prefix.clone()),
        syn::UseTree::Group(group) => {
            for tree in &group.items {
                flatten(tree, prefix, add);
            }
        }
    }
}

/// Collects paths.
#[derive(Default)]
struct Collector {
    names: Vec<Name>,
}

impl<'ast> Visit<'ast> for Collector {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        if let (None, Some(first)) = (&path.leading_colon, path.segments.first()) {
            let line = first.ident.span().start().line;
            let path = path.segments.iter().map(|segment| plain(&segment.ident)).collect();
            self.names.push(Name { path, line });
        }
        visit::visit_path(self, path);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let line = item.use_token.span.start().line;
        for import in imports(&item.tree, line, false) {
            self.names.push(Name { path: import.path, line });
        }
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        self.collect_tokens(call.tokens.clone());
    }

    // `pub(in crate::…)` and attributes are no dependencies.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}
}

impl Collector {
    /// Collects sequences of tokens in a macro call that may be paths.
    fn collect_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut line = 0;
        let mut colons = 0;
        let mut is_field = false;
        for token in tokens {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' && !path.is_empty() => {
                    colons += 1;
                    continue;
                }
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.finish(&mut path, line);
                        line = ident.span().start().line;
                    }
                    if !is_field {
                        path.push(plain(&ident));
                    }
                    is_field = false;
                }
                other => {
                    self.finish(&mut path, line);
                    is_field = matches!(&other, TokenTree::Punct(punct) if punct.as_char() == '.');
                    if let TokenTree::Group(group) = other {
                        self.collect_tokens(group.stream());
                    }
                }
            }
            colons = 0;
        }
        self.finish(&mut path, line);
    }

    fn finish(&mut self, path: &mut Vec<String>, line: usize) {
        if !path.is_empty() {
            self.names.push(Name { path: std::mem::take(path), line });
        }
    }
}

/// A name without the `r#` of a raw identifier.
pub fn plain(ident: &syn::Ident) -> String {
    let text = ident.to_string();
    text.strip_prefix("r#").map_or(text.clone(), ToOwned::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(code: &str) -> Vec<String> {
        let item: syn::Item = syn::parse_str(code).unwrap();
        of(&item).into_iter().map(|name| name.path.join("::")).collect()
    }

    #[test]
    fn paths_in_code_and_in_macro_calls_are_collected() {
        let code = "fn f(a: crate::a::A) { b::c(); print!(\"{}\", d::E { x: super::g } . field); }";
        assert_eq!(paths(code), ["crate::a::A", "b::c", "print", "d::E", "x", "super::g"]);
    }

    #[test]
    fn visibilities_attributes_and_other_crates_are_not() {
        let code = "#[cfg(test)] pub(in crate::a) fn f() -> ::core::result::Result { use crate::{b, c::D}; }";
        assert_eq!(paths(code), ["crate::b", "crate::c::D"]);
    }

    #[test]
    fn a_use_is_split_into_its_names() {
        let item: syn::ItemUse = syn::parse_str("use a::{self, b as c, d::*, self as e};").unwrap();
        let imports = imports(&item.tree, 1, false);
        let shown: Vec<_> = imports
            .iter()
            .map(|import| (import.name.as_deref().unwrap_or("*"), import.path.join("::")))
            .collect();
        let pair = |name, path: &str| (name, path.to_owned());
        assert_eq!(shown, [pair("a", "a"), pair("c", "a::b"), pair("*", "a::d"), pair("e", "a")]);
    }
}
