//! What stands in a drawing and is not read as walls, and a person may miss.

use std::fmt;

/// Something that is not drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum LeftOut {
    /// Texts, and HTML inside of SVG: labels are no walls.
    Labels(usize),
    /// A picture that is not in the drawing, or of a type that is not read.
    Picture {
        /// The element that refers to it.
        element: String,
        /// What it refers to.
        found: String,
    },
    /// A reference to what the drawing does not have.
    Reference {
        /// The element that refers to it.
        element: String,
        /// The reference.
        found: String,
    },
    /// Ink on transparent paper that has the tone of the paper on which the rest is read.
    Tone {
        /// How much of the ink.
        share: f64,
    },
    /// A stroke whose paint draws nothing there.
    Paint(String),
    /// Shapes in a part of the drawing that is another document.
    Foreign(String),
    /// Path data, or points, from where on they cannot be read.
    Points {
        /// The element.
        element: String,
        /// What stands there.
        found: String,
    },
    /// Custom properties of an element that refers to another one: that one is drawn with those of its own place.
    Variables(String),
    /// Rules of a style sheet that hold on some screens only, or stand in another file.
    Rules(String),
}

impl LeftOut {
    /// Whether walls may be missing for it.
    pub fn is_doubtful(&self) -> bool {
        !matches!(self, Self::Labels(_))
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Labels(1) => write!(f, "one text: labels are no walls"),
            Self::Labels(count) => write!(f, "{count} texts: labels are no walls"),
            Self::Picture { element, found } => {
                write!(f, "the picture in {element}: expected an embedded PNG or JPEG, found {found}")
            }
            Self::Reference { element, found } => {
                write!(f, "{found} of {element}: nothing in the drawing has that id")
            }
            Self::Tone { share } => write!(
                f,
                "{:.0} % of the ink: it has the tone of the paper on which the rest is read; draw all walls in one tone",
                100.0 * share
            ),
            Self::Paint(element) => write!(
                f,
                "the stroke of {element}: its gradient or pattern paints nothing on a straight line; use a colour, or \
                 units of userSpaceOnUse"
            ),
            Self::Foreign(element) => {
                write!(f, "the shapes in {element}: it holds another document; move them out of it")
            }
            Self::Points { element, found } => {
                write!(f, "the shape of {element} from {found:?} on: expected commands with numbers")
            }
            Self::Variables(element) => {
                write!(f, "the custom properties of {element}: what it refers to is drawn without them")
            }
            Self::Rules(rules) => write!(f, "the rules of {rules}: whether they hold is not known"),
        }
    }
}
