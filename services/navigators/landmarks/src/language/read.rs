//! Reads routes in words, with one method for each rule of the grammar, from whole sentences down to single places.

use sketchnav_qualitative::hof::Surround;

use super::print::{COMMANDS, RESERVED};
use super::words::Words;
use crate::drawn::DrawnMetres;
use crate::error::Error;
use crate::route::{Command, DIRECTIONS, INCH_M, Kind, MOST_M, Place, Range, Relation, Route, State};

/// Tolerances of proximities and widths that are given as a single number (Chronis 2007, 4.3.2 and 4.3.3).
const PROXIMITY_TOLERANCE_M: f64 = 22.0 * INCH_M;
const WIDTH_TOLERANCE: f64 = 30.0;
/// Maximum width of a histogram.
const MOST_WIDTH: f64 = 180.0;

/// Reads a route in words.
///
/// # Errors
/// - [`Error::Word`], which gives the line and the word, if the words are not a route.
/// - [`Error::States`] if the route cannot be driven.
pub fn read(text: &str) -> Result<Route, Error> {
    let mut reader = Reader { words: Words::of(text)?, objects: Vec::new() };
    let mut states = Vec::new();
    while !reader.words.is_at_end() {
        let state = reader.sentence(&states)?;
        states.push(state);
    }
    let plain = |kind, command| State { kind, relations: Vec::new(), command, after: None };
    if states.first().is_none_or(|first| first.kind != Kind::Start) {
        states.insert(0, plain(Kind::Start, Command::Forward));
    }
    if states.last().is_none_or(|last| last.kind != Kind::End) {
        states.push(plain(Kind::End, Command::Stop));
    }
    let route = Route { objects: reader.objects, states };
    route.check()?;
    Ok(route)
}

struct Reader {
    words: Words,
    objects: Vec<String>,
}

impl Reader {
    /// [number "."] ["at the start" | "at the end"] ["after" length] ["when" conditions "then"] command
    fn sentence(&mut self, before: &[State]) -> Result<State, Error> {
        if self.words.peek_at(1) == "." && self.words.peek().parse::<u32>().is_ok() {
            self.words.next();
            self.words.next();
        }
        if before.last().is_some_and(|last| last.kind == Kind::End) {
            return Err(self.words.error("nothing after the sentence that stops", &[]));
        }
        let kind = self.kind(before.is_empty())?;
        let after = if self.words.take("after") { Some(DrawnMetres(self.length()?)) } else { None };
        self.words.take(",");
        let is_bare =
            matches!(kind, Some(Kind::Start | Kind::End)) || before.is_empty() || self.words.peek() == "stop";
        let relations = if self.words.take("when") {
            let relations = self.conditions()?;
            self.words.take(",");
            self.words.expect(&["then"])?;
            relations
        } else if is_bare {
            Vec::new()
        } else {
            return Err(self.words.error("\"when\"", &["when", "after", "at", "stop"]));
        };
        let command = self.command(kind)?;
        self.words.take(".");
        let is_same = before.last().map_or(Command::Forward, |last| last.command) == command;
        let kind = kind.unwrap_or(match command {
            Command::Stop => Kind::End,
            _ if before.is_empty() && relations.is_empty() => Kind::Start,
            _ if is_same && !before.is_empty() => Kind::Additional,
            _ => Kind::Change,
        });
        Ok(State { kind, relations, command, after })
    }

    /// Reads "at the start" or "at the end". If neither is there, the kind follows from the rest of the sentence.
    fn kind(&mut self, is_first: bool) -> Result<Option<Kind>, Error> {
        if !self.words.take("at") {
            return Ok(None);
        }
        self.words.expect(&["the"])?;
        let known: &[&str] = if is_first { &["start", "end"] } else { &["end"] };
        let word = self.words.expect(known)?;
        self.words.take(",");
        Ok(Some(if known[word] == "start" { Kind::Start } else { Kind::End }))
    }

    fn command(&mut self, kind: Option<Kind>) -> Result<Command, Error> {
        for (words, command) in COMMANDS {
            let may_be = match kind {
                Some(Kind::End) => command == Command::Stop,
                Some(Kind::Start) => command != Command::Stop,
                _ => true,
            };
            if may_be && self.words.take_all(words) {
                return Ok(command);
            }
        }
        if kind == Some(Kind::End) {
            return Err(self.words.error("\"stop\"", &["stop"]));
        }
        // If the first word is correct, the second one must be wrong, so the error reports that one.
        for (first, seconds) in
            [("turn", &["left", "right"][..]), ("move", &["forward"]), ("go", &["straight", "forward"])]
        {
            if self.words.take(first) {
                self.words.expect(seconds)?;
            }
        }
        Err(self.words.error(
            "\"move forward\" or \"turn left\" or \"turn right\" or \"stop\"",
            &["move", "turn", "go", "stop", "when"],
        ))
    }

