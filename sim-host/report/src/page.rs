//! The parts of the page, as safe HTML.

use std::borrow::Cow;

use super::escape::escape;
use super::figures::Figure;
use super::table::Table;

/// Placeholder for the figures of an empty trace.
const NOTHING: &str =
    "<p class=\"nothing\">The trace holds no ticks: there is nothing to draw.</p>";

/// Fills the placeholders of a template, written `{{name}}`, in one pass: inserted text is not
/// searched again. A placeholder without a value becomes empty.
#[must_use]
pub fn fill(template: &str, values: &[(&str, Cow<'_, str>)]) -> String {
    let mut page = String::with_capacity(values.iter().map(|(_, value)| value.len()).sum());
    let mut pieces = template.split("{{");
    page.push_str(pieces.next().unwrap_or_default());
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        let value = values.iter().find(|(place, _)| *place == name);
        page.push_str(value.map_or("", |(_, value)| value));
        page.push_str(rest);
    }
    page
}

/// A page of its own: what a report and a comparison have in common.
pub(super) struct Page<'a> {
    pub title: &'a str,
    pub subtitle: &'a str,
    pub style: &'a str,
    /// The middle, as HTML.
    pub body: &'a str,
    pub provenance: &'a Table,
    /// What a browser without JavaScript shows.
    pub without_scripts: &'a str,
    /// The data of the scripts, as JSON.
    pub data: &'a str,
    pub scripts: &'a [&'a str],
}

impl Page<'_> {
    pub fn html(&self) -> String {
        let values: [(&str, Cow<'_, str>); 8] = [
            ("title", escape(self.title).into()),
            ("subtitle", escape(self.subtitle).into()),
            ("style", self.style.into()),
            ("body", self.body.into()),
            ("provenance", tables(std::slice::from_ref(self.provenance)).into()),
            ("without-scripts", self.without_scripts.into()),
            ("data", json_in_script(self.data).into()),
            ("scripts", self.scripts.join("\n").into()),
        ];
        fill(include_str!("frame.html"), &values)
    }
}

/// JSON that is safe inside a script element: without `<` there is no `</script>` and no `<!--`. In
/// JSON a `<` can only be part of a string, where its escape is equivalent.
fn json_in_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

pub(super) fn tables(tables: &[Table]) -> String {
    tables.iter().map(table).collect()
}

fn table(table: &Table) -> String {
    let head: String = table.columns.iter().map(|name| column_head(name)).collect();
    let rows: String = table.rows.iter().map(|cells| row(cells)).collect();
    let (title, note) = (escape(&table.title), escape(&table.note));
    let note = if note.is_empty() { note } else { format!("<p class=\"note\">{note}</p>") };
    format!(
        "<section class=\"table\"><h2>{title}</h2>\n\
         <div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"{title}\"><table><caption>{title}</caption>\n\
         <thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>{note}</section>\n"
    )
}

/// The head of a column; that of the names of the rows may be empty.
fn column_head(name: &str) -> String {
    if name.is_empty() { "<td></td>".to_owned() } else { cell("th scope=\"col\"", "th", name) }
}

/// A row with its first cell as header.
fn row(cells: &[String]) -> String {
    let mut cells = cells.iter();
    let name = cells.next().map_or_else(String::new, |name| cell("th scope=\"row\"", "th", name));
    let rest: String = cells.map(|text| cell("td", "td", text)).collect();
    format!("<tr>{name}{rest}</tr>\n")
}

fn cell(open: &str, close: &str, text: &str) -> String {
    format!("<{open}>{}</{close}>", escape(text))
}

pub(super) fn figures(figures: &[Figure], of_paper: bool) -> String {
    if figures.is_empty() {
        return NOTHING.into();
    }
    let all: String = figures.iter().map(|of| figure(of, of_paper)).collect();
    format!("<div class=\"figures\">\n{all}</div>")
}

/// A figure, with the number and the letters of the paper's if it is one of `of_paper`.
fn figure(of: &Figure, of_paper: bool) -> String {
    let Figure { number, caption, paper, svg, narrow, .. } = of;
    let number = number.filter(|_| of_paper).map(|number| format!("<b>Figure {number}.</b> "));
    let (number, paper) = (number.unwrap_or_default(), if of_paper { *paper } else { "" });
    let (caption, paper) = (escape(caption), escape(paper));
    format!(
        "<figure><div class=\"wide\">{svg}</div><div class=\"narrow\">{narrow}</div>\
         <output></output><figcaption>{number}{caption}{paper}</figcaption></figure>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            escape(r#"<a href="x" title='y'>Tom & Ann</a>"#),
            "&lt;a href=&quot;x&quot; title=&#39;y&#39;&gt;Tom &amp; Ann&lt;/a&gt;"
        );
    }

    #[test]
    fn json_cannot_close_its_script_and_still_means_the_same() {
        let walls = ["</script><script>alert(1)</script>", "<!-- x"];
        let json = json_in_script(&serde_json::to_string(&walls).unwrap());
        assert!(!json.contains('<'));
        let back: Vec<String> = serde_json::from_str(&json).unwrap();
        assert_eq!(back, walls);
    }

    /// A title that resembles a placeholder remains a title.
    #[test]
    fn a_filled_placeholder_is_not_filled_again() {
        let values = [("a", Cow::Borrowed("{{b}}")), ("b", Cow::Borrowed("B"))];
        assert_eq!(fill("<{{a}}|{{b}}|{{c}}>", &values), "<{{b}}|B|>");
    }
}
