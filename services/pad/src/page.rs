//! The page's files, embedded when the program was built.

macro_rules! files {
    ($($name:literal: $kind:ident),* $(,)?) => {
        /// Name, `content-type` and bytes of each file.
        const FILES: &[(&str, &str, &[u8])] = &[$(($name, $kind, include_bytes!(concat!("../page/", $name))),)*];
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

files! {
    "index.html": HTML,
    "style.css": CSS,
    "icon.svg": SVG,
    "app.js": SCRIPT,
    "bar.js": SCRIPT,
    "canvas.js": SCRIPT,
    "desk.js": SCRIPT,
    "feed.js": SCRIPT,
    "files.js": SCRIPT,
    "geometry.js": SCRIPT,
    "ink.js": SCRIPT,
    "items.js": SCRIPT,
    "keyboard.js": SCRIPT,
    "link.js": SCRIPT,
    "measure.js": SCRIPT,
    "model.js": SCRIPT,
    "overlay.js": SCRIPT,
    "panel.js": SCRIPT,
    "pointer.js": SCRIPT,
    "select.js": SCRIPT,
    "selection.js": SCRIPT,
    "settings.js": SCRIPT,
    "snap.js": SCRIPT,
    "states.js": SCRIPT,
    "study.js": SCRIPT,
    "tools.js": SCRIPT,
    "transform.js": SCRIPT,
    "view.js": SCRIPT,
}

/// The file at a path of the server: its `content-type` and its bytes.
pub fn find(path: &str) -> Option<(&'static str, &'static [u8])> {
    let name = if path == "/" { "index.html" } else { path.strip_prefix('/')? };
    FILES.iter().find(|(known, ..)| *known == name).map(|(_, kind, bytes)| (*kind, *bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_that_the_page_imports_is_served() {
        assert!(find("/").is_some() && find("/../Cargo.toml").is_none() && find("").is_none());
        for (name, kind, bytes) in FILES.iter().filter(|(_, kind, _)| *kind == SCRIPT) {
            let text = std::str::from_utf8(bytes).unwrap();
            for imported in text.split(" from \"./").skip(1).filter_map(|rest| rest.split('"').next()) {
                assert!(find(&format!("/{imported}")).is_some(), "{name} ({kind}) imports {imported}");
            }
        }
    }

    #[test]
    fn no_file_of_the_folder_is_forgotten() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/page");
        for entry in std::fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let is_asset = [".html", ".css", ".js", ".svg"].iter().any(|end| name.ends_with(end));
            assert!(!is_asset || find(&format!("/{name}")).is_some(), "{name}");
        }
    }
}
