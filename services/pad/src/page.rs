//! The files of the page, which are embedded when the program is built.

macro_rules! files {
    ($($name:literal: $kind:ident),* $(,)?) => {
        /// Name, `content-type` and bytes of each file.
        const FILES: &[(&str, &str, &[u8])] = &[$(($name, $kind, include_bytes!(concat!("../page/", $name))),)*];
        /// The paths of all files in JSON, for the page to keep.
        const LIST: &str = concat!("[\"/\"", $(",\"/", $name, "\"",)* "]");
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";
const MANIFEST: &str = "application/manifest+json";
const JSON: &str = "application/json";

files! {
    "index.html": HTML,
    "style.css": CSS,
    "icon.svg": SVG,
    "app.js": SCRIPT,
    "bar.js": SCRIPT,
    "canvas.js": SCRIPT,
    "checks.js": SCRIPT,
    "desk.js": SCRIPT,
    "excalidraw.js": SCRIPT,
    "exchange.js": SCRIPT,
    "feed.js": SCRIPT,
    "files.js": SCRIPT,
    "geometry.js": SCRIPT,
    "grid.js": SCRIPT,
    "history.js": SCRIPT,
    "ink.js": SCRIPT,
    "items.js": SCRIPT,
    "keeper.js": SCRIPT,
    "keyboard.js": SCRIPT,
    "learned.js": SCRIPT,
    "library.js": SCRIPT,
    "link.js": SCRIPT,
    "manifest.webmanifest": MANIFEST,
    "measure.js": SCRIPT,
    "model.js": SCRIPT,
    "outline.js": SCRIPT,
    "outside.js": SCRIPT,
    "overlay.js": SCRIPT,
    "panel.js": SCRIPT,
    "people.js": SCRIPT,
    "placing.js": SCRIPT,
    "pointer.js": SCRIPT,
    "select.js": SCRIPT,
    "selection.js": SCRIPT,
    "settings.js": SCRIPT,
    "shared.js": SCRIPT,
    "shelf.js": SCRIPT,
    "snap.js": SCRIPT,
    "states.js": SCRIPT,
    "study.js": SCRIPT,
    "svg.js": SCRIPT,
    "svgfile.js": SCRIPT,
    "sw.js": SCRIPT,
    "together.js": SCRIPT,
    "tools.js": SCRIPT,
    "transform.js": SCRIPT,
    "view.js": SCRIPT,
    "wheel.js": SCRIPT,
}

/// Returns the file at a path of the server, as its `content-type` and its bytes.
pub fn find(path: &str) -> Option<(&'static str, &'static [u8])> {
    let name = if path == "/" { "index.html" } else { path.strip_prefix('/')? };
    if name == "files.json" {
        return Some((JSON, LIST.as_bytes()));
    }
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
    fn the_list_names_every_file_once() {
        let (_, list) = find("/files.json").unwrap();
        let paths: Vec<String> = serde_json::from_slice(list).unwrap();
        assert_eq!(paths.len(), FILES.len() + 1);
        assert!(paths.iter().all(|path| find(path).is_some()), "{paths:?}");
    }

    /// People who consider the page for a slow link read its size in the manual.
    #[test]
    fn the_manual_states_the_size_of_the_page() {
        let manual = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/pad.md");
        let manual = std::fs::read_to_string(manual).unwrap();
        let kilobytes = FILES.iter().map(|(.., bytes)| bytes.len()).sum::<usize>() as f64 / 1e3;
        let (_, stated) = manual.split_once("The page consists of ").unwrap();
        let (files, stated) = stated.split_once(" files with ").unwrap();
        let (stated, _) = stated.split_once(" kB").unwrap();
        assert_eq!(files.parse(), Ok(FILES.len()));
        let stated: f64 = stated.parse().unwrap();
        assert!((stated / kilobytes - 1.0).abs() < 0.05, "expected about {kilobytes:.0} kB, found {stated}");
    }

    #[test]
    fn no_file_of_the_folder_is_forgotten() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/page");
        for entry in std::fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let is_asset =
                [".html", ".css", ".js", ".svg", ".webmanifest"].iter().any(|end| name.ends_with(end));
            assert!(!is_asset || find(&format!("/{name}")).is_some(), "{name}");
        }
    }
}
