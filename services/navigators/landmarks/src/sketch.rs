//! Interprets the strokes of a sketch (Chronis 2007, 3.3; Bailey 2003).
//!
//! A stroke is an object, the route, a deletion or a stray mark, depending on its shape (see [`strokes`]).
//! The result is in metres, with the route resampled to equal steps, so the speed of the pen does not matter.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::message::Here;
use sketchnav_schemas::nearest::folded;

use crate::drawn::{Drawn, DrawnMetres};
use crate::error::{Error, Pixel};
use crate::plane;

pub mod strokes;

/// A stroke: a line drawn without lifting the pen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// Path of the pen, in pixels of the canvas, with x to the right and y up.
    pub points: Vec<Pixel>,
}

/// A word that names an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Label {
    /// Text of the label.
    pub text: String,
    /// Position of the label, in pixels of the canvas.
    pub at: Pixel,
}

/// A drawing as made by a person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawing {
    /// Width and height of the canvas, in pixels.
    pub canvas: [f64; 2],
    /// Strokes, in the order in which they were drawn.
    pub strokes: Vec<Stroke>,
    /// Labels.
    #[serde(default)]
    pub labels: Vec<Label>,
}

/// Parameters for reading drawings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Reading {
    /// Length that the longer side of the canvas represents, in metres. The PDA's 160 pixels of 5 inches each
    /// are 20.32 m.
    pub canvas_m: f64,
    /// Length of a step along the route, in metres. The default is the robot's diameter of 20 inches.
    pub step_m: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self { canvas_m: 160.0 * 5.0 * crate::route::INCH_M, step_m: 20.0 * crate::route::INCH_M }
    }
}

/// A landmark in a sketch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Label of the landmark, or "object" and its number in the order of drawing.
    pub name: String,
    /// Outline of the landmark.
    pub outline: Vec<Point<Drawn>>,
}

/// A drawing that has been read, in drawn metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sketch {
    /// Landmarks, in the order in which they were drawn.
    pub landmarks: Vec<Landmark>,
    /// Points of the route in equal steps, in the direction in which it was drawn.
    pub route: Vec<Point<Drawn>>,
    /// Size of a pixel, in drawn metres.
    pub metres_per_pixel: f64,
}

impl Sketch {
    /// Returns the point of the sketch at which a person says the robot is.
    pub fn place(&self, here: &Here) -> Point<Drawn> {
        drawn(&here.at, self.metres_per_pixel)
    }

    /// Returns the distance of a point to the nearest landmark, which is 0 inside one.
    pub fn clearance(&self, at: Point<Drawn>) -> DrawnMetres {
        let distances = self.landmarks.iter().map(|one| plane::distance_to_outline(at, &one.outline));
        DrawnMetres(distances.fold(f64::INFINITY, f64::min))
    }

    /// Converts a point to pixels of the canvas.
    pub fn pixel(&self, at: Point<Drawn>) -> Pixel {
        Pixel::new(at.x / self.metres_per_pixel, at.y / self.metres_per_pixel)
    }
}

/// Converts a point in pixels of the canvas to drawn metres.
fn drawn(at: &Pixel, metres_per_pixel: f64) -> Point<Drawn> {
    Point::new(at.x * metres_per_pixel, at.y * metres_per_pixel)
}

impl Drawing {
    /// Returns the drawing as it would come from a device with fewer pixels, with each point moved to the centre of its pixel. The
    /// device of Chronis 2007 has 160 × 160 pixels.
    pub fn raster(&self, pixels: u32) -> Self {
        let cell = self.canvas[0].max(self.canvas[1]) / f64::from(pixels);
        let middle = |x: f64| ((x / cell).floor() + 0.5) * cell;
        let moved = |at: &Pixel| Pixel::new(middle(at.x), middle(at.y));
        let stroke = |stroke: &Stroke| {
            let mut points: Vec<_> = stroke.points.iter().map(moved).collect();
            points.dedup();
            Stroke { points }
        };
        Self { strokes: self.strokes.iter().map(stroke).collect(), ..self.clone() }
    }

    fn check(&self) -> Result<(), Error> {
        let number = |what: String, expected, found: f64, is_valid: bool| {
            if is_valid { Ok(()) } else { Err(Error::Number { what, expected, found }) }
        };
        for (side, found) in ["width", "height"].into_iter().zip(self.canvas) {
            number(format!("canvas {side}"), "1 to 100000", found, (1.0..=1e5).contains(&found))?;
        }
        let strokes = self.strokes.iter().enumerate();
        let points = strokes.flat_map(|(i, stroke)| {
            let points = stroke.points.iter().enumerate();
            points.flat_map(move |(j, at)| {
                [at.x, at.y].map(|x| (format!("stroke {}, point {}", i + 1, j + 1), x))
            })
        });
        let labels = self
            .labels
            .iter()
            .flat_map(|label| [label.at.x, label.at.y].map(|x| (format!("label {:?}", label.text), x)));
        for (what, x) in points.chain(labels) {
            number(what, "a number within ±1000000", x, x.abs() <= 1e6)?;
        }
        Ok(())
    }
}

