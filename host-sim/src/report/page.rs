//! The page: what a reader sees first, sections, and how it was made.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use super::bars::BarChart;
use super::chart::ChartStack;
use super::escape;
use super::matrix::Matrix;
use super::number;
use super::table::Table;
use crate::output::write_whole;

const STYLE: &str = include_str!("../../assets/report.css");
const SCRIPT: &str = include_str!("../../assets/report.js");

/// Nothing may be loaded from anywhere; style and script are in the page. A plot that is saved
/// as PNG passes through an image made in the page.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// Charts are drawn by script; everything else is there without it.
const NO_SCRIPT: &str = "<noscript><p>Charts need JavaScript; the rest does not.</p></noscript>\n";

/// A longer sentence is set smaller, so that the first screen holds figures and a plot too.
const LONG_LEAD_CHARACTERS: usize = 110;

/// From this many open sections on a table of contents helps; folded ones are their own.
const SECTIONS_WORTH_CONTENTS: usize = 3;

#[derive(Debug, Clone)]
struct Tile {
    label: String,
    value: String,
    unit: String,
    note: String,
}

/// A report in the making.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    lead: String,
    tiles: Vec<Tile>,
    opening: String,
    sections: Vec<Section>,
    provenance: Option<Provenance>,
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            lead: String::new(),
            tiles: Vec::new(),
            opening: String::new(),
            sections: Vec::new(),
            provenance: None,
        }
    }

    /// The sentence the reader came for, in large type.
    pub fn lead(&mut self, sentence: impl Into<String>) {
        self.lead = sentence.into();
    }

    /// Adds a key figure.
    pub fn tile(
        &mut self,
        label: impl Into<String>,
        value: impl Into<String>,
        unit: impl Into<String>,
        note: impl Into<String>,
    ) {
        self.tiles.push(Tile {
            label: label.into(),
            value: value.into(),
            unit: unit.into(),
            note: note.into(),
        });
    }

    /// What the reader sees with the key figures on the first screen, above all sections.
    pub fn opening(&mut self, fill: impl FnOnce(&mut Section)) {
        let mut section = Section::new(String::new(), String::new());
        fill(&mut section);
        self.opening.push_str(&section.body);
    }

    /// Adds a section that is closed until the reader opens it, or a link to it does; in
    /// print it is open.
    pub fn folded_section(&mut self, heading: impl Into<String>, fill: impl FnOnce(&mut Section)) {
        self.section(heading, |section| {
            section.is_folded = true;
            fill(section);
        });
    }

    /// Adds a section; its id is made of the heading.
    pub fn section(&mut self, heading: impl Into<String>, fill: impl FnOnce(&mut Section)) {
        let heading = heading.into();
        self.section_with_id(&escape::slug(&heading), heading, fill);
    }

    /// Adds a section with an id of its own, for links that must last.
    pub fn section_with_id(
        &mut self,
        id: &str,
        heading: impl Into<String>,
        fill: impl FnOnce(&mut Section),
    ) {
        let mut section = Section::new(self.free_id(id), heading.into());
        fill(&mut section);
        self.sections.push(section);
    }

    /// Says how the page was made, in its footer.
    pub fn provenance(&mut self, provenance: Provenance) {
        self.provenance = Some(provenance);
    }

    /// Ids must differ: a number is appended to the second of a kind.
    fn free_id(&self, wanted: &str) -> String {
        let wanted = escape::slug(wanted);
        let taken: BTreeSet<&str> = self.sections.iter().map(|one| one.id.as_str()).collect();
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let mut candidates = std::iter::once(wanted.clone()).chain(numbered);
        candidates
            .find(|id| !taken.contains(id.as_str()))
            .unwrap_or(wanted)
    }

    /// The whole page as one self-contained HTML document.
    pub fn to_html(&self) -> String {
        let title = escape::html(&self.title);
        let sections: String = self.sections.iter().map(Section::to_html).collect();
        let footer = self
            .provenance
            .as_ref()
            .map(Provenance::to_html)
            .unwrap_or_default();
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             {NO_SCRIPT}<header>\n<h1>{title}</h1>\n{lead}{tiles}{opening}{contents}</header>\n\
             <main>\n{sections}</main>\n{footer}\
             <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            lead = self.lead_html(),
            tiles = self.tiles_html(),
            opening = self.opening,
            contents = self.contents_html(),
        )
    }

    /// Writes the page whole; see [`crate::output`].
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        write_whole(path, |out| out.write_all(self.to_html().as_bytes()))
    }

    fn lead_html(&self) -> String {
        match self.lead.as_str() {
            "" => String::new(),
            lead if lead.chars().count() > LONG_LEAD_CHARACTERS => {
                format!("<p class=\"lead long\">{}</p>\n", escape::prose(lead))
            }
            lead => format!("<p class=\"lead\">{}</p>\n", escape::prose(lead)),
        }
    }

    fn tiles_html(&self) -> String {
        if self.tiles.is_empty() {
            return String::new();
        }
        let tiles: String = self.tiles.iter().map(Tile::to_html).collect();
        format!("<dl class=\"tiles\">\n{tiles}</dl>\n")
    }

    fn contents_html(&self) -> String {
        let open = self.sections.iter().filter(|section| !section.is_folded);
        if open.count() < SECTIONS_WORTH_CONTENTS {
            return String::new();
        }
        let entry = |section: &Section| {
            let heading = escape::prose(&section.heading);
            format!("<li><a href=\"#{}\">{heading}</a></li>\n", section.id)
        };
        let entries: String = self.sections.iter().map(entry).collect();
        format!("<nav aria-label=\"Contents\"><ol>\n{entries}</ol></nav>\n")
    }
}

