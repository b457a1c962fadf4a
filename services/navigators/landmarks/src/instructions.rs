//! What the sketcher tells the other stages: the sketch, the landmark states, or both.

use serde::{Deserialize, Serialize};

use crate::error::{Error, LandmarksError};
use crate::extraction::{self, extract};
use crate::language;
use crate::mission::{Given, LandmarksMission, Method};
use crate::route::Route;
use crate::sketch::Sketch;
use crate::{file, plane};

/// A route to drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Instructions {
    /// The sketch, where one was drawn.
    pub sketch: Option<Sketch>,
    /// The landmark states in words; empty where the sketch gives none and none are needed.
    pub words: String,
}

impl Instructions {
    /// Understands what a person gave.
    ///
    /// A belief is driven without states. So there a turn without an object in view is no error, and no state.
    ///
    /// # Errors
    /// [`Error`] with the place.
    pub fn of(
        mission: &LandmarksMission,
        bytes: &[u8],
        parameters: &extraction::Parameters,
    ) -> Result<Self, Error> {
        let Given::Drawing(_, reading) = &mission.given else {
            let text = std::str::from_utf8(bytes).map_err(|error| Error::Text { at: error.valid_up_to() })?;
            // What is printed is what is driven.
            return Ok(Self { sketch: None, words: language::print(&language::read(text)?) });
        };
        let sketch = Sketch::read(&file::read(bytes)?, reading)?;
        let words = match extract(&sketch, parameters) {
            Ok(route) => language::print(&route),
            Err(Error::NothingInView { .. } | Error::States { .. }) if mission.method == Method::Belief => {
                String::new()
            }
            Err(error) => return Err(error),
        };
        Ok(Self { sketch: Some(sketch), words })
    }

    /// From the slice behind a message.
    ///
    /// # Errors
    /// [`LandmarksError::Instructions`].
    pub fn read(cells: &[u8]) -> Result<Self, LandmarksError> {
        serde_json::from_slice(cells).map_err(|error| LandmarksError::Instructions(error.to_string()))
    }

    /// The slice behind a message.
    ///
    /// # Errors
    /// [`LandmarksError::Instructions`].
    pub fn write(&self) -> Result<Vec<u8>, LandmarksError> {
        serde_json::to_vec(self).map_err(|error| LandmarksError::Instructions(error.to_string()))
    }

    /// The landmark states; `None` where there are none.
    ///
    /// # Errors
    /// [`Error::Word`] and [`Error::States`]: never of words that [`Instructions::of`] made.
    pub fn route(&self) -> Result<Option<Route>, Error> {
        if self.words.is_empty() { Ok(None) } else { language::read(&self.words).map(Some) }
    }

    /// The length of the route as it was drawn, or as the states say; 0 where nobody said it.
    pub fn length_m(&self) -> f64 {
        if let Some(sketch) = &self.sketch {
            return plane::length(&sketch.route);
        }
        let route = self.route().ok().flatten();
        route.and_then(|route| route.along_m().last().copied().flatten()).unwrap_or(0.0)
    }
}