    /// object "is" place {"or" ["is"] place} {"and" object "is" …}
    fn conditions(&mut self) -> Result<Vec<Relation>, Error> {
        let mut relations = Vec::new();
        loop {
            let object = self.subject()?;
            if relations.iter().any(|other: &Relation| other.object == object) {
                return Err(self.words.error("each object once, with \"or\" between its places", &["or"]));
            }
            self.words.expect(&["is"])?;
            loop {
                self.relations(object, &mut relations)?;
                if !self.joint("or") {
                    break;
                }
                self.same_subject(object)?;
            }
            if !self.joint("and") {
                return Ok(relations);
            }
        }
    }

    /// Takes a word that may be preceded by a comma.
    fn joint(&mut self, word: &str) -> bool {
        self.words.take_all(&[",", word]) || self.words.take(word)
    }

    /// Reads an object, which is either anonymous or has a name.
    fn subject(&mut self) -> Result<usize, Error> {
        let is_anonymous = ["a", "an"].iter().any(|article| self.words.take_all(&[article, "object", "is"]))
            || self.words.take_all(&["another", "is"])
            || self.words.take_all(&["another", "object", "is"]);
        if is_anonymous {
            self.words.back();
            self.objects.push(String::new());
            return Ok(self.objects.len() - 1);
        }
        let name = self.name()?;
        Ok(self.objects.iter().position(|known| *known == name).unwrap_or_else(|| {
            self.objects.push(name);
            self.objects.len() - 1
        }))
    }

    /// ["the" | "a" | "an"] (quoted | words up to "is")
    fn name(&mut self) -> Result<String, Error> {
        let _ = self.words.take("the") || self.words.take("an") || self.words.take("a");
        if self.words.peek() == "\"" {
            return Ok(self.words.next().map(|token| token.text).unwrap_or_default());
        }
        let mut name: Vec<String> = Vec::new();
        while self.words.peek() != "is" || name.is_empty() {
            let word = self.words.peek();
            let is_wrong =
                word.is_empty() || [",", ".", ":", ";", "\""].contains(&word) || RESERVED.contains(&word);
            if is_wrong {
                let expected = if name.is_empty() { "the name of an object" } else { "\"is\"" };
                return Err(self.words.error(expected, &["is"]));
            }
            name.push(word.to_owned());
            self.words.next();
        }
        Ok(name.join(" "))
    }

    /// After "or": ["is"], or the same object again and "is" (Chronis 2007, figure 4.10)
    fn same_subject(&mut self, object: usize) -> Result<(), Error> {
        if self.words.take("is") {
            return Ok(());
        }
        let name: Vec<_> = self.objects[object].split(' ').chain(["is"]).collect();
        self.words.take("the");
        self.words.take_all(&name);
        Ok(())
    }

    /// ["roughly"] place {[","] qualifier}, where "roughly" also allows either neighbour
    fn relations(&mut self, object: usize, relations: &mut Vec<Relation>) -> Result<(), Error> {
        let is_rough = self.words.take("roughly");
        let place = self.place()?;
        let (proximity_m, width) = self.qualifiers()?;
        let around: &[u8] = if is_rough { &[DIRECTIONS - 1, 0, 1] } else { &[0] };
        for turn in around {
            let place = match place {
                Place::Direction(direction) => Place::Direction((direction + turn) % DIRECTIONS),
                surround => surround,
            };
            relations.push(Relation { object, place, proximity_m, width, landmark: None });
        }
        Ok(())
    }

    fn place(&mut self) -> Result<Place, Error> {
        if self.words.take("around") {
            self.words.expect(&["the"])?;
            self.words.expect(&["robot"])?;
            let from = self.words.take("from");
            let but = !from && self.words.take_all(&["but", "for"]);
            return Ok(Place::Surrounds(match (from, but) {
                (true, _) => Surround::From(usize::from(self.direction()?)),
                (_, true) => Surround::OpeningAt(usize::from(self.direction()?)),
                _ => Surround::Completely,
            }));
        }
        Ok(Place::Direction(self.direction()?))
    }

