//! The drawing in which several pages draw at once, and who draws in it.
//!
//! Every page has the same items as the pad, by their ids. A change replaces an item as a whole, or removes it, and carries the time
//! of the change and a random name of the page that made it. Of two versions of an item, the later one stays, and if both are equally
//! late, the one with the greater name (a last-writer-wins register for each item, Shapiro et al. 2011, section 3.2). The result
//! therefore does not depend on the order in which changes arrive, or on how often they do, and pages that were cut off send what
//! they have changed meanwhile. Removed items are kept without their content, so that they stay removed.
//!
//! The times are those of the pages' clocks, but a page that knows a change in its future counts on from there, by one with each change
//! (a hybrid logical clock, Kulkarni et al. 2014). Changes must therefore leave times to those that follow: after a single one with the
//! largest time, nobody could change its item again. So a change may be no later than the year 2100, or than shortly after the latest
//! one that was accepted. It may be early by any amount, because pages can be without a link for days.
//!
//! This module is pure: it knows no connections and no clock.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::json;
use sketchnav_schemas::bounds::ANGLE_DEG;
use sketchnav_schemas::message::{MAX_DRAWING_BYTES, MAX_DRAWN_POINTS, MAX_ROUTE_POINTS, MAX_TASKS};

use crate::protocol::{MAX_STROKES, Presence, Refusal, parse};

/// Maximum number of items, including removed ones.
const MAX_ITEMS: usize = 4 * MAX_STROKES;
/// Maximum number of characters of a text in a drawing.
const MAX_WORDS: usize = 400;
/// Maximum distance of a coordinate from the origin, in pixels, and maximum side of a canvas.
const FAR_PX: f64 = 100_000.0;
const MAX_SIDE_PX: u32 = 30_000;
/// Maximum width of a stroke, in pixels.
const MAX_WIDTH_PX: f64 = 1000.0;
/// Largest time of a change: JavaScript's numbers are exact up to twice this value.
const MAX_TIME: u64 = 1 << 52;
/// Times that clocks can show: up to the year 2100, in milliseconds since 1970.
const LATEST_CLOCK_MS: u64 = 4_102_444_800_000;
/// How far a change may be ahead of that, or of all changes before it. A page that was without a link has counted its own changes.
const MAX_AHEAD: u64 = 1 << 20;
/// Maximum length of an id.
const MAX_ID: usize = 32;

type Point = [f64; 2];

/// What is drawn, in the members of the page's drawing (`page/model.js`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Shape {
    Strokes {
        points: Vec<Point>,
        width_px: f64,
        #[serde(default)]
        pressure: Option<Vec<f64>>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        group: Option<u32>,
    },
    Obstacles {
        polygon: Vec<Point>,
        label: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        group: Option<u32>,
    },
    Labels {
        text: String,
        at: Point,
    },
    Goals {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        at: Point,
    },
    Route(Vec<Point>),
    Start {
        at: Point,
        heading_deg: f64,
    },
    Photo(String),
    Underlay(String),
}

/// A version of an item.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    id: String,
    /// When it was changed, and by which page.
    time: u64,
    by: String,
    /// Its place among the items of its kind.
    order: f64,
    /// `None` if it was removed.
    shape: Option<Shape>,
}

/// Identifies a drawing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    id: String,
    canvas: [u32; 2],
}

/// A page's changes of a drawing.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    sheet: Sheet,
    /// The drawing that this one replaces; empty if none has been shared.
    instead: Option<String>,
    entries: Vec<Entry>,
}

fn expect(holds: bool, place: &str, expected: &str) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err(Refusal::Malformed(format!("{place}: expected {expected}"))) }
}

fn is_id(text: &str) -> bool {
    (1..=MAX_ID).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_alphanumeric())
}

fn is_near(point: &Point) -> bool {
    point.iter().all(|number| number.abs() <= FAR_PX)
}