impl Tile {
    fn to_html(&self) -> String {
        format!(
            "<div><dt>{}</dt><dd class=\"value\">{} <span class=\"unit\">{}</span></dd>\
             <dd class=\"note\">{}</dd></div>\n",
            escape::prose(&self.label),
            escape::prose(&self.value),
            escape::prose(&self.unit),
            escape::prose(&self.note),
        )
    }
}

/// A section, or the inside of a collapsible part: elements in reading order.
///
/// Texts are escaped; `` `code` `` spans are the only markup they can hold.
#[derive(Debug, Clone)]
pub struct Section {
    id: String,
    heading: String,
    is_folded: bool,
    body: String,
}

impl Section {
    fn new(id: String, heading: String) -> Self {
        Self {
            id,
            heading,
            is_folded: false,
            body: String::new(),
        }
    }

    /// A paragraph.
    pub fn text(&mut self, text: impl AsRef<str>) {
        self.body
            .push_str(&format!("<p>{}</p>\n", escape::prose(text.as_ref())));
    }

    /// A paragraph that stands out: a caveat, a recommendation.
    pub fn callout(&mut self, text: impl AsRef<str>) {
        self.body.push_str(&format!(
            "<p class=\"callout\">{}</p>\n",
            escape::prose(text.as_ref())
        ));
    }

    /// A heading within the section.
    pub fn subheading(&mut self, text: impl AsRef<str>) {
        self.body
            .push_str(&format!("<h3>{}</h3>\n", escape::prose(text.as_ref())));
    }

    /// A bulleted list.
    pub fn list<Item: AsRef<str>>(&mut self, items: impl IntoIterator<Item = Item>) {
        let items = items.into_iter().map(|item| escape::prose(item.as_ref()));
        let items: String = items.map(|item| format!("<li>{item}</li>\n")).collect();
        self.body.push_str(&format!("<ul>\n{items}</ul>\n"));
    }

    /// Terms and what they mean.
    pub fn definitions<Term: AsRef<str>, Meaning: AsRef<str>>(
        &mut self,
        entries: impl IntoIterator<Item = (Term, Meaning)>,
    ) {
        self.body.push_str(&definitions_html(entries));
    }

    /// Text as it stands, in fixed-width type: commands, expressions, files.
    pub fn code(&mut self, text: impl AsRef<str>) {
        self.body
            .push_str(&format!("<pre>{}</pre>\n", escape::html(text.as_ref())));
    }

    /// A chart, or charts that share the x axis.
    pub fn chart(&mut self, chart: impl Into<ChartStack>) {
        self.body.push_str(&chart.into().to_html());
    }