    fn direction(&mut self) -> Result<u8, Error> {
        if self.words.take_all(&["in", "direction"]) {
            let number = self.words.peek().parse::<u8>().ok().filter(|number| *number < DIRECTIONS);
            let direction = number.ok_or_else(|| self.words.error("a direction from 0 to 15", &[]))?;
            self.words.next();
            return Ok(direction);
        }
        let _ = self.words.take_all(&["to", "the"])
            || self.words.take_all(&["on", "the"])
            || self.words.take("in");
        const BASES: [(&str, u8); 16] = [
            ("ahead", 0),
            ("front", 0),
            ("ahead-left", 2),
            ("front-left", 2),
            ("left-front", 2),
            ("left", 4),
            ("behind-left", 6),
            ("rear-left", 6),
            ("left-rear", 6),
            ("behind", 8),
            ("rear", 8),
            ("behind-right", 10),
            ("rear-right", 10),
            ("right", 12),
            ("ahead-right", 14),
            ("front-right", 14),
        ];
        let known: Vec<_> = BASES.iter().map(|(word, _)| *word).chain(["in", "around", "roughly"]).collect();
        let Some((_, base)) = BASES.iter().find(|(word, _)| self.words.peek() == *word) else {
            return Err(self
                .words
                .error("a direction, as \"ahead\", \"ahead-left\", \"left\" or \"in direction 4\"", &known));
        };
        self.words.next();
        self.words.take_all(&["of", "the", "robot"]);
        if !self.words.take("slightly") {
            return Ok(*base);
        }
        // The second word names a neighbour at a right angle.
        let sides: [(&str, u8); 4] = [("ahead", 0), ("left", 4), ("behind", 8), ("right", 12)];
        let sides = sides.map(|(word, to)| (word, (to + DIRECTIONS - base) % DIRECTIONS));
        let [one, other] =
            [4, 12].map(|turn| sides.iter().find(|(_, to)| *to == turn).map_or("", |(word, _)| *word));
        let side = self.words.expect(&[one, other])?;
        Ok((base + [1, DIRECTIONS - 1][side]) % DIRECTIONS)
    }

    /// Reads a distance and a width, in either order.
    fn qualifiers(&mut self) -> Result<(Option<Range>, Option<Range>), Error> {
        let (mut proximity, mut width) = (None, None);
        loop {
            let ahead = usize::from(self.words.peek() == ",");
            let word = self.words.peek_at(ahead);
            let is_distance =
                ["at", "about"].contains(&word) || word.starts_with(|c: char| c.is_ascii_digit());
            if word == "with" && width.is_none() {
                self.words.take(",");
                width = Some(self.width()?);
            } else if is_distance && proximity.is_none() {
                self.words.take(",");
                proximity = Some(self.distance()?);
            } else {
                return Ok((proximity, width));
            }
        }
    }

    /// "with" ["histogram"] "width" number ["to" number]
    fn width(&mut self) -> Result<Range, Error> {
        self.words.take("with");
        self.words.take("histogram");
        self.words.expect(&["width"])?;
        let low = self.words.number(MOST_WIDTH)?;
        if self.words.take("to") {
            return Ok(Range { low, high: self.at_least(low, MOST_WIDTH)? });
        }
        Ok(Range::around(low, WIDTH_TOLERANCE))
    }

    /// Reads a number that must be at least `low`.
    fn at_least(&mut self, low: f64, most: f64) -> Result<f64, Error> {
        let is_below = self.words.peek().parse::<f64>().is_ok_and(|high| high < low);
        if is_below {
            Err(self.words.error(&format!("a number of at least {low}"), &[]))
        } else {
            self.words.number(2.0 * most)
        }
    }

    fn distance(&mut self) -> Result<Range, Error> {
        let range = if self.words.take_all(&["at", "proximity"]) {
            // The values in figure 4.10 are in inches, although the figure does not say so.
            Range::around(self.words.number(MOST_M)? * self.optional_unit(INCH_M), PROXIMITY_TOLERANCE_M)
        } else if self.words.take("at") {
            let is_least = self.words.expect(&["most", "least", "proximity"])? == 1;
            let length = self.length()?;
            if is_least { Range { low: length, high: MOST_M } } else { Range { low: 0.0, high: length } }
        } else if self.words.take("about") {
            Range::around(self.length()?, PROXIMITY_TOLERANCE_M)
        } else {
            let low = self.words.number(MOST_M)?;
            if self.words.take("to") {
                let high = self.at_least(low, MOST_M)?;
                let unit = self.unit()?;
                Range { low: low * unit, high: high * unit }
            } else {
                Range::around(low * self.unit()?, PROXIMITY_TOLERANCE_M)
            }
        };
        self.words.take("away");
        Ok(range)
    }

    fn length(&mut self) -> Result<f64, Error> {
        Ok(self.words.number(MOST_M)? * self.unit()?)
    }

    fn optional_unit(&mut self, default: f64) -> f64 {
        self.unit().unwrap_or(default)
    }

    /// Reads a unit, and returns its length in metres.
    fn unit(&mut self) -> Result<f64, Error> {
        const UNITS: [(&str, f64); 12] = [
            ("m", 1.0),
            ("metre", 1.0),
            ("metres", 1.0),
            ("meter", 1.0),
            ("meters", 1.0),
            ("cm", 0.01),
            ("in", INCH_M),
            ("inch", INCH_M),
            ("inches", INCH_M),
            ("ft", 12.0 * INCH_M),
            ("foot", 12.0 * INCH_M),
            ("feet", 12.0 * INCH_M),
        ];
        let words = UNITS.map(|(word, _)| word);
        match words.iter().position(|word| self.words.peek() == *word) {
            Some(i) => {
                self.words.next();
                Ok(UNITS[i].1)
            }
            None => Err(self.words.error("a unit of length, as \"m\" or \"in\"", &words)),
        }
    }
}
