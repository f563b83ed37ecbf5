use super::*;

/// A crate of these files.
fn tree(files: &[(&str, &str)]) -> Crate {
    let folder = tempfile::tempdir().unwrap();
    for (name, code) in files {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, code).unwrap();
    }
    Crate::read(&folder.path().join("lib.rs")).unwrap()
}

/// Its edges, as `from → to`.
fn edges(files: &[(&str, &str)]) -> Vec<String> {
    let tree = tree(files);
    let name = |id: usize| &tree.modules[id].name["crate".len()..];
    let mut all: Vec<_> =
        tree.edges().keys().map(|&(from, to)| format!("{} → {}", name(from), name(to))).collect();
    all.sort();
    all
}

#[test]
fn two_modules_that_import_each_other_are_a_circle() {
    let root = ("lib.rs", "mod a;\npub mod b;\n");
    let a = ("a.rs", "use crate::b::{self, B};\npub struct A;\n");
    let b = ("b.rs", "pub struct B;\nfn f(_: super::a::A) {}\n");
    let circles = tree(&[root, a, b]).circles();
    assert_eq!(
        circles,
        [["crate::a → crate::b by `crate::b`", "crate::b → crate::a by `super::a::A`"]]
    );
    assert!(tree(&[root, a, ("b.rs", "pub struct B;\n")]).circles().is_empty());
}

#[test]
fn a_circle_through_three_modules_and_a_reexport_is_found() {
    let c = "pub struct C(Box<crate::A>);\n";
    let with = |c| {
        tree(&[
            ("lib.rs", "mod a;\nmod b;\nmod c;\npub use a::A;\n"),
            ("a.rs", "pub struct A(crate::b::B);\n"),
            ("b.rs", "pub(crate) struct B(crate::c::C);\n"),
            ("c.rs", c),
        ])
    };
    assert_eq!(with(c).circles()[0].len(), 3);
    assert!(with("pub struct C(u8);\n").circles().is_empty());
}

#[test]
fn a_parent_and_its_child_can_be_a_circle() {
    let child = ("child/mod.rs", "use super::P;\npub const fn f(_: P) {}\n");
    let parent = "mod child;\npub struct P;\n";
    assert!(tree(&[("lib.rs", parent), child]).circles().is_empty());
    let calls = format!("{parent}fn g() {{\n    child::f(P);\n}}\n");
    assert_eq!(tree(&[("lib.rs", &calls), child]).circles().len(), 1);
}

#[test]
fn paths_lead_to_the_module_that_defines_the_item() {
    let files = [
        ("lib.rs", "mod a;\nmod b;\nmod c;\n"),
        ("a.rs", "pub struct A;\n"),
        ("b.rs", "pub use crate::a::A as B;\n"),
        ("c.rs", "use crate::b;\nfn f(_: b::B, _: crate::a::A) {}\n"),
    ];
    assert_eq!(edges(&files), ["::b → ::a", "::c → ::a", "::c → ::b"]);
}

#[test]
fn a_reexport_of_a_childs_items_counts_only_if_used() {
    let child = ("child.rs", "pub struct C;\npub fn f() {}\n");
    let module = "mod child;\npub(crate) use child::C;\n";
    assert!(edges(&[("lib.rs", module), child]).is_empty());
    let used = format!("{module}pub struct P(C);\n");
    assert_eq!(edges(&[("lib.rs", &used), child]), [" → ::child"]);
    assert_eq!(edges(&[("lib.rs", "mod child;\nuse child::C;\n"), child]), [" → ::child"]);
}

#[test]
fn a_child_depends_on_the_parent_whose_items_it_uses() {
    let glob = ("child.rs", "use super::*;\nfn f(_: P) {}\n");
    assert_eq!(edges(&[("lib.rs", "mod child;\nstruct P;\n"), glob]), ["::child → "]);
    let through = ("lib.rs", "mod a;\nmod child;\nuse a::A;\n");
    let files = [through, ("a.rs", "pub struct A;\n"), ("child.rs", "use super::A;\n")];
    assert_eq!(edges(&files), [" → ::a", "::child → ::a"]);
}

#[test]
fn other_crates_variables_comments_texts_and_unit_tests_are_no_dependencies() {
    let a = "use std::fmt;\n// crate::core::f\nfn f(pose: &str) -> fmt::Result {\n    \
        g(pose, \"crate::core::f\", x.core)\n}\n\n#[cfg(test)]\nmod tests {\n    use crate::core::f;\n}\n";
    let files =
        [("lib.rs", "mod a;\nmod core;\n"), ("a.rs", a), ("core.rs", "mod pose;\npub fn f() {}\n")];
    assert!(edges(&files).is_empty());
}

#[test]
fn a_use_is_split_into_its_names() {
    let mut imports = Vec::new();
    import("a::{self, b as c, d::*, e::{F, g::H}}", &[], false, &mut imports);
    let shown: Vec<_> =
        imports.iter().map(|import| (&*import.name, import.path.join("::"))).collect();
    let expected =
        [("a", "a"), ("c", "a::b"), ("*", "a::d"), ("F", "a::e::F"), ("H", "a::e::g::H")];
    assert_eq!(shown, expected.map(|(name, path)| (name, path.to_owned())));
}
