//! Renders a page of Markdown as plain text for a terminal.
//!
//! Headings are underlined, paragraphs and tables fit the width, and code is indented. A link is shown as its
//! text and its target: `The pad [pad]` for a page that `sketchnav help` shows, and
//! `channels.rs (schemas/src/channels.rs)` for any other file. HTML comments, which mark generated figures,
//! are omitted.

mod table;
mod target;

use pulldown_cmark::{CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd};

use super::Page;
use table::Table;

/// The indentation of code, in columns.
const CODE_COLUMNS: usize = 4;

/// Renders a page in lines of at most `columns`, except for code and words that are longer.
pub fn page(page: &Page, columns: usize) -> String {
    let mut writer = Writer {
        page,
        columns,
        out: String::new(),
        text: String::new(),
        links: Vec::new(),
        lists: Vec::new(),
        marker: None,
        table: Table::default(),
    };
    Parser::new_ext(page.text, Options::ENABLE_TABLES).for_each(|event| writer.take(event));
    writer.flush();
    writer.out.trim_end().to_owned()
}

/// A list that is open.
struct List {
    /// The number of the next item, or `None` if the items are not numbered.
    next: Option<u64>,
    /// The width of the current item's marker, which is the indentation of its text.
    marker_columns: usize,
}

/// Collects the text of each block and writes it when the block ends.
struct Writer<'a> {
    page: &'a Page,
    columns: usize,
    out: String,
    /// The text of the current paragraph, heading, item, cell or block of code.
    text: String,
    /// For each open link or picture, where its text starts and where it leads.
    links: Vec<(usize, String)>,
    lists: Vec<List>,
    /// The marker of an item whose first line is not yet written.
    marker: Option<String>,
    table: Table,
}

impl Writer<'_> {
    fn take(&mut self, event: Event<'_>) {
        match event {
            Event::Start(tag) => self.start(tag),
            Event::End(tag) => self.end(tag),
            Event::Text(text) => self.text.push_str(&text),
            Event::Code(code) => self.text.extend(["`", &code, "`"]),
            Event::SoftBreak => self.text.push(' '),
            Event::HardBreak => self.text.push('\n'),
            Event::InlineHtml(html) => self.text.push_str(&of_html(&html)),
            _ => {}
        }
    }

    fn start(&mut self, tag: Tag<'_>) {
        match tag {
            Tag::Paragraph | Tag::Heading { .. } | Tag::CodeBlock(_) | Tag::Table(_) => self.separate(),
            Tag::List(_) if !self.lists.is_empty() => self.flush(),
            Tag::List(_) => self.separate(),
            Tag::Emphasis => self.text.push('*'),
            _ => {}
        }
        match tag {
            Tag::Table(_) => self.table = Table::default(),
            Tag::List(first) => self.lists.push(List { next: first, marker_columns: 0 }),
            Tag::Item => self.start_item(),
            Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. } => self.start_link(&dest_url),
            _ => {}
        }
    }

    fn end(&mut self, tag: TagEnd) {
        match tag {
            TagEnd::Paragraph => self.flush(),
            TagEnd::Heading(level) => self.end_heading(level),
            TagEnd::CodeBlock => self.end_code(),
            TagEnd::Item => self.end_item(),
            TagEnd::List(_) => drop(self.lists.pop()),
            TagEnd::TableCell => self.table.add_cell(std::mem::take(&mut self.text)),
            TagEnd::TableHead | TagEnd::TableRow => self.table.end_row(),
            TagEnd::Table => {
                let lines = self.table.lines(self.columns - self.indent());
                self.write(lines.iter().map(String::as_str));
            }
            TagEnd::Emphasis => self.text.push('*'),
            TagEnd::Link => self.end_link(),
            TagEnd::Image => self.end_picture(),
            _ => {}
        }
    }

    fn start_item(&mut self) {
        self.flush();
        let Some(list) = self.lists.last_mut() else { return };
        let marker = list.next.map_or_else(|| "- ".to_owned(), |number| format!("{number}. "));
        list.next = list.next.map(|number| number + 1);
        list.marker_columns = marker.len();
        self.marker = Some(marker);
    }

    fn end_item(&mut self) {
        self.flush();
        self.marker = None;
        if let Some(list) = self.lists.last_mut() {
            list.marker_columns = 0;
        }
    }

    fn end_heading(&mut self, level: HeadingLevel) {
        let heading = self.text.clone();
        self.flush();
        let line = match level {
            HeadingLevel::H1 => "=",
            HeadingLevel::H2 => "-",
            _ => return,
        };
        self.write([line.repeat(heading.chars().count().min(self.columns)).as_str()]);
    }

    fn end_code(&mut self) {
        let code = std::mem::take(&mut self.text);
        let lines: Vec<_> = code.lines().map(|line| format!("{:CODE_COLUMNS$}{line}", "")).collect();
        self.write(lines.iter().map(String::as_str));
    }

    fn start_link(&mut self, url: &str) {
        self.links.push((self.text.len(), target::of(url, self.page)));
    }

    fn end_link(&mut self) {
        let Some((start, target)) = self.links.pop() else { return };
        let text = self.text.split_off(start);
        self.text.push_str(&target::shown(&text, &target));
    }

    fn end_picture(&mut self) {
        let Some((start, _)) = self.links.pop() else { return };
        let text = self.text.split_off(start);
        self.text.push_str(&picture(&text));
    }

    /// Returns the indentation of the text in the open lists, in columns.
    fn indent(&self) -> usize {
        self.lists.iter().map(|list| list.marker_columns).sum()
    }

    /// Writes the collected text in lines that fit.
    fn flush(&mut self) {
        let text = std::mem::take(&mut self.text);
        let lines = wrapped(&text, self.columns.saturating_sub(self.indent()));
        self.write(lines.iter().map(String::as_str));
    }

    /// Writes the collected text, and an empty line unless there is one already.
    fn separate(&mut self) {
        self.flush();
        if !self.out.is_empty() && !self.out.ends_with("\n\n") {
            self.out.push('\n');
        }
    }

    /// Writes lines, indented as the open lists require. The first line of an item begins with its marker.
    fn write<'a>(&mut self, lines: impl IntoIterator<Item = &'a str>) {
        for line in lines {
            let marker = self.marker.take().unwrap_or_default();
            let indent = self.indent() - marker.len();
            let line = format!("{:indent$}{marker}{line}", "");
            self.out.extend([line.trim_end(), "\n"]);
        }
    }
}

/// Breaks a text into lines of at most `columns` at its spaces. Line breaks in the text are kept.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > columns {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        lines.extend((!line.is_empty()).then_some(line));
    }
    lines
}

/// Returns the text for an element of HTML, which is only shown if it is a line break or a picture.
fn of_html(html: &CowStr<'_>) -> String {
    if html.starts_with("<br") {
        return "\n".to_owned();
    }
    let words = html.starts_with("<img").then(|| html.split("alt=\"").nth(1)?.split('"').next()).flatten();
    words.map(picture).unwrap_or_default()
}

fn picture(words: &str) -> String {
    format!("(picture: {words})")
}
