//! Errors in drawing a floor.

use std::path::PathBuf;

use sketchnav_sim::SimError;

/// Why a floor cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum DeformError {
    /// The floor plan or the map is invalid.
    #[error(transparent)]
    World(#[from] SimError),
    /// The file is neither a floor plan nor a map.
    #[error("{}: expected a floor plan (.toml) or a map of map_server (.yaml)", path.display())]
    Kind {
        /// Path of the file.
        path: PathBuf,
    },
    /// The floor is too large.
    #[error("{name}: expected a floor of at most 40000 m², found {:.0} m x {:.0} m", found_m[0], found_m[1])]
    TooLarge {
        /// Name of the floor.
        name: String,
        /// Length and width of the floor, in metres.
        found_m: [f64; 2],
    },
    /// The floor has no enclosed room.
    #[error("{name}: found no enclosed room of at least {least_m2} m²")]
    NoRegions {
        /// Name of the floor.
        name: String,
        /// Minimum area of a room, in square metres.
        least_m2: f64,
    },
    /// The degree is out of range.
    #[error("degree: expected a number from 0 to {most}, found {found}")]
    Degree {
        /// Maximum degree.
        most: f64,
        /// Degree requested.
        found: f64,
    },
    /// The drawing cannot be painted.
    #[error("the picture: {0}")]
    Picture(String),
}
