//! A file with all of its mutants, each behind a condition: `a + b` becomes
//! `(match (a, b) { (l, r) => if is(17) { l - r } else { l + r } })`.

use std::collections::HashMap;
use std::ops::Range;

use proc_macro2::LineColumn;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::mutant::{Genre, Mutant, Position};

/// A mutant with its number.
pub type Numbered<'a> = (u32, &'a Mutant);

/// A changed file.
#[derive(Debug, Default)]
pub struct Changed {
    pub text: String,
    /// The mutants in it.
    pub numbers: Vec<u32>,
    /// Where a compiler's error is due to these mutants; the smallest range counts.
    pub ranges: Vec<(Range<usize>, Vec<u32>)>,
}

/// Text at a place of the source, with the mutant that each part contains.
struct Insertion {
    at: usize,
    /// What ends here precedes what begins here.
    begins: bool,
    parts: Vec<(Option<u32>, String)>,
    /// Number of the changed expression that begins or ends here.
    site: Option<(usize, bool)>,
}

struct Editor<'a> {
    source: &'a str,
    mutants: HashMap<(Position, Genre), Vec<Numbered<'a>>>,
    insertions: Vec<Insertion>,
    deletions: Vec<Range<usize>>,
    sites: Vec<Vec<u32>>,
}

/// Writes all mutants into the file that can be.
pub fn change(source: &str, mutants: &[Numbered]) -> anyhow::Result<Changed> {
    let file = syn::parse_file(source)?;
    let mut editor = Editor {
        source,
        mutants: HashMap::new(),
        insertions: Vec::new(),
        deletions: Vec::new(),
        sites: Vec::new(),
    };
    for &(number, mutant) in mutants {
        let key = (mutant.span.start, mutant.genre);
        editor.mutants.entry(key).or_default().push((number, mutant));
    }
    editor.visit_file(&file);
    Ok(editor.write())
}

fn position(at: LineColumn) -> Position {
    Position { line: at.line, column: at.column + 1 }
}

fn text(part: &str) -> Vec<(Option<u32>, String)> {
    vec![(None, part.to_owned())]
}

