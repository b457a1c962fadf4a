//! Parses an annotator's file, which matches places in a drawing with places in the environment.
//!
//! ```text
//! # 0match set
//! # map1
//! 228 302        places of the drawing, row and column
//! # map2
//! 166 308        places of the environment, row and column
//! ```

use std::path::Path;

use nalgebra::Complex;

use crate::error::EvalError;

/// A set of places that correspond to each other, as (column, row) in image pixels after parsing.
#[derive(Debug, Clone, PartialEq)]
pub struct Match {
    /// Number of the match in the file.
    pub number: usize,
    /// Places in the drawing, as column and row.
    pub sketch: Vec<[f64; 2]>,
    /// Places in the environment, as column and row, or in metres once the map of the environment is known.
    pub world: Vec<[f64; 2]>,
}

/// A malformed line.
#[derive(Debug, PartialEq)]
pub struct BadLine {
    line: usize,
    found: String,
}

impl BadLine {
    /// Returns the error for a line of the given file.
    pub fn in_file(self, path: &Path) -> EvalError {
        let expected = "a row and a column, in image pixels, within a match set";
        EvalError::Line { path: path.to_path_buf(), line: self.line, expected, found: self.found }
    }
}

/// Parses an annotator's file. Sets that lack places on one of the two sides are left out.
///
/// # Errors
/// [`BadLine`] if a line is malformed.
pub fn parse(text: &str) -> Result<Vec<Match>, BadLine> {
    let mut matches: Vec<Match> = Vec::new();
    let mut in_world = false;
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.ends_with("match set") {
            matches.push(Match { number: matches.len(), sketch: Vec::new(), world: Vec::new() });
        } else if line.starts_with('#') {
            in_world = line == "# map2";
        } else if !line.is_empty() {
            let bad = || BadLine { line: i + 1, found: line.to_owned() };
            let found = matches.last_mut().ok_or_else(bad)?;
            let side = if in_world { &mut found.world } else { &mut found.sketch };
            side.push(place(line).ok_or_else(bad)?);
        }
    }
    matches.retain(|found| !found.sketch.is_empty() && !found.world.is_empty());
    Ok(matches)
}

/// Parses a line that contains row and column, and returns column and row.
fn place(line: &str) -> Option<[f64; 2]> {
    let mut numbers = line.split_whitespace().map(str::parse::<f64>);
    let (row, column) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    (numbers.next().is_none() && row.is_finite() && column.is_finite()).then_some([column, row])
}

/// All matches of one annotator, with the places in the world in metres and y pointing up.
#[derive(Debug)]
pub struct Reading {
    /// The matches.
    pub matches: Vec<Match>,
    /// The map from the world (x + iy) to the drawing (column − i·row) is z ↦ turn·z + shift, fitted by least squares to the means
    /// of the matches.
    turn: Complex<f64>,
    shift: Complex<f64>,
}

impl Reading {
    /// Fits the map, which tells how the annotator held the drawing.
    pub fn new(matches: Vec<Match>) -> Self {
        let (worlds, sketches): (Vec<_>, Vec<_>) = matches
            .iter()
            .map(|m| (mean(m.world.iter().map(world)), mean(m.sketch.iter().map(sketch))))
            .unzip();
        let (middle_world, middle_sketch) = (mean(worlds.iter().copied()), mean(sketches.iter().copied()));
        let pairs = worlds.iter().zip(&sketches).map(|(w, s)| (w - middle_world, s - middle_sketch));
        let (over, under) = pairs.fold((Complex::default(), 0.0), |(over, under), (w, s)| {
            (over + s * w.conj(), under + w.norm_sqr())
        });
        let turn = if under > 0.0 { over / under } else { Complex::new(1.0, 0.0) };
        Self { matches, turn, shift: middle_sketch - turn * middle_world }
    }