fn is_picture(url: &str) -> bool {
    let content =
        ["data:image/png;base64,", "data:image/jpeg;base64,"].iter().find_map(|head| url.strip_prefix(head));
    content
        .is_some_and(|text| text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/=".contains(&byte)))
}

impl Shape {
    /// The id of a kind of which a drawing has at most one.
    fn only(&self) -> Option<&'static str> {
        match self {
            Self::Route(_) => Some("route"),
            Self::Start { .. } => Some("start"),
            Self::Photo(_) => Some("photo"),
            Self::Underlay(_) => Some("underlay"),
            Self::Strokes { .. } | Self::Obstacles { .. } | Self::Labels { .. } | Self::Goals { .. } => None,
        }
    }

    fn points(&self) -> &[Point] {
        match self {
            Self::Strokes { points, .. } | Self::Route(points) => points,
            Self::Obstacles { polygon, .. } => polygon,
            Self::Labels { at, .. } | Self::Goals { at, .. } | Self::Start { at, .. } => {
                std::slice::from_ref(at)
            }
            Self::Photo(_) | Self::Underlay(_) => &[],
        }
    }

    fn check(&self, place: &str) -> Result<(), Refusal> {
        expect(self.points().iter().all(is_near), place, "points within 100000 px")?;
        let is_short = |text: &str| text.chars().count() <= MAX_WORDS;
        match self {
            Self::Strokes { points, width_px, pressure, .. } => {
                expect(!points.is_empty(), place, "1 point or more")?;
                expect(*width_px > 0.0 && *width_px <= MAX_WIDTH_PX, place, "a width above 0, at most 1000")?;
                let fits =
                    |all: &Vec<f64>| all.len() == points.len() && all.iter().all(|p| (0.0..=1.0).contains(p));
                expect(pressure.as_ref().is_none_or(fits), place, "a pressure from 0 to 1 for each point")
            }
            Self::Obstacles { polygon, label, .. } => {
                expect(polygon.len() >= 3, place, "3 points or more")?;
                expect(is_short(label), place, "a label of at most 400 characters")
            }
            Self::Labels { text, .. } => {
                expect(!text.trim().is_empty() && is_short(text), place, "a text of 1 to 400 characters")
            }
            Self::Goals { name, .. } => {
                expect(name.as_deref().is_none_or(is_short), place, "a name of at most 400 characters")
            }
            Self::Route(points) if points.len() > MAX_ROUTE_POINTS => {
                Err(Refusal::too_large(MAX_ROUTE_POINTS, "points of a route", points.len()))
            }
            Self::Route(points) => expect(points.len() >= 2, place, "2 points or more"),
            Self::Start { heading_deg, .. } => expect(ANGLE_DEG.holds(*heading_deg), place, ANGLE_DEG.words),
            Self::Photo(url) | Self::Underlay(url) => {
                expect(is_picture(url), place, "a PNG or JPEG as a data URL")
            }
        }
    }

    fn size(&self, bytes: usize) -> Size {
        let size = Size { bytes, ..Size::default() };
        match self {
            Self::Strokes { points, .. } => Size { shapes: 1, points: points.len(), ..size },
            Self::Obstacles { polygon, .. } => Size { shapes: 1, points: polygon.len(), ..size },
            Self::Labels { .. } => Size { texts: 1, ..size },
            Self::Goals { .. } => Size { goals: 1, ..size },
            Self::Route(_) | Self::Start { .. } | Self::Photo(_) | Self::Underlay(_) => size,
        }
    }
}

impl Entry {
    fn check(&self, place: &str) -> Result<(), Refusal> {
        expect(is_id(&self.id), place, "an id of 1 to 32 letters and digits")?;
        expect(is_id(&self.by), place, "a page's name of 1 to 32 letters and digits")?;
        expect((1..MAX_TIME).contains(&self.time), place, "a time from 1 to 2⁵² ms")?;
        expect(self.order.is_finite(), place, "a finite order")?;
        let Some(shape) = &self.shape else { return Ok(()) };
        let is_reserved = ["route", "start", "photo", "underlay"].contains(&self.id.as_str());
        let own = shape.only();
        expect(own.map_or(!is_reserved, |only| only == self.id), place, "the id of its kind")?;
        shape.check(place)
    }

