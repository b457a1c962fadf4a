//! Texts on a drawing. They are not walls, but name the places where they are written.
//!
//! A goal may be given by name. Names in the mission (`navigator.places`) take precedence over the goals marked in a strokes file,
//! these over texts, and texts over the goals of earlier drives in a learned map, so that a mission can always resolve what a drawing
//! leaves open.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::nearest::{composed, folded, nearest_name};

use super::drawn_map::DrawnMap;
use super::error::SketchError;
use super::reference::Reference;
use crate::mission::SketchMission;

/// Maximum number of labels of a drawing.
pub(crate) const MOST_LABELS: usize = 10_000;
/// Maximum number of characters of a label that is a name. Longer texts are remarks.
const MOST_CHARACTERS: usize = 60;
/// Maximum number of names in an error.
const MOST_LISTED: usize = 24;

/// A text on a drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Label {
    /// The text.
    pub text: String,
    /// Middle of the text, in image pixels.
    pub at: [f64; 2],
}

impl Label {
    /// Returns the label with single spaces between its words, or `None` if it is not a name.
    pub(crate) fn tidied(&self) -> Option<Self> {
        Some(Self { text: tidied(&self.text)?, at: self.at })
    }
}

/// Returns a text with composed letters and single spaces between its words, or `None` if it is empty, too long for a name or has
/// control characters.
pub(crate) fn tidied(text: &str) -> Option<String> {
    let words = composed(&text.split_whitespace().collect::<Vec<_>>().join(" "));
    let is_name = (1..=MOST_CHARACTERS).contains(&words.chars().count()) && !words.contains(char::is_control);
    is_name.then_some(words)
}

