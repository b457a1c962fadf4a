//! Content of a drawing that is not read as walls but that its author may expect to be.

use std::fmt;

/// Something that is left out of a drawing, or drawn differently from what the file specifies.
#[derive(Debug, Clone, PartialEq)]
pub enum LeftOut {
    /// Texts that do not name a place: HTML inside SVG, text along a path, remarks.
    Labels(usize),
    /// A picture that is not embedded in the drawing, or is of an unsupported type.
    Picture {
        /// The element that refers to it.
        element: String,
        /// The target of the reference.
        found: String,
    },
    /// A reference to something that does not exist in the drawing.
    Reference {
        /// The element that refers to it.
        element: String,
        /// The reference.
        found: String,
    },
    /// Ink on transparent paper that has the same tone as the paper on which the rest is read.
    Tone {
        /// Share of the ink.
        share: f64,
    },
    /// Strokes that are too faint compared with the walls.
    Faint {
        /// Share of all strokes.
        share: f64,
    },
    /// A stroke whose gradient or pattern paints nothing.
    Paint(String),
    /// An element of which a filter, a mask, a clip path or a gradient leaves nothing.
    Effect(String),
    /// A clip path or a mask that is not defined in the drawing and therefore hides nothing.
    Clip {
        /// The element.
        element: String,
        /// The property and its value.
        found: String,
    },
    /// A stroke that should have kept its width at every scale of the drawing.
    Width {
        /// The element.
        element: String,
        /// Drawn width, as a multiple of the width that it should have.
        times: f64,
    },
    /// Shapes in an embedded document.
    Foreign(String),
    /// Path data or points with a syntax error. Everything up to the error is kept.
    Points {
        /// The element.
        element: String,
        /// The beginning of the unreadable text.
        found: String,
    },
    /// Custom properties of an element that refers to another. They have no effect on the other element, which uses those of its
    /// own position in the file.
    Variables(String),
    /// Rules of a style sheet that apply only on some screens or are in another file.
    Rules(String),
}

impl LeftOut {
    /// Returns true if walls may be missing because this was left out.
    pub fn is_doubtful(&self) -> bool {
        !matches!(self, Self::Labels(_))
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Labels(1) => write!(f, "one text, which is neither a wall nor the name of a place"),
            Self::Labels(count) => write!(f, "{count} texts, which are neither walls nor names of places"),
            Self::Picture { element, found } => {
                write!(
                    f,
                    "the picture in {element}: expected an embedded PNG, JPEG, GIF, WebP, BMP or PNM, found {found}; embed it as PNG"
                )
            }
            Self::Reference { element, found } => {
                write!(f, "{found} of {element}: nothing in the drawing has that id")
            }
            Self::Tone { share } => write!(
                f,
                "{:.0} % of the ink: it has the tone of the paper on which the rest is read; draw all walls in one tone",
                100.0 * share
            ),
            Self::Faint { share } => write!(
                f,
                "{:.0} % of the strokes: they are fainter than the walls; draw all walls in one dark tone",
                100.0 * share
            ),
            Self::Paint(element) => write!(
                f,
                "the stroke of {element}: its gradient or pattern paints nothing on a straight line; use a colour, or \
                 units of userSpaceOnUse"
            ),
            Self::Effect(element) => write!(
                f,
                "{element}: its filter, mask, clip path or gradient leaves nothing of it; a straight line has no bounding box \
                 to fit them to: remove it, or use units of userSpaceOnUse"
            ),
            Self::Clip { element, found } => {
                write!(f, "{found} of {element}: it is not supported, and what it would hide is drawn")
            }
            Self::Width { element, times } => write!(
                f,
                "the vector-effect of {element}: its stroke is drawn {times:.1} times as wide; remove it, and state the width"
            ),
            Self::Foreign(element) => {
                write!(f, "the shapes in {element}: it contains another document; move them out of it")
            }
            Self::Points { element, found } => {
                write!(f, "the shape of {element} from {found:?} on: expected commands with numbers")
            }
            Self::Variables(element) => {
                write!(f, "the custom properties of {element}: what it refers to is drawn without them")
            }
            Self::Rules(rules) => write!(f, "the rules of {rules}: it is not known whether they apply"),
        }
    }
}