    /// `latest` is the latest time of the changes before.
    fn check_time(&self, place: &str, latest: u64) -> Result<(), Refusal> {
        let holds = self.time <= latest.max(LATEST_CLOCK_MS) + MAX_AHEAD;
        expect(holds, place, "a time before the year 2100; check this device's clock")
    }
}

impl Change {
    /// Parses a request.
    ///
    /// # Errors
    /// [`Refusal::Malformed`], which gives the entry and what was expected.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        let change: Self = parse("the change", bytes)?;
        let sides = change.sheet.canvas.iter().all(|side| (1..=MAX_SIDE_PX).contains(side));
        expect(sides, "sheet.canvas", "two sides of 1 to 30000 px")?;
        expect(is_id(&change.sheet.id), "sheet.id", "1 to 32 letters and digits")?;
        for (i, entry) in change.entries.iter().enumerate() {
            entry.check(&format!("entries[{i}]"))?;
        }
        Ok(change)
    }
}

/// What a drawing contains, to be compared with the limits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Size {
    shapes: usize,
    points: usize,
    texts: usize,
    goals: usize,
    bytes: usize,
}

impl Size {
    fn each(self, other: Self, change: impl Fn(usize, usize) -> usize) -> Self {
        Self {
            shapes: change(self.shapes, other.shapes),
            points: change(self.points, other.points),
            texts: change(self.texts, other.texts),
            goals: change(self.goals, other.goals),
            bytes: change(self.bytes, other.bytes),
        }
    }

    fn check(self, items: usize) -> Result<(), Refusal> {
        for (found, limit, unit) in [
            (self.shapes, MAX_STROKES, "strokes and obstacles"),
            (self.points, MAX_DRAWN_POINTS, "points in all strokes and obstacles"),
            (self.texts, MAX_STROKES, "texts"),
            (self.goals, MAX_TASKS, "goals"),
            (self.bytes, MAX_DRAWING_BYTES, "bytes of a drawing"),
            (items, MAX_ITEMS, "items, including removed ones: begin a new drawing"),
        ] {
            if found > limit {
                return Err(Refusal::too_large(limit, unit, found));
            }
        }
        Ok(())
    }
}

/// An item as the pad keeps it.
#[derive(Debug)]
struct Kept {
    stamp: (u64, String),
    /// As pages receive it.
    text: String,
    size: Size,
    /// Its place among the arrivals.
    seq: u64,
}

/// A page that is open.
#[derive(Debug, Default)]
struct Person {
    session: String,
    connections: u32,
    presence: Presence,
}

/// The drawing that is shared, and the pages.
#[derive(Debug, Default)]
pub struct Room {
    sheet: Option<Sheet>,
    items: BTreeMap<String, Kept>,
    /// The ids of the items in the order in which their versions arrived.
    arrivals: BTreeMap<u64, String>,
    seq: u64,
    size: Size,
    /// The latest time of all changes.
    latest: u64,
    people: BTreeMap<u32, Person>,
}

impl Room {
    /// Makes a page's changes, all of them or none.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] if another drawing is shared, [`Refusal::Malformed`] if a change is too far in the future, or
    /// [`Refusal::TooLarge`].
    pub fn make(&mut self, change: Change) -> Result<(), Refusal> {
        let Change { sheet, instead, entries } = change;
        let shared = self.sheet.as_ref().map_or("", |shared| shared.id.as_str());
        if sheet.id == shared {
            return self.merge(entries);
        }
        if instead.as_deref() != Some(shared) {
            return Err(Refusal::NotNow("the others draw in another drawing now".into()));
        }
        let people = std::mem::take(&mut self.people);
        let mut next = Self { sheet: Some(sheet), seq: self.seq + 1, people, ..Self::default() };
        let merged = next.merge(entries);
        match merged {
            Ok(()) => *self = next,
            Err(_) => self.people = next.people,
        }
        merged
    }