    /// Returns the rotation of the drawing relative to the world, in degrees, rounded to quarter turns. People draw walls parallel
    /// to the edges of the paper, and one annotator held one drawing upside down.
    pub fn quarter_turns_deg(&self) -> f64 {
        (self.turn.arg().to_degrees() / 90.0).round() * 90.0
    }

    /// Returns the most likely pair of places in a match, which may contain several places on either side: the place in the drawing
    /// and the place in the world (among those accepted by `counts`) that agree best with all other matches. The units are those of
    /// [`Match::sketch`] and [`Match::world`].
    pub fn likeliest_pair(
        &self,
        index: usize,
        counts: impl Fn([f64; 2]) -> bool,
    ) -> Option<([f64; 2], [f64; 2])> {
        let found = &self.matches[index];
        let misfit = |s: &[f64; 2], w: &[f64; 2]| (self.turn * world(w) + self.shift - sketch(s)).norm();
        let worlds = || found.world.iter().filter(|at| counts(**at));
        let pairs = found.sketch.iter().flat_map(|s| worlds().map(move |w| (*s, *w)));
        pairs.min_by(|a, b| misfit(&a.0, &a.1).total_cmp(&misfit(&b.0, &b.1)))
    }
}

fn world(at: &[f64; 2]) -> Complex<f64> {
    Complex::new(at[0], at[1])
}

/// Converts a position to a complex number with y pointing up, since rows count downwards.
fn sketch(at: &[f64; 2]) -> Complex<f64> {
    Complex::new(at[0], -at[1])
}

fn mean(points: impl Iterator<Item = Complex<f64>>) -> Complex<f64> {
    let (sum, count) = points.fold((Complex::default(), 0.0), |(sum, count), p| (sum + p, count + 1.0));
    if count > 0.0 { sum / count } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "# a.png b.png\n# 0match set\n# map1\n228 302\n# map2\n166 308\n\n# 1match set\n# map1\n414 442\n# map2\n297 407\n339 393\n\n# 2match set\n# map1\n# map2\n";

    #[test]
    fn points_are_read_as_row_and_column() {
        let matches = parse(FILE).unwrap();
        assert_eq!(matches.len(), 2);
        assert_eq!((matches[0].sketch[0], matches[0].world[0]), ([302.0, 228.0], [308.0, 166.0]));
        assert_eq!(matches[1].world, [[407.0, 297.0], [393.0, 339.0]]);
    }

    #[test]
    fn an_invalid_line_is_reported() {
        for (text, line) in [("# 0match set\n# map1\n1\n", 3), ("1 2\n", 1), ("# 0match set\n1 2 3\n", 2)] {
            assert_eq!(parse(text).unwrap_err().line, line);
        }
    }

    /// Returns the reading of a drawing in which each place of the world is drawn at `turn` of its position. Since y points up in
    /// the world and rows count downwards in the drawing, `turn` has to flip y for a rotation of zero.
    fn reading(turn: impl Fn([f64; 2]) -> [f64; 2]) -> Reading {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        let matches = corners.iter().enumerate().map(|(number, &at)| Match {
            number,
            sketch: vec![turn(at), [1e3, 1e3]],
            world: vec![at],
        });
        let mut reading =
            Reading::new(matches.clone().map(|m| Match { sketch: vec![m.sketch[0]], ..m }).collect());
        reading.matches = matches.collect();
        reading
    }

    #[test]
    fn the_orientation_of_the_drawing_is_found() {
        let upright = reading(|[x, y]| [10.0 * x, 100.0 - 8.0 * y]);
        assert_eq!(upright.quarter_turns_deg(), 0.0);
        let upside_down = reading(|[x, y]| [100.0 - 10.0 * x, 8.0 * y]);
        assert_eq!(upside_down.quarter_turns_deg().abs(), 180.0);
        assert_eq!(upright.likeliest_pair(2, |_| true), Some(([40.0, 76.0], [4.0, 3.0])));
        assert_eq!(upright.likeliest_pair(2, |_| false), None);
    }
}