impl<'a> Editor<'a> {
    fn take(&mut self, spanned: &impl Spanned, genre: Genre) -> Vec<Numbered<'a>> {
        let at = position(spanned.span().start());
        self.mutants.remove(&(at, genre)).unwrap_or_default()
    }

    fn source_of(&self, spanned: &impl Spanned) -> &'a str {
        self.source.get(spanned.span().byte_range()).unwrap_or_default()
    }

    fn site(&mut self, mutants: &[Numbered]) -> usize {
        self.sites.push(mutants.iter().map(|(number, _)| *number).collect());
        self.sites.len() - 1
    }

    fn open(&mut self, at: usize, site: usize, before: &str) {
        let site = Some((site, true));
        self.insertions.push(Insertion { at, begins: true, parts: text(before), site });
    }

    fn close(&mut self, at: usize, site: usize, parts: Vec<(Option<u32>, String)>) {
        let site = Some((site, false));
        self.insertions.push(Insertion { at, begins: false, parts, site });
    }

    fn replace(&mut self, range: Range<usize>, with: &str) {
        let (at, parts) = (range.start, text(with));
        self.insertions.push(Insertion { at, begins: false, parts, site: None });
        self.deletions.push(range);
    }

    /// The first mutant's text if it is active, and so on, and last the original.
    fn alternatives(
        mutants: &[Numbered],
        mutated: impl Fn(&Mutant) -> String,
        original: &str,
    ) -> Vec<(Option<u32>, String)> {
        let mut parts = Vec::new();
        for (number, mutant) in mutants {
            parts.push((None, format!("if crate::mutant::is({number}) {{ ")));
            parts.push((Some(*number), mutated(mutant)));
            parts.push((None, " } else ".to_owned()));
        }
        parts.push((None, format!("{{ {original} }}")));
        parts
    }

    fn write(mut self) -> Changed {
        // Stable: insertions of one place stay in the order in which they were found.
        self.insertions.sort_by_key(|insertion| (insertion.at, insertion.begins));
        self.deletions.sort_by_key(|range| range.start);
        let mut changed = Changed::default();
        let mut opened = HashMap::new();
        let mut from = 0;
        for insertion in self.insertions {
            copy(self.source, from..insertion.at, &self.deletions, &mut changed.text);
            from = insertion.at;
            if let Some((site, true)) = insertion.site {
                opened.insert(site, changed.text.len());
            }
            for (number, part) in insertion.parts {
                let begin = changed.text.len();
                changed.text.push_str(&part);
                if let Some(number) = number {
                    changed.ranges.push((begin..changed.text.len(), vec![number]));
                }
            }
            if let Some((site, false)) = insertion.site {
                let begin = opened.get(&site).copied().unwrap_or_default();
                let numbers = self.sites.get(site).cloned().unwrap_or_default();
                changed.ranges.push((begin..changed.text.len(), numbers));
            }
        }
        copy(self.source, from..self.source.len(), &self.deletions, &mut changed.text);
        changed.numbers = self.sites.concat();
        changed
    }

    fn comparison_or_arithmetic(&mut self, node: &syn::ExprBinary, mutants: &[Numbered]) {
        use syn::BinOp::{Eq, Ge, Gt, Le, Lt, Ne};
        let is_comparison = matches!(node.op, Eq(_) | Ne(_) | Lt(_) | Le(_) | Gt(_) | Ge(_));
        let (reference, star) = if is_comparison { ("&", "*") } else { ("", "") };
        let site = self.site(mutants);
        let Range { start, end } = node.span().byte_range();
        self.open(start, site, &format!("(match ({reference}("));
        self.visit_expr(&node.left);
        self.replace(node.op.span().byte_range(), &format!("), {reference}("));
        self.visit_expr(&node.right);
        let operation = |operator: &str| format!("{star}l {operator} {star}r");
        let original = operation(self.source_of(&node.op));
        let mut parts = text(")) { (l, r) => ");
        parts.extend(Self::alternatives(mutants, |it| operation(&it.replacement), &original));
        parts.extend(text(" })"));
        self.close(end, site, parts);
    }

    /// `a || b` as `!(!a && !b)`, whose negations are the mutant's condition.
    fn logical(&mut self, node: &syn::ExprBinary, mutants: &[Numbered]) {
        let [(number, _)] = mutants else { return visit::visit_expr_binary(self, node) };
        let site = self.site(mutants);
        let Range { start, end } = node.span().byte_range();
        let is = format!("crate::mutant::is({number})");
        self.open(start, site, &format!("({is} ^ (({is} ^ ("));
        self.visit_expr(&node.left);
        let operator = self.source_of(&node.op);
        self.replace(node.op.span().byte_range(), &format!(")) {operator} ({is} ^ ("));
        self.visit_expr(&node.right);
        self.close(end, site, text("))))"));
    }

    fn assignment(&mut self, node: &syn::ExprBinary, mutants: &[Numbered]) {
        let site = self.site(mutants);
        let Range { start, end } = node.span().byte_range();
        let place = self.source_of(&node.left);
        self.open(start, site, "(match (");
        self.deletions.push(start..node.right.span().byte_range().start);
        self.visit_expr(&node.right);
        let operation = |operator: &str| format!("{place} {operator} r");
        let original = operation(self.source_of(&node.op));
        let mut parts = text(") { r => ");
        parts.extend(Self::alternatives(mutants, |it| operation(&it.replacement), &original));
        parts.extend(text(" })"));
        self.close(end, site, parts);
    }

    fn body(&mut self, block: &syn::Block) {
        let Some(first) = block.stmts.first() else { return };
        let mutants = self.take(first, Genre::FnValue);
        if mutants.is_empty() {
            return;
        }
        let site = self.site(&mutants);
        let at = first.span().byte_range().start;
        self.open(at, site, "");
        let parts = mutants.iter().flat_map(|(number, mutant)| {
            [
                (None, format!("if crate::mutant::is({number}) {{ ")),
                (Some(*number), format!("return {}; ", mutant.replacement)),
                (None, "} ".to_owned()),
            ]
        });
        let (parts, site) = (parts.collect(), Some((site, false)));
        self.insertions.push(Insertion { at, begins: true, parts, site });
    }
}

/// Appends a part of the source without what is deleted.
fn copy(source: &str, range: Range<usize>, deletions: &[Range<usize>], to: &mut String) {
    let mut from = range.start;
    for deleted in deletions.iter().filter(|it| it.start < range.end && it.end > range.start) {
        if deleted.start > from {
            to.push_str(source.get(from..deleted.start).unwrap_or_default());
        }
        from = from.max(deleted.end);
    }
    if from < range.end {
        to.push_str(source.get(from..range.end).unwrap_or_default());
    }
}