/// The named places of a mission.
#[derive(Debug)]
pub(crate) struct Names<'a> {
    file: &'a str,
    /// Names with their positions in image pixels, by decreasing precedence.
    by_precedence: [Vec<(&'a str, [f64; 2])>; 4],
    /// Names of tasks that may be meant instead of a place. Errors list them as well.
    of_tasks: Vec<&'a str>,
}

impl<'a> Names<'a> {
    /// Collects the names of a mission and of its drawing.
    pub fn of(mission: &'a SketchMission, drawing: &'a DrawnMap) -> Self {
        let declared = mission.places.iter().map(|(name, at)| (name.as_str(), *at)).collect();
        let goals = drawing.marks.goals.iter().filter(|goal| !goal.name.is_empty());
        let goals = goals.map(|goal| (goal.name.as_str(), goal.at)).collect();
        let [written, known] = [&drawing.labels, &drawing.known_goals]
            .map(|labels| labels.iter().map(|label| (label.text.as_str(), label.at)).collect());
        Self { file: &drawing.file, by_precedence: [declared, goals, written, known], of_tasks: Vec::new() }
    }

    /// Like [`Names::of`], for a person who can also name a task.
    pub fn with_tasks(mission: &'a SketchMission, drawing: &'a DrawnMap) -> Self {
        let of_tasks = mission.tasks.iter().map(|task| task.name.as_str()).collect();
        Self { of_tasks, ..Self::of(mission, drawing) }
    }

    /// Returns true if some place has this name.
    pub fn has(&self, name: &str) -> bool {
        let wanted = folded(name);
        self.by_precedence.iter().flatten().any(|(other, _)| folded(other) == wanted)
    }

    /// Returns the name of a room with its position: the only text that is written in it. `is_inside` tells which positions are in the
    /// room.
    pub fn of_room(&self, is_inside: impl Fn([f64; 2]) -> bool) -> Option<(&'a str, [f64; 2])> {
        let [_, _, written, _] = &self.by_precedence;
        let mut inside = written.iter().copied().filter(|(_, at)| is_inside(*at));
        let first = inside.next()?;
        inside.all(|(name, _)| folded(name) == folded(first.0)).then_some(first)
    }

    /// Returns the position of the place with this name, in image pixels. Case and spaces are ignored. If the place only serves to
    /// describe another one (`is_part`), no task can be meant.
    ///
    /// # Errors
    /// [`SketchError::UnknownName`], or [`SketchError::AmbiguousName`] if several places have the name. `what` is the task, for
    /// the error.
    pub fn find(&self, what: &str, name: &str, is_part: bool) -> Result<[f64; 2], SketchError> {
        let wanted = folded(name);
        let found = |names: &Vec<(&str, [f64; 2])>| -> Vec<_> {
            let named = names.iter().filter(|(other, _)| folded(other) == wanted).map(|(_, at)| *at);
            // A text is drawn twice at the same place to give it an outline.
            named.fold(Vec::new(), |mut places, at| {
                if !places.contains(&at) {
                    places.push(at);
                }
                places
            })
        };
        let found = self.by_precedence.iter().map(found).find(|places| !places.is_empty());
        match found.as_deref() {
            Some([at]) => Ok(*at),
            Some([first, second, ..]) => Err(SketchError::AmbiguousName {
                what: what.to_owned(),
                name: name.to_owned(),
                file: self.file.to_owned(),
                places: [*first, *second],
            }),
            _ => Err(SketchError::UnknownName {
                what: what.to_owned(),
                name: name.to_owned(),
                hint: self.hint(name, if is_part { &[] } else { &self.of_tasks }),
            }),
        }
    }

    /// Returns suggestions for an unknown name, from all places and from these tasks.
    fn hint(&self, name: &str, tasks: &[&str]) -> String {
        let places = self.by_precedence.iter().flatten().map(|(name, _)| *name);
        let mut names: Vec<_> = places.chain(tasks.iter().copied()).collect();
        names.sort_unstable();
        names.dedup();
        match (nearest_name(name, &names), names.len()) {
            (Some(i), _) if self.has(names[i]) => format!("did you mean {:?}?", names[i]),
            (Some(i), _) => format!("did you mean the task {:?}?", names[i]),
            _ if Reference::may_be_meant(name) => {
                let sides = "left of, right of, above, below or nearest to a place, or between two";
                format!(
                    "a room without a name is \"the room\" {sides}, as in \"the room left of the kitchen\""
                )
            }
            (None, 0) => format!(
                "{} has no names: write them on it as text, or add them to navigator.places",
                self.file
            ),
            (None, count) => {
                let more = if count > MOST_LISTED { ", …" } else { "" };
                names.truncate(MOST_LISTED);
                format!("there are {}{more}", names.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reading::{Intent, Options, Places, Settings, read};

    /// Two rooms of 400 x 600 px with a door between them, and labels in them.
    fn drawing(labels: serde_json::Value) -> DrawnMap {
        let page = json!({
            "canvas": [1000, 800],
            "strokes": [
                { "points": [[100, 100], [900, 100], [900, 700], [100, 700], [100, 100]] },
                { "points": [[500, 100], [500, 350]] }, { "points": [[500, 450], [500, 700]] },
                { "points": [[700, 500], [800, 500], [800, 600], [700, 600], [700, 500]] },
            ],
            "labels": labels,
        });
        read(page.to_string().as_bytes(), "rooms.json", &Options::default()).unwrap()
    }

    fn mission(goal: &str, more: &str) -> SketchMission {
        let text = format!(
            "name = 'm'\nrobot = 'robotino'\nworld = {{ map = 'm.yaml' }}\n\
             start = {{ world = [0, 0], world_heading_deg = 0 }}\n\
             [navigator]\nkind = 'sketch'\ndrawing = 'rooms.json'\nstart = [200, 400]\nstart_heading_deg = 0\n{more}\n\
             [[task]]\nname = 'coffee'\ngoal = '{goal}'\n"
        );
        SketchMission::of(&sketchnav_schemas::mission::Mission::parse(&text).unwrap()).unwrap()
    }

    fn placed(drawing: &DrawnMap, goal: &str, more: &str) -> Result<Places, SketchError> {
        Intent::of_mission(&mission(goal, more), drawing)?.place(drawing, &Settings::default())
    }

    /// Returns the goal in image pixels.
    fn goal(drawing: &DrawnMap, name: &str, more: &str) -> [f64; 2] {
        drawing.to_image(&placed(drawing, name, more).unwrap().tasks[0].end())
    }

    fn refusal(drawing: &DrawnMap, name: &str) -> String {
        placed(drawing, name, "").unwrap_err().to_string()
    }

    fn rooms() -> DrawnMap {
        drawing(json!([
            { "text": "Dining  room", "at": [300, 200] },
            { "text": "kitchen", "at": [700, 200] },
            { "text": "WC", "at": [150, 650] },
            { "text": "WC", "at": [850, 650] },
            { "text": "door", "at": [500.4, 340] },
            { "text": "table", "at": [750, 550] },
            { "text": "edge", "at": [704, 550] },
            { "text": "twice", "at": [300, 600] },
            { "text": "Twice", "at": [300, 600] },
        ]))
    }

    /// In a learned map, goals of earlier drives have names, unless something on the drawing has the same name.
    #[test]
    fn known_goals_have_names_of_the_lowest_precedence() {
        let known = |text: &str, at| Label { text: text.to_owned(), at };
        let known_goals = vec![known("Printer", [300.0, 600.0]), known("kitchen", [300.0, 300.0])];
        let drawing = DrawnMap { known_goals, ..rooms() };
        assert_eq!(goal(&drawing, "printer", ""), [300.0, 600.0]);
        assert_eq!(goal(&drawing, "kitchen", ""), [700.0, 200.0]);
        assert!(refusal(&rooms(), "printer").contains("expected the name of a place"));
    }

    #[test]
    fn a_goal_is_where_its_name_is_written() {
        let drawing = rooms();
        let without = super::tests::drawing(json!([]));
        assert!(drawing.cells == without.cells, "a name is no wall");
        assert_eq!(goal(&drawing, "kitchen", ""), [700.0, 200.0]);
        assert_eq!(goal(&drawing, " dining Room", ""), [300.0, 200.0]);
        // An umlaut may be one character or two, on the drawing and in the mission.
        let umlauts = ["Büro", "Bu\u{308}ro"];
        for written in umlauts {
            let drawing = super::tests::drawing(json!([{ "text": written, "at": [700, 200] }]));
            assert_eq!(drawing.labels[0].text, "Büro");
            for name in umlauts {
                assert_eq!(goal(&drawing, name, ""), [700.0, 200.0]);
                let places = format!("places = {{ '{written}' = [300, 200] }}");
                assert_eq!(goal(&drawing, name, &places), [300.0, 200.0]);
            }
        }
        let places = placed(&drawing, "kitchen", "").unwrap();
        assert_eq!(places.tasks[0].name, "coffee");
    }

    #[test]
    fn a_name_across_a_wall_means_the_free_place_beside_it() {
        let drawing = rooms();
        let [x, y] = goal(&drawing, "door", "");
        assert!((x - 500.0).abs() < 5.0 && (y - 340.0).abs() < 5.0, "({x}, {y})");
        assert_eq!(drawing.cell(&drawing.from_image([x, y])), Some(sketchnav_schemas::codes::FREE));
        assert_eq!(goal(&drawing, "twice", ""), [300.0, 600.0], "a text that is drawn twice is one place");
        let error = refusal(&drawing, "edge");
        assert!(error.contains("expected a free path"), "not moved to the other side: {error}");
        let error = refusal(&drawing, "table");
        assert!(
            error.starts_with("task 1 (coffee): goal at (750, 550) of rooms.json: expected a free path"),
            "{error}"
        );
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_right_one() {
        let drawing = rooms();
        assert_eq!(
            refusal(&drawing, "kichen"),
            "task 1 (coffee).goal: expected the name of a place, found \"kichen\"; did you mean \"kitchen\"?"
        );
        let error = refusal(&drawing, "library");
        assert!(
            error.ends_with("; there are Dining room, Twice, WC, door, edge, kitchen, table, twice"),
            "{error}"
        );
        let error = refusal(&super::tests::drawing(json!([])), "kitchen");
        assert!(
            error.ends_with(
                "rooms.json has no names: write them on it as text, or add them to navigator.places"
            ),
            "{error}"
        );
    }

    #[test]
    fn two_places_with_one_name_are_both_named_and_the_mission_can_say_which() {
        let drawing = rooms();
        assert_eq!(
            refusal(&drawing, "wc"),
            "task 1 (coffee).goal: expected the name of one place of rooms.json, found \"wc\" at (150, 650) and at (850, 650); \
             rename one, or say which in navigator.places"
        );
        assert_eq!(goal(&drawing, "wc", "places = { WC = [850, 640] }"), [850.0, 640.0]);
    }

    #[test]
    fn the_names_of_tasks_are_listed_for_a_person_who_names_a_goal() {
        let (drawing, mission) = (rooms(), mission("kitchen", ""));
        let known = Names::with_tasks(&mission, &drawing);
        let error = |name: &str| known.find("goal", name, false).unwrap_err().to_string();
        assert!(error("cofee").ends_with("; did you mean the task \"coffee\"?"), "{}", error("cofee"));
        let error = error("library");
        let names = "Dining room, Twice, WC, coffee, door, edge, kitchen, table, twice";
        assert_eq!(
            error,
            format!("goal: expected the name of a place, found \"library\"; there are {names}")
        );
    }

    #[test]
    fn labels_that_are_no_names_name_nothing() {
        let drawing =
            drawing(json!([{ "text": " ", "at": [300, 200] }, { "text": "x".repeat(61), "at": [300, 200] }]));
        assert_eq!(drawing.labels, []);
    }
}
