//! What can be wrong with a floor that is to be drawn.

use std::path::PathBuf;

use sketchnav_sim::SimError;

/// Why there is no drawing.
#[derive(Debug, thiserror::Error)]
pub enum DeformError {
    /// The floor plan or the map is invalid.
    #[error(transparent)]
    World(#[from] SimError),
    /// A file that is not a map.
    #[error("{}: expected a floor plan (.toml) or a map of map_server (.yaml)", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
    },
    /// A floor that is too large.
    #[error("{name}: expected a floor of at most 40000 m², found {:.0} m x {:.0} m", found_m[0], found_m[1])]
    TooLarge {
        /// The floor's name.
        name: String,
        /// Its length and width.
        found_m: [f64; 2],
    },
    /// No room in it.
    #[error("{name}: found no enclosed room of at least {least_m2} m²")]
    NoRegions {
        /// The floor's name.
        name: String,
        /// Smallest area that counts.
        least_m2: f64,
    },
    /// An invalid degree.
    #[error("degree: expected a number from 0 to {most}, found {found}")]
    Degree {
        /// Largest degree.
        most: f64,
        /// What was asked for.
        found: f64,
    },
    /// The drawing cannot be painted.
    #[error("the picture: {0}")]
    Picture(String),
}