fn has_let(expression: &syn::Expr) -> bool {
    match expression {
        syn::Expr::Let(_) => true,
        syn::Expr::Binary(node) => has_let(&node.left) || has_let(&node.right),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Editor<'_> {
    // What the compiler computes cannot ask for the active mutant.
    fn visit_item_const(&mut self, _: &'ast syn::ItemConst) {}
    fn visit_item_static(&mut self, _: &'ast syn::ItemStatic) {}
    fn visit_impl_item_const(&mut self, _: &'ast syn::ImplItemConst) {}
    fn visit_trait_item_const(&mut self, _: &'ast syn::TraitItemConst) {}
    fn visit_expr_const(&mut self, _: &'ast syn::ExprConst) {}
    fn visit_type(&mut self, _: &'ast syn::Type) {}
    fn visit_generics(&mut self, _: &'ast syn::Generics) {}
    fn visit_path(&mut self, _: &'ast syn::Path) {}
    fn visit_pat(&mut self, pattern: &'ast syn::Pat) {
        if let syn::Pat::Guard(guarded) = pattern {
            self.visit_pat_guard(guarded);
        }
    }

    fn visit_item_fn(&mut self, node: &'ast syn::ItemFn) {
        if node.sig.constness.is_none() {
            self.body(&node.block);
            visit::visit_item_fn(self, node);
        }
    }

    fn visit_impl_item_fn(&mut self, node: &'ast syn::ImplItemFn) {
        if node.sig.constness.is_none() {
            self.body(&node.block);
            visit::visit_impl_item_fn(self, node);
        }
    }

    fn visit_trait_item_fn(&mut self, node: &'ast syn::TraitItemFn) {
        if let Some(block) = &node.default {
            self.body(block);
        }
        visit::visit_trait_item_fn(self, node);
    }

    fn visit_expr_binary(&mut self, node: &'ast syn::ExprBinary) {
        let mutants = self.take(&node.op, Genre::BinaryOperator);
        let operator = self.source_of(&node.op);
        let is_logical = matches!(operator, "&&" | "||");
        if mutants.is_empty() || is_logical && (has_let(&node.left) || has_let(&node.right)) {
            visit::visit_expr_binary(self, node);
        } else if is_logical {
            self.logical(node, &mutants);
        } else if operator.ends_with('=') && !matches!(operator, "==" | "!=" | "<=" | ">=") {
            self.assignment(node, &mutants);
        } else {
            self.comparison_or_arithmetic(node, &mutants);
        }
    }

    fn visit_expr_unary(&mut self, node: &'ast syn::ExprUnary) {
        let mutants = self.take(&node.op, Genre::UnaryOperator);
        if mutants.is_empty() {
            return visit::visit_expr_unary(self, node);
        }
        let site = self.site(&mutants);
        let Range { start, end } = node.span().byte_range();
        self.open(start, site, "(match (");
        self.deletions.push(node.op.span().byte_range());
        self.visit_expr(&node.expr);
        let mut parts = text(") { x => ");
        let original = format!("{}x", self.source_of(&node.op));
        parts.extend(Self::alternatives(&mutants, |_| "x".to_owned(), &original));
        parts.extend(text(" })"));
        self.close(end, site, parts);
    }

    fn visit_pat_guard(&mut self, node: &'ast syn::PatGuard) {
        let mutants = self.take(&node.guard, Genre::MatchArmGuard);
        if mutants.is_empty() || has_let(&node.guard) {
            return self.visit_expr(&node.guard);
        }
        let site = self.site(&mutants);
        let Range { start, end } = node.guard.span().byte_range();
        let is = |value: &str| {
            let found = mutants.iter().find(|(_, mutant)| mutant.replacement == value);
            found.map_or("false".to_owned(), |(number, _)| format!("crate::mutant::is({number})"))
        };
        self.open(start, site, &format!("!{} && ({} || (", is("false"), is("true")));
        self.visit_expr(&node.guard);
        self.close(end, site, text("))"));
    }

    fn visit_arm(&mut self, node: &'ast syn::Arm) {
        let mutants = self.take(node, Genre::MatchArm);
        if let ([(number, _)], false) = (&*mutants, matches!(node.pat, syn::Pat::Guard(_))) {
            self.site(&mutants);
            let at = node.pat.span().byte_range().end;
            let parts = vec![(Some(*number), format!(" if !crate::mutant::is({number})"))];
            self.insertions.push(Insertion { at, begins: false, parts, site: None });
        }
        visit::visit_arm(self, node);
    }

    fn visit_expr_struct(&mut self, node: &'ast syn::ExprStruct) {
        let Some(rest) = &node.rest else { return visit::visit_expr_struct(self, node) };
        let base = self.source_of(rest);
        for field in &node.fields {
            let mutants = self.take(field, Genre::StructField);
            let [(number, _)] = &*mutants else {
                self.visit_field_value(field);
                continue;
            };
            let site = self.site(&mutants);
            let Range { start, end } = field.expr.span().byte_range();
            let member = self.source_of(&field.member);
            let colon =
                if field.colon_token.is_none() { format!("{member}: ") } else { String::new() };
            let begin =
                format!("{colon}(if crate::mutant::is({number}) {{ ({base}).{member} }} else {{ ");
            self.open(start, site, &begin);
            self.visit_expr(&field.expr);
            self.close(end, site, text(" })"));
        }
        self.visit_expr(rest);
    }
}

#[cfg(test)]
mod tests;