    fn merge(&mut self, entries: Vec<Entry>) -> Result<(), Refusal> {
        let mut news: BTreeMap<String, Kept> = BTreeMap::new();
        let mut latest = self.latest;
        for (i, entry) in entries.into_iter().enumerate() {
            entry.check_time(&format!("entries[{i}]"), self.latest)?;
            latest = latest.max(entry.time);
            let stamp = (entry.time, entry.by.clone());
            let known = news.get(&entry.id).or_else(|| self.items.get(&entry.id));
            if known.is_some_and(|known| known.stamp >= stamp) {
                continue;
            }
            let text = serde_json::to_string(&entry).unwrap_or_default();
            let size = entry.shape.as_ref().map_or_else(Size::default, |shape| shape.size(text.len()));
            news.insert(entry.id, Kept { stamp, text, size, seq: 0 });
        }
        let before = |id: &String| self.items.get(id).map_or_else(Size::default, |kept| kept.size);
        let size = news.iter().fold(self.size, |size, (id, kept)| {
            size.each(before(id), |a, b| a - b).each(kept.size, |a, b| a + b)
        });
        let added = news.keys().filter(|id| !self.items.contains_key(*id)).count();
        size.check(self.items.len() + added)?;
        (self.size, self.latest) = (size, latest);
        for (id, mut kept) in news {
            self.seq += 1;
            kept.seq = self.seq;
            self.arrivals.insert(self.seq, id.clone());
            if let Some(old) = self.items.insert(id, kept) {
                self.arrivals.remove(&old.seq);
            }
        }
        Ok(())
    }

    /// Returns the message with everything that arrived after `seq`, and the number of the last arrival.
    pub fn news(&self, seq: u64) -> (String, u64) {
        let sheet = serde_json::to_string(&self.sheet).unwrap_or_default();
        let ids = self.arrivals.range(seq + 1..).map(|(_, id)| id);
        let texts: Vec<_> = ids.filter_map(|id| self.items.get(id)).map(|kept| kept.text.as_str()).collect();
        (format!("{{\"drawn\":{{\"sheet\":{sheet},\"entries\":[{}]}}}}", texts.join(",")), self.seq)
    }

    /// Adds a connection of a page.
    pub fn enter(&mut self, page: u32, session: &str) {
        let person = self.people.entry(page).or_default();
        session.clone_into(&mut person.session);
        person.connections += 1;
    }

    /// Records that a connection of the page has ended.
    pub fn leave(&mut self, page: u32) {
        let Some(person) = self.people.get_mut(&page) else { return };
        person.connections = person.connections.saturating_sub(1);
        if person.connections == 0 {
            self.people.remove(&page);
        }
    }

    /// Shows the others where a page draws.
    pub fn show(&mut self, page: u32, presence: Presence) {
        if let Some(person) = self.people.get_mut(&page) {
            person.presence = presence;
        }
    }

