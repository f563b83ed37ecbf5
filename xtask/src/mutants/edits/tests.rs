//! Each kind of mutant in a small source.

use super::*;
use crate::mutants::mutant::Span;

/// A mutant of the first place of `text` in the source.
fn mutant(source: &str, genre: Genre, text: &str, replacement: &str) -> Mutant {
    let at = source.find(text).unwrap();
    let before = source.get(..at).unwrap();
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    let start = Position { line, column };
    let span = Span { start, end: start };
    let (file, name, key) = (String::new(), String::new(), String::new());
    Mutant { file, name, key, genre, replacement: replacement.to_owned(), span }
}

fn changed(source: &str, mutants: &[(Genre, &str, &str)]) -> String {
    let mutants = mutants.iter().map(|(genre, text, new)| mutant(source, *genre, text, new));
    let mutants: Vec<Mutant> = mutants.collect();
    let text = change(source, &(7..).zip(&mutants).collect::<Vec<_>>()).unwrap().text;
    syn::parse_file(&text).unwrap();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace("crate::mutant::", "")
}

#[test]
fn arithmetic_evaluates_its_operands_once() {
    let source = "fn f() -> f32 { a() + b() * c }";
    let mutants = [(Genre::BinaryOperator, "+", "-"), (Genre::BinaryOperator, "* c", "/")];
    assert_eq!(
        changed(source, &mutants),
        "fn f() -> f32 { (match ((a() ), ( (match ((b() ), ( c)) { (l, r) => if is(8) { l / r } else \
         { l * r } }))) { (l, r) => if is(7) { l - r } else { l + r } }) }"
    );
}

#[test]
fn logical_operators_stay_lazy() {
    let source = "fn f() -> bool { a() && b() }";
    assert_eq!(
        changed(source, &[(Genre::BinaryOperator, "&&", "||")]),
        "fn f() -> bool { (is(7) ^ ((is(7) ^ (a() )) && (is(7) ^ ( b())))) }"
    );
}

#[test]
fn values_operators_fields_and_guards() {
    let source = "fn f() -> T { match x { y if !y => T { a, ..d }, z => { z -= 1; k } } }";
    let mutants = [
        (Genre::FnValue, "match", "k"),
        (Genre::MatchArmGuard, "!y", "true"),
        (Genre::UnaryOperator, "!y", ""),
        (Genre::StructField, "a,", ""),
        (Genre::BinaryOperator, "-=", "+="),
    ];
    assert_eq!(
        changed(source, &mutants),
        "fn f() -> T { if is(7) { return k; } match x { y if !false && (is(8) || ((match (y) { x => if is(9) \
         { x } else { !x } }))) => T { a: (if is(10) { (d).a } else { a }), ..d }, z => { (match (1) { r => \
         if is(11) { z += r } else { z -= r } }); k } } }"
    );
}

#[test]
fn what_the_compiler_computes_is_left_as_it_is() {
    let source = "const A: u8 = 1 + 2; const fn f() -> u8 { 3 + 4 } fn g(x: [u8; 5 + 6]) {}";
    let mutants = ["+ 2", "+ 4", "+ 6"].map(|text| (Genre::BinaryOperator, text, "-"));
    assert_eq!(changed(source, &mutants), source);
}
