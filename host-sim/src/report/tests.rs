//! What must hold for a whole page.

use super::*;

const HOSTILE: &str = "</script><img src=x onerror=\"alert('p_a')\"><!--";

/// A page that names something hostile wherever foreign text can go.
fn hostile_page() -> Page {
    let mut page = Page::new(HOSTILE);
    page.lead(HOSTILE);
    page.tile(HOSTILE, HOSTILE, HOSTILE, HOSTILE);
    for _ in 0..3 {
        page.section(HOSTILE, fill_hostile);
    }
    let made = Provenance::new(HOSTILE).fact(HOSTILE, HOSTILE);
    page.provenance(made.file(HOSTILE, 1, HOSTILE));
    page
}

fn fill_hostile(section: &mut Section) {
    section.text(HOSTILE);
    section.callout(HOSTILE);
    section.subheading(HOSTILE);
    section.list([HOSTILE]);
    section.definitions([(HOSTILE, HOSTILE)]);
    section.code(HOSTILE);
    section.row(|row| row.chart(hostile_chart()));
    section.chart(
        ChartStack::new(HOSTILE)
            .panel(hostile_chart())
            .note(HOSTILE),
    );
    section.details(HOSTILE, |inside| {
        inside.table(Table::new([HOSTILE]).caption(HOSTILE).row([HOSTILE.into()]));
    });
    section.bars(
        BarChart::new(HOSTILE, [HOSTILE])
            .axis(HOSTILE, HOSTILE)
            .bars(HOSTILE, Role::Given, [1.0])
            .bars(HOSTILE, Role::Given, [])
            .note(HOSTILE),
    );
    let matrix = Matrix::new(HOSTILE, [HOSTILE], [HOSTILE], vec![vec![1.0]]);
    section.matrix(matrix.axes(HOSTILE, HOSTILE).note(HOSTILE));
}

fn hostile_chart() -> Chart {
    Chart::new(HOSTILE)
        .x_axis(HOSTILE, HOSTILE)
        .y_axis(HOSTILE, HOSTILE)
        .series(Series::new(HOSTILE, Role::Mark, [(0.0, 1.0)]))
        .band(HOSTILE, Role::Noise, [(0.0, 0.0, 1.0)])
        .interval(0.0, 1.0, HOSTILE)
        .level(1.0, HOSTILE)
        .note(HOSTILE)
        .describe(HOSTILE)
}

/// A tag as a browser would see it: its name, whether it closes, its text.
struct Tag<'a> {
    name: &'a str,
    closes: bool,
    text: &'a str,
}

/// The tags of a page; what is inside style and script is skipped as a
/// browser skips it.
fn tags(html: &str) -> Vec<Tag<'_>> {
    let mut tags = Vec::new();
    let mut rest = html;
    while let Some(start) = rest.find('<') {
        let length = rest[start..].find('>').expect("a tag ends") + 1;
        let text = &rest[start..start + length];
        rest = &rest[start + length..];
        let inside = text.trim_start_matches("</").trim_start_matches('<');
        let end = inside.find([' ', '>', '\n']).expect("a tag has a name");
        let name = &inside[..end];
        let closes = text.starts_with("</");
        tags.push(Tag { name, closes, text });
        if !closes && (name == "script" || name == "style") {
            let end = rest
                .find(&format!("</{name}"))
                .expect("script and style end");
            rest = &rest[end..];
        }
    }
    tags
}

const VOID: [&str; 2] = ["!doctype", "meta"];

#[test]
fn regress_hostile_names_stay_text() {
    let html = hostile_page().to_html();
    let allowed = [
        "!doctype",
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "header",
        "h1",
        "h2",
        "h3",
        "p",
        "dl",
        "div",
        "dt",
        "dd",
        "span",
        "nav",
        "ol",
        "ul",
        "li",
        "a",
        "main",
        "section",
        "pre",
        "figure",
        "figcaption",
        "script",
        "table",
        "caption",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
        "i",
        "details",
        "summary",
        "footer",
        "code",
        "noscript",
    ];
    for tag in tags(&html) {
        assert!(allowed.contains(&tag.name), "{}", tag.text);
        assert!(!tag.text.contains("onerror=\""), "{}", tag.text);
    }
    assert!(!html.contains("<!--"));
}

#[test]
fn regress_embedded_data_is_json_and_keeps_names() {
    let html = hostile_page().to_html();
    let opening = "<script type=\"application/json\">";
    let mut charts = 0;
    for piece in html.split(opening).skip(1) {
        let text = piece.split("</script").next().unwrap();
        let data: serde_json::Value = serde_json::from_str(text).unwrap();
        assert_eq!(data["panels"][0]["series"][0]["name"], HOSTILE);
        charts += 1;
    }
    assert_eq!(charts, 6);
}

#[test]
fn regress_tags_balance() {
    let html = hostile_page().to_html();
    let mut open: Vec<&str> = Vec::new();
    for tag in tags(&html) {
        if tag.closes {
            assert_eq!(open.pop(), Some(tag.name), "{}", tag.text);
        } else if !VOID.contains(&tag.name) {
            open.push(tag.name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn regress_ids_differ_and_links_lead_somewhere() {
    let html = hostile_page().to_html();
    let values = |attribute: &str| -> Vec<String> {
        let pieces = html.split(attribute).skip(1);
        pieces
            .map(|piece| piece.split('"').next().unwrap().to_owned())
            .collect()
    };
    let ids = values(" id=\"");
    let mut unique = ids.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), 3);
    assert_eq!(values("href=\"#"), ids);
}

#[test]
fn regress_nothing_is_loaded_from_anywhere() {
    let mut page = Page::new("t");
    page.section("s", |section| {
        section.chart(Chart::new("c"));
        section.text("a sentence");
    });
    let html = page.to_html();
    for trace in [
        "http:", "https:", "//www", "src=", "<link", "@import", "url(", "fetch(", "import(",
    ] {
        assert!(!html.contains(trace), "{trace}");
    }
    assert!(html.contains("default-src 'none'"));
}

#[test]
fn regress_headings_descend_one_by_one() {
    let html = hostile_page().to_html();
    let levels = tags(&html)
        .into_iter()
        .filter(|tag| !tag.closes && tag.name.len() == 2);
    let levels: Vec<usize> = levels
        .filter_map(|tag| tag.name.strip_prefix('h')?.parse().ok())
        .collect();
    assert_eq!(levels.first(), Some(&1));
    assert!(levels.windows(2).all(|pair| pair[1] <= pair[0] + 1));
}

#[test]
fn regress_same_input_same_bytes() {
    assert_eq!(hostile_page().to_html(), hostile_page().to_html());
}

#[test]
fn regress_writing_replaces_and_leaves_nothing_behind() {
    let folder = std::env::temp_dir().join(format!("report-test-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("report.html");
    std::fs::write(&path, "old").unwrap();
    Page::new("new").write(&path).unwrap();
    assert!(
        std::fs::read_to_string(&path)
            .unwrap()
            .contains("<h1>new</h1>")
    );
    assert!(
        Page::new("x")
            .write(&folder.join("no/such/folder.html"))
            .is_err()
    );
    // A folder cannot be replaced by a file: the temporary file must go too.
    std::fs::create_dir(folder.join("taken")).unwrap();
    assert!(Page::new("x").write(&folder.join("taken")).is_err());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
    std::fs::remove_dir_all(&folder).unwrap();
}