    /// Returns the message with all pages, for this one.
    pub fn people(&self, own: u32, driver: Option<&str>) -> String {
        let person = |(page, Person { session, presence, .. }): (&u32, &Person)| {
            let Presence { name, sheet, at, draft } = presence;
            let drives = driver == Some(session.as_str());
            json!({ "page": page, "name": name, "sheet": sheet, "at": at, "draft": draft, "drives": drives })
        };
        let all: Vec<_> = self.people.iter().map(person).collect();
        json!({ "people": { "me": own, "all": all } }).to_string()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::Value;

    use super::*;

    fn change(sheet: &str, instead: Option<&str>, entries: &[Value]) -> Result<Change, Refusal> {
        let mut body = json!({ "sheet": { "id": sheet, "canvas": [2540, 1252] }, "entries": entries });
        if let Some(instead) = instead {
            body["instead"] = instead.into();
        }
        Change::parse(body.to_string().as_bytes())
    }

    fn stroke(id: &str, time: u64, by: &str, x: i32) -> Value {
        let shape = json!({ "strokes": { "points": [[x, 1], [2, 2]], "width_px": 5 } });
        json!({ "id": id, "time": time, "by": by, "order": 1, "shape": shape })
    }

    fn removed(id: &str, time: u64, by: &str) -> Value {
        json!({ "id": id, "time": time, "by": by, "order": 1, "shape": null })
    }

    fn room(entries: &[Value]) -> Room {
        let mut room = Room::default();
        room.make(change("kitchen", Some(""), entries).unwrap()).unwrap();
        room
    }

    /// All items that the room knows.
    fn items(room: &Room) -> Vec<(&str, &str)> {
        room.items.iter().map(|(id, kept)| (id.as_str(), kept.text.as_str())).collect()
    }

    fn heard(room: &Room, seq: u64) -> (Value, u64) {
        let (text, seq) = room.news(seq);
        (serde_json::from_str(&text).unwrap(), seq)
    }

    #[test]
    fn a_page_hears_what_has_changed_since_it_last_heard() {
        let mut room = room(&[stroke("a", 1, "anna", 1), stroke("b", 1, "anna", 1)]);
        let (all, seq) = heard(&room, 0);
        assert_eq!(all["drawn"]["sheet"], json!({ "id": "kitchen", "canvas": [2540, 1252] }));
        assert_eq!(all["drawn"]["entries"].as_array().unwrap().len(), 2);
        assert_eq!(all["drawn"]["entries"][0]["shape"]["strokes"]["points"], json!([[1.0, 1.0], [2.0, 2.0]]));
        for by in ["berta", "anna"] {
            room.make(change("kitchen", None, &[stroke("b", 2, by, 9)]).unwrap()).unwrap();
        }
        let (some, seq) = heard(&room, seq);
        let entries = some["drawn"]["entries"].as_array().unwrap();
        assert_eq!((entries.len(), &entries[0]["id"], &entries[0]["by"]), (1, &json!("b"), &json!("berta")));
        room.make(change("kitchen", None, &[removed("b", 3, "anna")]).unwrap()).unwrap();
        let (last, _) = heard(&room, seq);
        assert_eq!(last["drawn"]["entries"][0]["shape"], Value::Null);
    }

    /// A page that was cut off must not overwrite the drawing that the others have begun meanwhile.
    #[test]
    fn another_drawing_replaces_only_the_one_that_its_page_knows() {
        let mut room = room(&[stroke("a", 1, "anna", 1)]);
        for instead in [None, Some(""), Some("hall")] {
            let refusal = room.make(change("bath", instead, &[stroke("c", 1, "b", 1)]).unwrap()).unwrap_err();
            assert_eq!(refusal.status(), 409);
        }
        let (_, seq) = room.news(0);
        room.make(change("bath", Some("kitchen"), &[stroke("c", 1, "b", 1)]).unwrap()).unwrap();
        let (news, _) = heard(&room, seq);
        assert_eq!(
            (&news["drawn"]["sheet"]["id"], &news["drawn"]["entries"][0]["id"]),
            (&json!("bath"), &json!("c"))
        );
        assert_eq!(items(&room).len(), 1);
    }

    #[test]
    fn a_change_that_cannot_be_is_refused_in_words() {
        let shaped =
            |id: &str, shape: Value| json!({ "id": id, "time": 1, "by": "a", "order": 1, "shape": shape });
        let url = "data:image/svg+xml;base64,AAAA";
        for (entry, words) in [
            (json!({}), "missing field"),
            (shaped("a!", Value::Null), "an id"),
            (removed("a", 0, "a"), "a time"),
            (removed("a", 1 << 53, "a"), "a time"),
            (removed("a", 1, "<b>"), "a page's name"),
            (shaped("a", json!({ "strokes": { "points": [], "width_px": 5 } })), "1 point"),
            (shaped("a", json!({ "strokes": { "points": [[1e9, 1]], "width_px": 5 } })), "100000 px"),
            (shaped("a", json!({ "strokes": { "points": [[1, 1]], "width_px": 0 } })), "a width"),
            (
                shaped("a", json!({ "strokes": { "points": [[1, 1]], "width_px": 5, "pressure": [2] } })),
                "a pressure",
            ),
            (
                shaped("a", json!({ "strokes": { "points": [[1, 1]], "width_px": 5, "onclick": 1 } })),
                "onclick",
            ),
            (shaped("a", json!({ "obstacles": { "polygon": [[1, 1]], "label": "" } })), "3 points"),
            (shaped("a", json!({ "labels": { "text": " ", "at": [1, 1] } })), "a text"),
            (shaped("a", json!({ "labels": { "text": "x".repeat(401), "at": [1, 1] } })), "a text"),
            (shaped("a", json!({ "script": "x" })), "unknown variant"),
            (shaped("a", json!({ "route": [[1, 1], [2, 2]] })), "the id of its kind"),
            (shaped("route", json!({ "labels": { "text": "x", "at": [1, 1] } })), "the id of its kind"),
            (shaped("route", json!({ "route": [[1, 1]] })), "2 points"),
            (shaped("start", json!({ "start": { "at": [1, 1], "heading_deg": 1e9 } })), "360"),
            (shaped("photo", json!({ "photo": url })), "a PNG or JPEG"),
        ] {
            let refusal = change("kitchen", None, &[stroke("b", 1, "a", 1), entry.clone()]).unwrap_err();
            assert_eq!(refusal.status(), 400, "{entry}");
            assert!(refusal.to_string().contains(words), "{entry}: {refusal}");
        }
    }

    /// A single change with the largest time once left no later one to the others: nobody could change its item again, and nothing
    /// else that they changed was accepted.
    #[test]
    fn a_change_from_the_far_future_does_not_block_its_item() {
        let at = |time: u64, by: &str| change("kitchen", None, &[stroke("a", time, by, 1)]).unwrap();
        let mut room = room(&[stroke("a", 5, "anna", 1)]);
        let before = room.news(0);
        let last = LATEST_CLOCK_MS + MAX_AHEAD;
        for time in [MAX_TIME - 1, last + 1] {
            let refusal = room.make(at(time, "mallory")).unwrap_err();
            assert_eq!(refusal.status(), 400);
            let words = "entries[0]: expected a time before the year 2100; check this device's clock";
            assert_eq!(refusal.to_string(), words);
            assert_eq!(room.news(0), before);
        }
        // Those who have heard of a change in their future count on from there.
        for (time, by) in [(last, "mallory"), (last + 1, "berta"), (last + 100, "berta")] {
            room.make(at(time, by)).unwrap();
            assert_eq!(heard(&room, 0).0["drawn"]["entries"][0]["time"], time);
        }
        assert_eq!(room.make(at(MAX_TIME - 1, "mallory")).unwrap_err().status(), 400);
        // Another drawing is no way around the limit.
        let hall = |time| change("hall", Some("kitchen"), &[stroke("a", time, "mallory", 1)]).unwrap();
        assert_eq!(room.make(hall(MAX_TIME - 1)).unwrap_err().status(), 400);
        room.make(hall(1)).unwrap();
    }

    #[test]
    fn what_is_too_large_changes_nothing() {
        let mut room = room(&[stroke("a", 1, "anna", 1)]);
        let before = room.news(0);
        let goal = |i: usize| {
            let shape = json!({ "goals": { "at": [1, 1] } });
            json!({ "id": format!("g{i}"), "time": 1, "by": "a", "order": i, "shape": shape })
        };
        let goals: Vec<_> = (0..=MAX_TASKS).map(goal).collect();
        let gone: Vec<_> = (0..=MAX_ITEMS).map(|i| removed(&format!("r{i}"), 1, "a")).collect();
        let points = vec![[1, 1]; MAX_DRAWN_POINTS + 1];
        let shape = json!({ "strokes": { "points": points, "width_px": 5 } });
        let long = json!({ "id": "l", "time": 1, "by": "a", "order": 1, "shape": shape });
        for (entries, words) in [(goals, "64 goals"), (gone, "16384 items"), (vec![long], "262144 points")] {
            let change = |sheet, instead| change(sheet, instead, &entries).unwrap();
            for change in [change("kitchen", None), change("bath", Some("kitchen"))] {
                let refusal = room.make(change).unwrap_err();
                assert_eq!(refusal.status(), 413);
                assert!(refusal.to_string().contains(words), "{refusal}");
                assert_eq!(room.news(0), before);
            }
        }
        // Items that are removed leave their place to others.
        let goals: Vec<_> =
            (0..MAX_TASKS).map(goal).chain([removed("g0", 2, "a"), goal(MAX_TASKS)]).collect();
        room.make(change("kitchen", None, &goals).unwrap()).unwrap();
    }

    #[test]
    fn people_are_listed_while_they_are_connected_and_by_no_session() {
        let mut room = Room::default();
        room.enter(1, "secret");
        room.enter(2, "another");
        room.enter(2, "another");
        let presence =
            json!({ "name": "<b>Anna</b>", "sheet": "kitchen", "at": [1.5, 2], "draft": [[1, 2]] });
        room.show(2, serde_json::from_value(presence).unwrap());
        let people = |room: &Room| serde_json::from_str::<Value>(&room.people(1, Some("secret"))).unwrap();
        assert!(!room.people(1, None).contains("secret"));
        let found = people(&room);
        assert_eq!(found["people"]["me"], 1);
        let all = found["people"]["all"].as_array().unwrap();
        assert_eq!((&all[0]["drives"], &all[1]["drives"]), (&json!(true), &json!(false)));
        assert_eq!((&all[1]["name"], &all[1]["at"]), (&json!("<b>Anna</b>"), &json!([1.5, 2.0])));
        room.leave(2);
        assert_eq!(people(&room)["people"]["all"].as_array().unwrap().len(), 2);
        room.leave(2);
        assert_eq!(people(&room)["people"]["all"].as_array().unwrap().len(), 1);
    }

    /// Any version of one of a few items, by one of a few pages.
    fn any_entry() -> impl Strategy<Value = Value> {
        (0..4_u32, 1..6_u64, 0..3_usize, any::<bool>()).prop_map(|(id, time, by, is_gone)| {
            // A page makes one change at a time, so two versions with the same stamp are the same.
            let (id, by) = (format!("i{id}"), ["anna", "berta", "carl"][by]);
            if (is_gone && time == 3) || time == 5 {
                removed(&id, time, by)
            } else {
                stroke(&id, time * 2, by, 7)
            }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn changes_lead_to_the_same_drawing_in_any_order(
            entries in prop::collection::vec(any_entry(), 0..24),
            seed in prop::collection::vec(any::<u32>(), 48),
            cuts in prop::collection::vec(1..6_usize, 24),
        ) {
            let one = room(&entries);
            // In another order, in other requests, and each twice.
            let mut again: Vec<_> = seed.iter().zip(entries.iter().chain(&entries)).collect();
            again.sort_by_key(|(place, _)| **place);
            let mut rest: Vec<_> = again.into_iter().map(|(_, entry)| entry.clone()).collect();
            let mut other = room(&[]);
            for cut in cuts.into_iter().cycle() {
                if rest.is_empty() {
                    break;
                }
                let some: Vec<_> = rest.drain(..cut.min(rest.len())).collect();
                other.make(change("kitchen", None, &some).unwrap()).unwrap();
            }
            prop_assert_eq!(items(&one), items(&other));
            prop_assert_eq!(one.size, other.size);
            prop_assert_eq!(other.arrivals.len(), other.items.len());
        }

        #[test]
        fn nothing_that_comes_in_panics(text in ".{0,80}", bytes in prop::collection::vec(any::<u8>(), 0..200), cut in 0..400_usize) {
            let _ = Change::parse(&bytes);
            let _ = Change::parse(text.as_bytes());
            let whole = json!({ "sheet": { "id": "a", "canvas": [9, 9] }, "instead": "", "entries": [stroke("a", 1, &text, 1)] });
            let mut whole = whole.to_string().into_bytes();
            whole.truncate(cut);
            for (place, byte) in whole.iter_mut().skip(cut / 2).zip(&bytes).take(3) {
                *place = *byte;
            }
            if let Ok(change) = Change::parse(&whole) {
                let _ = Room::default().make(change);
            }
        }
    }
}
