//! Parses the file that matches positions in drawings with positions on floors.
//!
//! ```toml
//! [floor.court]                 # metres
//! crate = [2.0, 2.6]
//! table = [4.4, 2.2]
//! [drawing.court-01]            # image pixels: column, row
//! crate = [580, 752]
//! ```
//! If a drawing does not show a place, its table leaves the place out. Only the judge may read this file, and
//! navigators must not.

use std::collections::BTreeMap;

use serde::Deserialize;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::toml_text::{self, TomlError};

use super::homotopy::Anchor;

/// Positions by name.
type Places = BTreeMap<String, [f64; 2]>;

/// The anchors in a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Anchors {
    floor: BTreeMap<String, Places>,
    drawing: BTreeMap<String, Places>,
}

/// Why a file of anchors is rejected.
#[derive(Debug, thiserror::Error)]
pub enum AnchorsError {
    /// The text is not TOML, has an unknown key, or has a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// A required table is missing.
    #[error("anchors: expected a table [{0}]")]
    Table(String),
    /// The drawing names a place that does not exist on the floor.
    #[error("anchors: drawing.{drawing}.{name}: expected a place that floor.{floor} also has")]
    Place {
        /// Name of the drawing.
        drawing: String,
        /// Name of the floor.
        floor: String,
        /// Name of the place.
        name: String,
    },
    /// A coordinate is not a finite number.
    #[error("anchors: drawing.{drawing}.{name}: expected finite numbers")]
    Number {
        /// Name of the drawing.
        drawing: String,
        /// Name of the place.
        name: String,
    },
}

impl Anchors {
    /// Parses the text of an anchors file.
    ///
    /// # Errors
    /// [`AnchorsError::Toml`] if the text is malformed.
    pub fn parse(text: &str) -> Result<Self, AnchorsError> {
        Ok(toml_text::read(text)?)
    }

    /// Returns the names of the drawings in alphabetical order.
    pub fn drawings(&self) -> impl Iterator<Item = &str> {
        self.drawing.keys().map(String::as_str)
    }

    /// Returns true if a drawing shows a place.
    pub fn has(&self, drawing: &str, place: &str) -> bool {
        self.drawing.get(drawing).is_some_and(|places| places.contains_key(place))
    }

    /// Returns the anchors of a drawing on a floor, sorted by name. `from_image` converts image pixels to the frame of the drawing.
    ///
    /// # Errors
    /// [`AnchorsError`] if the floor or the drawing has no table, if a place in the drawing is not on the floor, or if a
    /// coordinate is not finite.
    pub fn of(
        &self,
        drawing: &str,
        floor: &str,
        from_image: impl Fn([f64; 2]) -> Point<Sketch>,
    ) -> Result<Vec<Anchor>, AnchorsError> {
        let drawn =
            self.drawing.get(drawing).ok_or_else(|| AnchorsError::Table(format!("drawing.{drawing}")))?;
        let built = self.floor.get(floor).ok_or_else(|| AnchorsError::Table(format!("floor.{floor}")))?;
        let join = |(name, &at): (&String, &[f64; 2])| {
            let [drawing, floor, name] = [drawing, floor, name].map(str::to_owned);
            let Some(&[x, y]) = built.get(&name) else {
                return Err(AnchorsError::Place { drawing, floor, name });
            };
            let finite = [x, y, at[0], at[1]].iter().all(|v| v.is_finite());
            let anchor = Anchor { world: Point::new(x, y), drawing: from_image(at) };
            if finite { Ok(anchor) } else { Err(AnchorsError::Number { drawing, name }) }
        };
        drawn.iter().map(join).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "[floor.hall]\ncrate = [2.0, 3.0]\ntable = [4.0, 1.0]\n[drawing.a]\ntable = [40, 90]\n[drawing.b]\nlamp = [1, 1]\n[drawing.c]\ncrate = [nan, 1]\n";

    fn from_image([column, row]: [f64; 2]) -> Point<Sketch> {
        Point::new(column, 100.0 - row)
    }

    #[test]
    fn drawn_objects_are_joined_to_those_on_the_floor() {
        let anchors = Anchors::parse(FILE).unwrap();
        assert_eq!(anchors.drawings().collect::<Vec<_>>(), ["a", "b", "c"]);
        let table = Anchor { world: Point::new(4.0, 1.0), drawing: Point::new(40.0, 10.0) };
        assert_eq!(anchors.of("a", "hall", from_image).unwrap(), [table]);
        assert!(anchors.has("a", "table") && !anchors.has("a", "crate") && !anchors.has("z", "table"));
    }

    #[test]
    fn objects_that_cannot_be_joined_are_named() {
        let anchors = Anchors::parse(FILE).unwrap();
        let refusal = |drawing, floor| anchors.of(drawing, floor, from_image).unwrap_err().to_string();
        assert_eq!(
            refusal("b", "hall"),
            "anchors: drawing.b.lamp: expected a place that floor.hall also has"
        );
        assert_eq!(refusal("c", "hall"), "anchors: drawing.c.crate: expected finite numbers");
        assert_eq!(refusal("z", "hall"), "anchors: expected a table [drawing.z]");
        assert_eq!(refusal("a", "yard"), "anchors: expected a table [floor.yard]");
        assert!(Anchors::parse("[room.hall]").is_err());
    }
}
