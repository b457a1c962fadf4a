//! Where the links of a page lead.

use super::super::Page;

/// Returns the text for a link's target: the topic of another page in brackets, a file or an address in parentheses, and nothing
/// for a heading of the same page.
pub fn of(url: &str, page: &Page) -> String {
    let file = url.split('#').next().unwrap_or_default();
    if url.contains("://") {
        return format!("({url})");
    }
    if file.is_empty() {
        return String::new();
    }
    let path = path_from(page.path, file);
    match Page::at(&path) {
        Some(other) if other.path == page.path => String::new(),
        Some(other) => format!("[{}]", other.topic()),
        None => format!("({path})"),
    }
}

/// Returns the path in the repository of a file that a page names relative to its own folder.
fn path_from(page: &str, file: &str) -> String {
    let mut parts: Vec<_> = page.split('/').collect();
    parts.pop();
    for part in file.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Shows a link. A text that only repeats the target is left out.
pub fn shown(text: &str, target: &str) -> String {
    let name = target.trim_matches(['[', ']', '(', ')']);
    let plain = text.trim_matches('`');
    match target {
        "" => text.to_owned(),
        target if target.starts_with('[') && plain.eq_ignore_ascii_case(name) => format!("[{plain}]"),
        _ if plain == name => text.to_owned(),
        target => format!("{text} {target}"),
    }
}
