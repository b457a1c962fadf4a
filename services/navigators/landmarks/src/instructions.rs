//! The sketcher's instructions for the other stages: the sketch, the landmark states, or both.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::nearest::{folded, nearest};

use crate::drawn::DrawnMetres;
use crate::error::{Error, LandmarksError};
use crate::extraction::{self, extract};
use crate::language;
use crate::mission::{Given, LandmarksMission, Method};
use crate::route::Route;
use crate::sketch::Sketch;
use crate::{file, plane};

/// A route as the other stages receive it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Instructions {
    /// The sketch, or `None` if the route was given in words.
    pub sketch: Option<Sketch>,
    /// The landmark states in words. Empty if the sketch does not yield any states and the method does not need them.
    pub words: String,
    /// Width and height of the canvas, in pixels, or `None` if the route was given in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub canvas: Option<[f64; 2]>,
    /// The markers on landmarks, sorted by number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<Marked>,
}

/// A marker on a landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Marked {
    /// Number of the marker.
    pub marker: u32,
    /// Index of the landmark in the sketch or, if the route is in words, among the objects that the words mention.
    pub landmark: usize,
}

impl Instructions {
    /// Reads a drawing or a route in words, as provided by a person.
    ///
    /// The method `belief` does not depend on states. With this method, a turn without an object in view is
    /// therefore not an error, and the result has no states.
    ///
    /// # Errors
    /// [`Error`], which gives the place of the fault.
    pub fn of(
        mission: &LandmarksMission,
        bytes: &[u8],
        parameters: &extraction::Parameters,
    ) -> Result<Self, Error> {
        let Given::Drawing(_, reading) = &mission.given else {
            let text = std::str::from_utf8(bytes).map_err(|error| Error::Text { at: error.valid_up_to() })?;
            // Printing the parsed route ensures that the printed route is the one that is driven.
            let words = language::print(&language::read(text)?);
            let objects = language::read(&words)?.objects;
            let markers = marked(&mission.markers, &objects.iter().map(String::as_str).collect::<Vec<_>>())?;
            return Ok(Self { sketch: None, words, canvas: None, markers });
        };
        let drawing = file::read_with_route(bytes, mission.route.as_deref())?;
        let sketch = Sketch::read(&drawing, reading)?;
        let words = match extract(&sketch, parameters) {
            Ok(route) => language::print(&route),
            Err(Error::NothingInView { .. } | Error::States { .. }) if mission.method == Method::Belief => {
                String::new()
            }
            Err(error) => return Err(error),
        };
        let names: Vec<_> = sketch.landmarks.iter().map(|landmark| landmark.name.as_str()).collect();
        let markers = marked(&mission.markers, &names)?;
        Ok(Self { sketch: Some(sketch), words, canvas: Some(drawing.canvas), markers })
    }

    /// Reads instructions from the slice after a message.
    ///
    /// # Errors
    /// [`LandmarksError::Instructions`] if the slice is not valid JSON of this build.
    pub fn read(cells: &[u8]) -> Result<Self, LandmarksError> {
        serde_json::from_slice(cells).map_err(|error| LandmarksError::Instructions(error.to_string()))
    }

    /// Writes the slice that follows a message.
    ///
    /// # Errors
    /// [`LandmarksError::Instructions`] if it cannot be expressed in JSON.
    pub fn write(&self) -> Result<Vec<u8>, LandmarksError> {
        serde_json::to_vec(self).map_err(|error| LandmarksError::Instructions(error.to_string()))
    }

    /// Returns the landmark states, or `None` if there are none. Their relations refer to the landmarks that carry markers.
    ///
    /// # Errors
    /// [`Error::Word`] and [`Error::States`], neither of which occurs for words written by
    /// [`Instructions::of`].
    pub fn route(&self) -> Result<Option<Route>, Error> {
        if self.words.is_empty() {
            return Ok(None);
        }
        let mut route = language::read(&self.words)?;
        let landmarks: Vec<_> =
            (0..route.objects.len()).map(|object| self.landmark(&route, object)).collect();
        for relation in route.states.iter_mut().flat_map(|state| &mut state.relations) {
            relation.landmark = landmarks[relation.object];
        }
        Ok(Some(route))
    }

    /// Returns the index of the landmark that corresponds to an object of the route, or `None` if that object carries no markers.
    fn landmark(&self, route: &Route, object: usize) -> Option<usize> {
        let name = |landmark: usize| match &self.sketch {
            Some(sketch) => Some(language::spoken(&sketch.landmarks.get(landmark)?.name)),
            None => route.objects.get(landmark).cloned(),
        };
        let is_it = |landmark: &usize| name(*landmark).as_ref() == Some(&route.objects[object]);
        self.markers.iter().map(|marked| marked.landmark).find(is_it)
    }

    /// Returns the length of the route as drawn or as stated in words, or 0 if it is unknown.
    pub fn length(&self) -> DrawnMetres {
        if let Some(sketch) = &self.sketch {
            return DrawnMetres(plane::length(&sketch.route));
        }
        let route = self.route().ok().flatten();
        route.and_then(|route| route.along().last().copied().flatten()).unwrap_or_default()
    }
}

/// Returns the landmarks that a mission's markers are on, given the names of all landmarks.
fn marked(markers: &BTreeMap<String, Vec<u32>>, names: &[&str]) -> Result<Vec<Marked>, Error> {
    let mut all = Vec::new();
    for (label, numbers) in markers {
        let has_label = |(_, name): &(usize, &&str)| folded(name) == folded(label);
        let mut found = names.iter().enumerate().filter(has_label).map(|(i, _)| i);
        let (first, others) = (found.next(), found.count());
        let Some(landmark) = first.filter(|_| others == 0) else {
            let known = names.iter().copied();
            let nearest = first.is_none().then(|| nearest(label, known)).flatten().map(str::to_owned);
            let found = others + usize::from(first.is_some());
            return Err(Error::Label { label: label.clone(), found, nearest });
        };
        all.extend(numbers.iter().map(|&marker| Marked { marker, landmark }));
    }
    all.sort_unstable_by_key(|marked| marked.marker);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_one_object_each() {
        let names = ["desk", "tree", "tree", "büro"];
        let of = |label: &str| marked(&BTreeMap::from([(label.to_owned(), vec![8, 3])]), &names);
        let on_desk = |marker| Marked { marker, landmark: 0 };
        assert_eq!(of("desk").unwrap(), [on_desk(3), on_desk(8)]);
        assert_eq!(of("Bu\u{308}ro").unwrap().len(), 2, "with a combining mark");
        for (label, words) in [
            ("desc", "found 0; did you mean \"desk\"?"),
            (
                "cupboard",
                "navigator.markers.cupboard: expected one object with this label in the sketch or the words, found 0",
            ),
            ("tree", "found 2"),
        ] {
            let error = of(label).unwrap_err().to_string();
            assert!(error.ends_with(words), "{error}");
        }
    }
}