    /// Bars with names.
    pub fn bars(&mut self, chart: BarChart) {
        self.body.push_str(&chart.to_html());
    }

    /// A heat or confusion matrix.
    pub fn matrix(&mut self, matrix: Matrix) {
        self.body.push_str(&matrix.to_html());
    }

    /// A table.
    pub fn table(&mut self, table: Table) {
        self.body.push_str(&table.to_html());
    }

    /// Elements side by side where the page is wide enough.
    pub fn row(&mut self, fill: impl FnOnce(&mut Section)) {
        let mut inside = Section::new(String::new(), String::new());
        fill(&mut inside);
        self.body
            .push_str(&format!("<div class=\"row\">\n{}</div>\n", inside.body));
    }

    /// A part that is closed until the reader opens it; in print it is open.
    pub fn details(&mut self, summary: impl AsRef<str>, fill: impl FnOnce(&mut Section)) {
        let mut inside = Section::new(String::new(), String::new());
        fill(&mut inside);
        let summary = escape::prose(summary.as_ref());
        self.body.push_str(&format!(
            "<details>\n<summary>{summary}</summary>\n{}</details>\n",
            inside.body
        ));
    }

    fn to_html(&self) -> String {
        let heading = escape::prose(&self.heading);
        let (id, body) = (&self.id, &self.body);
        if self.is_folded {
            return format!(
                "<section id=\"{id}\" class=\"folded\">\n<details>\n<summary><h2>{heading}</h2></summary>\n{body}</details>\n</section>\n"
            );
        }
        format!("<section id=\"{id}\">\n<h2>{heading}</h2>\n{body}</section>\n")
    }
}

fn definitions_html<Term: AsRef<str>, Meaning: AsRef<str>>(
    entries: impl IntoIterator<Item = (Term, Meaning)>,
) -> String {
    let entry = |(term, meaning): (Term, Meaning)| {
        let term = escape::prose(term.as_ref());
        format!(
            "<dt>{term}</dt><dd>{}</dd>\n",
            escape::prose(meaning.as_ref())
        )
    };
    let entries: String = entries.into_iter().map(entry).collect();
    format!("<dl>\n{entries}</dl>\n")
}

#[derive(Debug, Clone)]
struct InputFile {
    name: String,
    bytes: u64,
    hash: String,
}

/// How a page was made: all that is needed to make it again.
#[derive(Debug, Clone, Default)]
pub struct Provenance {
    command: String,
    facts: Vec<(String, String)>,
    files: Vec<InputFile>,
}

impl Provenance {
    /// Made by this command line.
    pub fn new(command: impl Into<String>) -> Self {
        Self {
            command: command.into(),
            ..Self::default()
        }
    }

    /// With this program version, seed, duration, ...
    pub fn fact(mut self, name: impl Into<String>, value: impl ToString) -> Self {
        self.facts.push((name.into(), value.to_string()));
        self
    }

    /// From this file; the hash is shown as given.
    pub fn file(mut self, name: impl Into<String>, bytes: u64, hash: impl Into<String>) -> Self {
        self.files.push(InputFile {
            name: name.into(),
            bytes,
            hash: hash.into(),
        });
        self
    }

    fn to_html(&self) -> String {
        let mut html = String::from("<footer>\n<h2>How this was made</h2>\n");
        if !self.command.is_empty() {
            html.push_str(&format!("<pre>{}</pre>\n", escape::html(&self.command)));
        }
        if !self.facts.is_empty() {
            html.push_str(&definitions_html(
                self.facts.iter().map(|(name, value)| (name, value)),
            ));
        }
        if !self.files.is_empty() {
            html.push_str(&self.files_table().to_html());
        }
        html.push_str("</footer>\n");
        html
    }

    fn files_table(&self) -> Table {
        let table = Table::new(["file", "size", "hash"]);
        self.files.iter().fold(table, |table, file| {
            let hash = format!("`{}`", file.hash);
            table.row([
                file.name.as_str().into(),
                number::bytes(file.bytes).into(),
                hash.into(),
            ])
        })
    }
}