impl Sketch {
    /// Reads a drawing.
    ///
    /// # Errors
    /// - [`Error::Number`] if a number of the drawing or of `reading` is out of range.
    /// - [`Error::NoRoute`], [`Error::SeveralRoutes`] and [`Error::NoObjects`] as for [`strokes::classify`].
    /// - [`Error::OutlineCrossesItself`], [`Error::ObjectsCross`] and [`Error::RouteThroughObject`] if the
    ///   outlines or the route are not usable.
    pub fn read(drawing: &Drawing, reading: &Reading) -> Result<Self, Error> {
        drawing.check()?;
        for (what, found) in [("canvas_m", reading.canvas_m), ("step_m", reading.step_m)] {
            if !(found > 0.0 && found <= 1e4) {
                return Err(Error::Number { what: what.into(), expected: "above 0, at most 10000", found });
            }
        }
        let metres_per_pixel = reading.canvas_m / drawing.canvas[0].max(drawing.canvas[1]);
        let found = strokes::classify(drawing)?;
        let names = names(&found.outlines, &drawing.labels, drawing.canvas[0].max(drawing.canvas[1]));
        check_outlines(&found.outlines, &names)?;
        check_route(&found.route, &found.outlines, &names)?;
        let metres = |line: &[Pixel]| line.iter().map(|at| drawn(at, metres_per_pixel)).collect::<Vec<_>>();
        let landmarks = names.into_iter().zip(&found.outlines);
        let landmarks = landmarks.map(|(name, outline)| Landmark { name, outline: metres(outline) });
        Ok(Self {
            landmarks: landmarks.collect(),
            route: plane::resample(&metres(&found.route), reading.step_m),
            metres_per_pixel,
        })
    }
}

/// Returns the outlines of a drawing whose route may be missing.
///
/// # Errors
/// Same as [`Sketch::read`].
pub fn check_objects(drawing: &Drawing) -> Result<Vec<Vec<Pixel>>, Error> {
    drawing.check()?;
    let outlines = strokes::outlines(drawing);
    if outlines.is_empty() {
        return Err(Error::NoObjects);
    }
    check_outlines(&outlines, &names(&outlines, &drawing.labels, drawing.canvas[0].max(drawing.canvas[1])))?;
    Ok(outlines)
}

/// Assigns each label to the outline around it or, if there is none, to the nearest one within a tenth of the canvas.
fn names(outlines: &[Vec<Pixel>], labels: &[Label], canvas: f64) -> Vec<String> {
    let mut names: Vec<_> = (1..=outlines.len()).map(|i| format!("object {i}")).collect();
    for label in labels {
        let distances = outlines.iter().map(|outline| plane::distance_to_outline(label.at, outline));
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, distance)) = nearest
            && distance <= 0.1 * canvas
            && !label.text.trim().is_empty()
        {
            names[i] = folded(&label.text);
        }
    }
    unique(names)
}

/// Appends numbers to names that occur more than once.
fn unique(names: Vec<String>) -> Vec<String> {
    let number = |i: usize| names[..i].iter().filter(|name| **name == names[i]).count() + 1;
    let is_shared = |i: usize| names.iter().filter(|name| **name == names[i]).count() > 1;
    (0..names.len())
        .map(|i| if is_shared(i) { format!("{} {}", names[i], number(i)) } else { names[i].clone() })
        .collect()
}

fn check_outlines(outlines: &[Vec<Pixel>], names: &[String]) -> Result<(), Error> {
    for (i, outline) in outlines.iter().enumerate() {
        if let Some((_, _, at)) = plane::self_crossing(outline) {
            return Err(Error::OutlineCrossesItself { object: names[i].clone(), at });
        }
        for (j, other) in outlines[..i].iter().enumerate() {
            if let Some(at) = plane::outlines_meet(other, outline) {
                return Err(Error::ObjectsCross { first: names[j].clone(), second: names[i].clone(), at });
            }
        }
    }
    Ok(())
}

/// Checks that the route does not enter a landmark. It may begin or end inside one (from the chair to the desk), but
/// [`strokes::classify`] has already cut off those parts.
fn check_route(route: &[Pixel], outlines: &[Vec<Pixel>], names: &[String]) -> Result<(), Error> {
    for (from, to) in route.iter().zip(&route[1..]) {
        for (outline, name) in outlines.iter().zip(names) {
            if let Some(at) = plane::enters(*from, *to, outline) {
                return Err(Error::RouteThroughObject { object: name.clone(), at });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
