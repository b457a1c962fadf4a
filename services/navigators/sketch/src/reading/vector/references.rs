//! Counts the elements of an SVG, with each reference counted as its target. This has to happen before any reference is followed,
//! since ten lines of `<use>` can expand to a billion elements. Style sheets have already been removed at this point.

use std::collections::BTreeMap;

use resvg::usvg::roxmltree::{Document, Node};

use super::super::budget::{MOST_DEPTH, MOST_ELEMENTS};

/// A limit that a drawing exceeds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TooMuch {
    /// The limit, in words.
    pub limit: String,
    /// The excess that was found, and where.
    pub found: String,
}

/// Checks that a document neither has too many elements nor nests them too deeply.
pub(crate) fn check(document: &Document) -> Result<(), TooMuch> {
    let mut ids = BTreeMap::new();
    for node in document.descendants() {
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
    }
    let nodes = document.descendants().count();
    let mut count = Count { ids, counts: vec![None; nodes + 1] };
    count.of(document.root_element(), 0).map(drop)
}

/// Returns the name of an element, for error messages.
pub(super) fn name(node: Node) -> String {
    let tag = node.tag_name().name();
    node.attribute("id").map_or_else(|| format!("<{tag}>"), |id| format!("<{tag} id={id:?}>"))
}

struct Count<'a, 'input> {
    ids: BTreeMap<&'a str, Node<'a, 'input>>,
    /// The count of each node, once known. It is 0 while it is being computed, so that a reference to an enclosing element is
    /// ignored.
    counts: Vec<Option<f64>>,
}

impl<'a, 'input> Count<'a, 'input> {
    fn of(&mut self, node: Node<'a, 'input>, depth: usize) -> Result<f64, TooMuch> {
        let at = node.id().get_usize();
        if let Some(known) = self.counts.get(at).copied().flatten() {
            return Ok(known);
        }
        if depth > MOST_DEPTH {
            let limit = format!("{MOST_DEPTH} SVG elements inside each other, references included");
            return Err(TooMuch { limit, found: format!("more around {}", name(node)) });
        }
        self.counts[at] = Some(0.0);
        let mut sum = 1.0;
        for child in node.children().filter(Node::is_element) {
            sum += self.of(child, depth + 1)?;
        }
        for (target, times) in self.references(node) {
            sum += times * self.of(target, depth + 1)?;
        }
        if sum > MOST_ELEMENTS {
            let limit =
                format!("{MOST_ELEMENTS} elements of SVG, each reference counted as what it refers to");
            return Err(TooMuch { limit, found: format!("more in {}", name(node)) });
        }
        self.counts[at] = Some(sum);
        Ok(sum)
    }

    /// Returns the elements that this one refers to, and how many times each is drawn for it.
    fn references(&self, node: Node<'a, 'input>) -> Vec<(Node<'a, 'input>, f64)> {
        let attributes = node.attributes().flat_map(|attribute| {
            let link =
                (attribute.name() == "href").then(|| attribute.value().trim().strip_prefix('#')).flatten();
            urls(attribute.value()).chain(link)
        });
        let targets = attributes.filter_map(|id| self.ids.get(id).copied());
        let targets = targets.map(|target| {
            let is_marker = target.tag_name().name() == "marker";
            (target, if is_marker { places(node) } else { 1.0 })
        });
        targets.collect()
    }
}

/// Returns an upper bound for the number of markers drawn on a shape.
fn places(node: Node) -> f64 {
    let shape =
        ["d", "points"].into_iter().filter_map(|key| node.attribute(key)).map(str::len).sum::<usize>();
    // Markers are inherited, so those of a group are drawn for the shapes inside.
    let inside =
        || node.descendants().skip(1).filter_map(|inner| inner.attribute("d").or(inner.attribute("points")));
    let all = if node.has_children() { inside().map(str::len).sum::<usize>() } else { shape };
    3.0 + all as f64 / 2.0
}

/// Returns the ids in `url(#id)`.
fn urls(text: &str) -> impl Iterator<Item = &str> {
    text.split("url(").skip(1).filter_map(|after| {
        let inside = after.split(')').next()?.trim().trim_matches(['"', '\'']);
        inside.strip_prefix('#')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(inside: &str) -> Result<(), TooMuch> {
        let text = format!("<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'>{inside}</svg>");
        check(&Document::parse(&text).unwrap())
    }

    fn found(inside: &str) -> String {
        checked(inside).unwrap_err().found
    }

    /// Builds `levels` elements, each of which expands to ten of the previous one.
    fn tenfold(
        levels: usize,
        element: impl Fn(usize, &str) -> String,
        one: impl Fn(usize) -> String,
    ) -> String {
        let level = |level: usize| element(level, &one(level.wrapping_sub(1)).repeat(10));
        (1..=levels).map(level).collect()
    }

    #[test]
    fn references_count_as_what_they_refer_to_however_they_are_written() {
        let uses =
            tenfold(9, |i, inside| format!("<g id='g{i}'>{inside}</g>"), |i| format!("<use href='#g{i}'/>"));
        assert_eq!(found(&uses), "more in <g id=\"g6\">");
        let masks = |attribute: &dyn Fn(usize) -> String| {
            tenfold(
                9,
                |i, inside| format!("<mask id='m{i}'>{inside}</mask>"),
                |i| format!("<rect {}/>", attribute(i)),
            )
        };
        assert_eq!(found(&masks(&|i| format!("mask='url(#m{i})'"))), "more in <mask id=\"m6\">");
    }

    #[test]
    fn markers_count_for_every_corner() {
        let marker = format!("<marker id='m'>{}</marker>", "<rect/>".repeat(1000));
        let path =
            |corners| format!("{marker}<path marker-mid='url(#m)' d='M0 0{}'/>", " 1 1".repeat(corners));
        assert!(checked(&path(50)).is_ok());
        assert_eq!(found(&path(1000)), "more in <path>");
    }

    #[test]
    fn a_reference_to_what_is_around_it_ends() {
        assert!(
            checked("<g id='a'><use href='#a'/><use href='#b'/></g><g id='b'><use href='#a'/></g>").is_ok()
        );
    }

    #[test]
    fn elements_are_few_and_not_deep() {
        let deep = format!("{}{}", "<g>".repeat(101), "</g>".repeat(101));
        assert_eq!(found(&deep), "more around <g>");
        assert!(checked(&"<path d='M0 0'/>".repeat(50_000)).is_ok());
        assert_eq!(found(&"<path/>".repeat(200_001)), "more in <svg>");
    }
}
