//! The protocol between page and server.
//!
//! All coordinates are canvas pixels, column and row from the top left. Headings are counter-clockwise from
//! "to the right" as seen on the page, so the direction is (cos h, −sin h). The server converts from the
//! robot's frame (y up, other scale), and the page never does.
//!
//! # HTTP
//! Every `POST` has the header `x-sketchnav-session` (from the last `hello`). Every request below contains
//! the token of the link that the pad printed, either in the header `x-sketchnav-token` or as `token=…` in
//! the query. The response is 200 `{"ok":true,…}`, or `{"error":"words"}` with a status of
//! [`Refusal::status`]. `GET` of any other path returns a file of the page, or 404.
//!
//! | request | body | answer beside `ok` |
//! |---|---|---|
//! | `POST /api/sketch` | strokes in JSON, as the navigator reads them (members that only the page needs are under `pad`), or `content-type: image/png`, `image/jpeg`: a photo | `seq`; the sketch's `wall_direction_rad` (null without walls), `width_px`, `height_px`; `doubts`: why the drawing may not lead anywhere, in words |
//! | `POST /api/path` | `{"route":[[x,y],…]}` or `{"goals":[[x,y] or {"name","at"},…]}`, either with `"start":{"at","heading_deg"}` | the same |
//! | `POST /api/order` | `{"order":"execute"}`, `abort`, `restore`, `again`; `accept`, `reject` what was learned | that of a sketch, for the last two |
//! | `POST /api/here` | `{"at":[x,y]}`, optionally with `"heading_deg":90`: where the robot is, while it asks | |
//! | `POST /api/wheel` | empty or `"take"`: takes the wheel if no page has it, or its holder cannot be heard; `{"ask":"Anna"}`: asks the driver for it, under a name that may be empty; `"withdraw"`: no longer asks; from the driver, `{"give":2}`: hands it to page 2, which asks, or `{"decline":2}` | |
//! | `POST /api/draw` | changes of the drawing in which several pages draw: `{"sheet":{"id","canvas"},"entries":[{"id","time","by","order","shape"},…]}` ([`together`](crate::together)), with `"instead"`, the id of the shared drawing or "", if this one replaces it | |
//! | `POST /api/limit` | `{"link_limit_s":3}` | |
//! | `POST /api/mission` | `{"name":"…"}`: writes a mission file and the drawing into the pad's folder, unless a file that the pad has not written is in the way (409) | `files`: `name` and `text` (null for a photo) of the mission and of the drawing |
//! | `POST /api/study` | of a study: `{"begin":{"code":"p-07","age":27}}` (the age is optional), `{"measures":{…}}` before the drive, `{"answers":{…}}` after it ([`Told`](crate::study::sitting::Told)) | |
//! | `GET /api/seat` | `?session=…`: whether a page would be admitted now (503: not) | |
//! | `GET /api/walls.png` | | a picture: the walls as the robot understands them, gray with alpha, as large as the sketch; 404 before there are any |
//! | `GET /api/learned.png` | | a picture: what the robot has seen, as it lies in the drawing, gray with alpha, as large as the sketch; 404 if nothing was learned |
//! | `GET /api/corrected.svg` | | a picture: the drawing, corrected by what the robot has seen; 404 if nothing was learned |
//! | `GET /api/drawing` | | a picture: the photo that is the drawing; 404 if it is not a photo |
//! | `GET /api/place.svg` | | a picture: the floor that participants of a study see before they draw; 404 if there is none |
//!
//! Sketches, paths, places, limits, missions and anything that concerns a study are only accepted from the
//! session that drives. Those of other sessions are not even read. Changes of the shared drawing are accepted from any session, all
//! of a request or none. The order `abort` may be given by any
//! session, at any rate, and takes precedence over everything else. The response comes once the order has
//! been passed on to the planner, or refused (409) if nothing is in progress. A connection carries one
//! request. Its head must arrive within 10 s and its body within 10 s (that of a drawing, of changes or of a
//! path within 60 s), or it is refused (408). The requests of a session are limited in number at a time and in rate (429).
//! Connections that do not send anything are limited as well (503), see `doors`.
//!
//! A sketch or a path may have a header `x-sketchnav-sending` with a name that the page has chosen for it. If
//! a page gets no response, because the link breaks or the server dies, it sends the drawing again under the
//! same name. The drawing is processed only once. If it is still being read, the page waits for the response,
//! and if there already was a response, it is repeated.
//!
//! The first path of a sketch places the robot at its first point, facing along it, or at its `start`. Goals
//! require a `start` unless the robot finds out where it is (`placing` of the hello). A later path leaves the
//! robot where it is, unless it has a `start`.
//!
//! # WebSocket
//! `GET /ws?token=…&session=…`, where `session` is that of the last `hello`, so that a page that reconnects
//! keeps the wheel. All messages are text, with one JSON object each. Those of the page are limited to 1024
//! bytes.
//!
//! - `{"hello":{…}}` is a [`Hello`]. It is sent again whenever anything in it changes, except for the trail,
//!   which grows in the feed.
//! - `{"feed":{"n":…,…}}` is what the page displays ([`Feed`](crate::feed::Feed)), with additional members for this page:
//!   `drives`, `wheel` (whether it can be taken), `allowed` (the steps that it may take), `pleas` (for the driver: the pages that
//!   ask for the wheel, each with `page` and `name`) and `asks` (whether this page is one of them). The page responds with
//!   `{"seen":n}` when it has drawn it. At most two feeds are in transit unseen (a page that does not respond gets one a second), so a slow page
//!   always gets the latest picture instead of a queue.
//! - `{"drawn":{"sheet":…,"entries":[…]}}` is the shared drawing, and later what has changed in it: the latest versions only, so a slow
//!   page does not queue them. `sheet` is null before a drawing is shared, and another one if a page has replaced it.
//! - `{"people":{"me":2,"all":[{"page","name","sheet","at","draft","drives"},…]}}` lists the pages that are open, with their names (may be
//!   empty), the id of the drawing on their sheet, and where they draw: the pointer and the line that is being drawn. A page sends its
//!   own with `{"presence":{"name","sheet","at","draft"}}` ([`Presence`]). Neither is sent in a study, or if people do not draw.
//! - `{"ping":t}` is answered by `{"pong":t}`, with any number.
//! - `{"abort":true}` is the same as the order. The feed shows its result.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::MAX_ROUTE_POINTS;
use sketchnav_schemas::message::{MAX_DRAWING_BYTES, MAX_DRAWN_POINTS, MAX_TASKS};
use sketchnav_stage::drawn::{GoalMark, Marks, Placing, StartMark};

use crate::study::sitting::View;

/// Maximum number of strokes of a drawing.
pub const MAX_STROKES: usize = 4096;
/// Maximum length of a path request, in bytes.
pub const MAX_PATH_BYTES: usize = 1 << 20;
/// Maximum length of a request to a study, in bytes.
pub const MAX_STUDY_BYTES: usize = 16 << 10;
/// Maximum length of any other request, in bytes.
pub const MAX_SMALL_BYTES: usize = 4096;
/// Maximum number of characters of a person's name.
pub const MAX_NAME: usize = 24;
/// Maximum number of points of the line that a page shows while it is being drawn.
const MAX_DRAFT_POINTS: usize = 40;
/// Minimum and maximum time for which the link to the driver may be lost before the mission pauses, in
/// seconds.
pub const LINK_LIMIT_S: [f64; 2] = [1.0, 60.0];
/// The default of that limit, in seconds.
pub const DEFAULT_LINK_LIMIT_S: f64 = 3.0;

/// The reason why a request is refused, in words for the page.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It does not follow the protocol.
    #[error("{0}")]
    Malformed(String),
    /// The token is missing or wrong.
    #[error("expected the token of the link that the pad printed, found {0}")]
    Token(&'static str),
    /// The request comes from another page, is addressed to another host name, or has no session.
    #[error("{0}")]
    Forbidden(String),
    /// It is not allowed in this state.
    #[error("{0}")]
    NotNow(String),
    /// It takes too long to arrive.
    #[error("{0}")]
    Slow(String),
    /// It is larger than allowed.
    #[error("expected at most {limit}, found {found}")]
    TooLarge {
        /// What is allowed.
        limit: String,
        /// The actual size.
        found: String,
    },
    /// The drawing is unusable, in the sketcher's words.
    #[error("{0}")]
    Drawing(String),
    /// Requests come too often.
    #[error("too many requests: wait a moment and send it again")]
    TooOften,
    /// Too many requests at the same time.
    #[error("expected at most {0} requests of a page at the same time, found one more")]
    AtOnce(usize),
    /// The navigation does not answer.
    #[error("{0}")]
    Absent(String),
    /// There is a file of that name that the pad has not written.
    #[error(
        "{}: expected no file, or one that this pad has saved; found another, which stays as it is: \
         choose another name",
        .0.display()
    )]
    Taken(PathBuf),
    /// A file cannot be written.
    #[error("{0}")]
    File(String),
}

impl Refusal {
    /// The HTTP status.
    pub fn status(&self) -> u16 {
        match self {
            Self::Malformed(_) => 400,
            Self::Token(_) => 401,
            Self::Forbidden(_) => 403,
            Self::Slow(_) => 408,
            Self::NotNow(_) | Self::Taken(_) => 409,
            Self::TooLarge { .. } => 413,
            Self::Drawing(_) => 422,
            Self::TooOften | Self::AtOnce(_) => 429,
            Self::File(_) => 500,
            Self::Absent(_) => 503,
        }
    }

    /// A request that is not JSON of the expected form.
    pub fn malformed(what: &str, error: impl std::fmt::Display) -> Self {
        Self::Malformed(format!("{what}: {error}"))
    }

    /// A request that only the driver may make.
    pub fn watches() -> Self {
        Self::Forbidden("another page drives; ask for the wheel first".into())
    }

    /// The bridge has ended.
    pub fn ending() -> Self {
        Self::Absent("the pad is ending".into())
    }

    /// A request that is larger than allowed.
    pub fn too_large(limit: usize, unit: &str, found: impl std::fmt::Display) -> Self {
        Self::TooLarge { limit: format!("{limit} {unit}"), found: found.to_string() }
    }
}

/// The type of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SketchType {
    /// Strokes in JSON.
    Strokes,
    /// A PNG image.
    Png,
    /// A JPEG image.
    Jpeg,
}

impl SketchType {
    /// Returns the type according to the `content-type` of a request.
    pub fn of(content_type: Option<&str>) -> Result<Self, Refusal> {
        match content_type.and_then(|text| text.split(';').next()).map(str::trim) {
            Some("application/json") => Ok(Self::Strokes),
            Some("image/png") => Ok(Self::Png),
            Some("image/jpeg") => Ok(Self::Jpeg),
            found => {
                let found = found.unwrap_or("none");
                let expected = "application/json, image/png or image/jpeg";
                Err(Refusal::Malformed(format!("content-type: expected {expected}, found {found:?}")))
            }
        }
    }

    /// The type as a `content-type`.
    pub fn content_type(self) -> &'static str {
        match self {
            Self::Strokes => "application/json",
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }

    /// Returns the type as a file extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Strokes => "json",
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// A drawing that may be passed on. Its counts are within their limits, but only the sketcher can tell
/// whether it is usable.
#[derive(Debug, Clone, PartialEq)]
pub struct SketchRequest {
    /// Its type.
    pub kind: SketchType,
    /// The content as it was sent.
    pub bytes: Vec<u8>,
    /// The canvas, if the drawing specifies one. For a picture, this is its own size.
    pub canvas: Option<[u32; 2]>,
}

/// The part of a strokes file that is counted.
#[derive(Deserialize)]
struct Counted {
    canvas: [u32; 2],
    strokes: Vec<CountedStroke>,
    #[serde(default)]
    obstacles: Vec<CountedObstacle>,
}

#[derive(Deserialize)]
struct CountedStroke {
    points: Vec<[f64; 2]>,
}

#[derive(Deserialize)]
struct CountedObstacle {
    polygon: Vec<[f64; 2]>,
}

impl SketchRequest {
    /// Checks the limits.
    ///
    /// # Errors
    /// [`Refusal::TooLarge`], which gives the kind and the number, or [`Refusal::Malformed`].
    pub fn parse(kind: SketchType, bytes: Vec<u8>) -> Result<Self, Refusal> {
        if bytes.len() > MAX_DRAWING_BYTES {
            return Err(Refusal::too_large(MAX_DRAWING_BYTES, "bytes of a drawing", bytes.len()));
        }
        let canvas = match kind {
            SketchType::Strokes => Some(counted(&bytes)?),
            SketchType::Png | SketchType::Jpeg => None,
        };
        Ok(Self { kind, bytes, canvas })
    }
}

fn counted(bytes: &[u8]) -> Result<[u32; 2], Refusal> {
    let page: Counted =
        serde_json::from_slice(bytes).map_err(|error| Refusal::malformed("the drawing", error))?;
    let strokes = page.strokes.len() + page.obstacles.len();
    if strokes > MAX_STROKES {
        return Err(Refusal::too_large(MAX_STROKES, "strokes and obstacles", strokes));
    }
    let points: usize = page.strokes.iter().map(|stroke| stroke.points.len()).sum();
    let points = points + page.obstacles.iter().map(|obstacle| obstacle.polygon.len()).sum::<usize>();
    if points > MAX_DRAWN_POINTS {
        return Err(Refusal::too_large(MAX_DRAWN_POINTS, "points in all strokes and obstacles", points));
    }
    Ok(page.canvas)
}

/// A path or goals that may be passed on.
#[derive(Debug, Clone, PartialEq)]
pub struct PathRequest {
    /// The body as it was sent, for other pages.
    pub body: String,
    /// The marks in the form that the sketcher reads.
    pub marks: Marks,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathBody {
    route: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    goals: Vec<Goal>,
    start: Option<StartMark>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Goal {
    At([f64; 2]),
    Named(GoalMark),
}

impl PathRequest {
    /// Checks the limits.
    ///
    /// # Errors
    /// [`Refusal::TooLarge`], which gives the kind and the number, or [`Refusal::Malformed`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        let malformed = |error: &dyn std::fmt::Display| Refusal::malformed("the path", error);
        let body = std::str::from_utf8(bytes).map_err(|error| malformed(&error))?;
        let path: PathBody = serde_json::from_str(body).map_err(|error| malformed(&error))?;
        let (points, goals) = (path.route.as_ref().map_or(0, Vec::len), path.goals.len());
        match (path.route.is_some(), goals) {
            (false, 0) | (true, 1..) => return Err(malformed(&"expected one of route and goals")),
            (true, 0) if points < 2 => return Err(malformed(&"route: expected 2 points or more")),
            _ => {}
        }
        if points > MAX_ROUTE_POINTS {
            return Err(Refusal::too_large(MAX_ROUTE_POINTS, "points of a route", points));
        }
        if goals > MAX_TASKS {
            return Err(Refusal::too_large(MAX_TASKS, "goals", goals));
        }
        let mark = |goal| match goal {
            Goal::At(at) => GoalMark { name: String::new(), at },
            Goal::Named(mark) => mark,
        };
        let goals: Vec<_> = path.goals.into_iter().map(mark).collect();
        if goals.iter().any(|goal| goal.name.chars().any(char::is_control)) {
            return Err(malformed(&"goals: expected names without control characters"));
        }
        Ok(Self { body: body.to_owned(), marks: Marks { start: path.start, goals, route: path.route } })
    }
}

/// A step that a person takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// Send a sketch.
    Sketch,
    /// Send a path.
    Path,
    /// Drive.
    Execute,
    /// Stop.
    Abort,
    /// Continue.
    Restore,
    /// Start again with the first task.
    Again,
    /// Set the robot's position, with a [`HereBody`].
    Here,
    /// Use the learned map for the next drive.
    Accept,
    /// Discard the learned map.
    Reject,
}

/// `{"order":…}`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderBody {
    /// `execute`, `abort`, `restore`, `again`, `accept` or `reject`.
    pub order: Step,
}

/// `{"at":[x,y],"heading_deg":90}`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HereBody {
    /// The robot's pose in the drawing.
    pub at: [f64; 2],
    /// Its heading, if known.
    pub heading_deg: Option<f64>,
}

/// What a page wants with the wheel: `"take"`, `{"ask":"Anna"}`, `"withdraw"`, `{"give":2}` or `{"decline":2}`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WheelWish {
    /// Take it, if it is free.
    Take,
    /// Ask the driver for it, under this name.
    Ask(String),
    /// No longer ask for it.
    Withdraw,
    /// Hand it to the page with this number.
    Give(u32),
    /// Decline the request of the page with this number.
    Decline(u32),
}

impl WheelWish {
    /// Parses a request. An empty one takes the wheel.
    ///
    /// # Errors
    /// [`Refusal::Malformed`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        if bytes.is_empty() { Ok(Self::Take) } else { parse("the wheel", bytes) }
    }
}

/// `{"link_limit_s":…}`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitBody {
    /// Within [`LINK_LIMIT_S`].
    pub link_limit_s: f64,
}

/// `{"name":…}`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissionBody {
    /// A human-readable name. The file name is derived from it.
    pub name: String,
}

/// Reads a small request.
///
/// # Errors
/// [`Refusal::Malformed`], which gives the position.
pub fn parse<'a, T: Deserialize<'a>>(what: &str, bytes: &'a [u8]) -> Result<T, Refusal> {
    serde_json::from_slice(bytes).map_err(|error| Refusal::malformed(what, error))
}

/// Where a person draws, for the others.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Presence {
    /// The person's name; may be empty.
    pub name: String,
    /// The drawing on the page's sheet.
    pub sheet: Option<String>,
    /// The pointer on the sheet, if it is there.
    pub at: Option<[f64; 2]>,
    /// The line that is being drawn.
    pub draft: Vec<[f64; 2]>,
}

impl Presence {
    fn is_valid(&self) -> bool {
        let is_name = |text: &str| text.chars().count() <= MAX_NAME && !text.contains(char::is_control);
        is_name(&self.name)
            && self.draft.len() <= MAX_DRAFT_POINTS
            && self.sheet.as_ref().is_none_or(|id| id.bytes().all(|byte| byte.is_ascii_alphanumeric()))
    }
}

/// A message from a page on the WebSocket.
#[derive(Debug, Clone, PartialEq)]
pub enum Said {
    /// Requests a response with the same number.
    Ping(f64),
    /// Confirms that the page has drawn the feed with this number.
    Seen(u64),
    /// Shows the others where this page draws.
    Presence(Presence),
    /// Stop the robot.
    Abort,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SaidBody {
    ping: Option<f64>,
    seen: Option<u64>,
    presence: Option<Presence>,
    abort: Option<bool>,
}

impl Said {
    /// Parses a message. Returns `None` if it does not belong to the protocol.
    pub fn parse(text: &str) -> Option<Self> {
        match serde_json::from_str(text).ok()? {
            SaidBody { abort: Some(true), .. } => Some(Self::Abort),
            SaidBody { seen: Some(n), .. } => Some(Self::Seen(n)),
            SaidBody { ping: Some(t), .. } => Some(Self::Ping(t)),
            SaidBody { presence: Some(presence), .. } => {
                presence.is_valid().then_some(Self::Presence(presence))
            }
            SaidBody { .. } => None,
        }
    }
}

/// Identifies the page and describes what already exists.
#[derive(Debug, Clone, Serialize)]
pub struct Hello {
    /// The page's session.
    pub session: String,
    /// Whether it drives.
    pub drives: bool,
    /// `draws`, or `watches` if the drawing and the tasks come from a mission file.
    pub mode: &'static str,
    /// Width and height of the canvas.
    pub canvas: [u32; 2],
    /// The mission's name.
    pub mission: String,
    /// The robot's radius, metres.
    pub robot_radius_m: f64,
    /// The limits.
    pub limits: Limits,
    /// What has to be marked besides goals, or null if the navigator does not drive by drawings.
    pub placing: Option<Placing>,
    /// The current drawing as JSON, as it was sent. For a photo, this is
    /// `{"canvas":…,"image":"/api/drawing"}`.
    #[serde(skip)]
    pub drawing: Option<String>,
    /// The current path as JSON, as it was sent.
    #[serde(skip)]
    pub path: Option<String>,
    /// Number of the walls at `/api/walls.png`, or 0 if there are none yet.
    pub walls: u64,
    /// What was learned, or null if nothing was.
    pub learned: Option<LearnedView>,
    /// The robot's positions since it was placed.
    pub trail: Vec<[f64; 2]>,
    /// The study, if the page is for its participants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub study: Option<View>,
}

impl Hello {
    /// Returns the whole message, `{"hello":{…}}`.
    pub fn text(&self) -> String {
        let facts = serde_json::to_string(self).unwrap_or_default();
        let facts = facts.strip_suffix('}').unwrap_or_default();
        let part = |json: &Option<String>| json.as_deref().unwrap_or("null").to_owned();
        let (drawing, path) = (part(&self.drawing), part(&self.path));
        format!("{{\"hello\":{facts},\"drawing\":{drawing},\"path\":{path}}}}}")
    }
}

/// What was learned on drives.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct LearnedView {
    /// Number of the pictures at `/api/learned.png` and `/api/corrected.svg`.
    pub picture: u64,
    /// Whether the robot drives in it, without a start.
    pub accepted: bool,
    /// Whether the pictures show a drive that is not over.
    pub growing: bool,
}

/// The limits that a page has to observe.
#[derive(Debug, Clone, Serialize)]
pub struct Limits {
    /// Size of a drawing.
    pub bytes: usize,
    /// Maximum number of points of all strokes and obstacles together.
    pub points: usize,
    /// Number of strokes and obstacles.
    pub strokes: usize,
    /// Number of goals.
    pub goals: usize,
    /// Points of a route.
    pub path_points: usize,
    /// Time without a link after which the mission pauses, in seconds.
    pub link_limit_s: f64,
    /// Minimum and maximum of that limit, in seconds.
    pub link_limit_range_s: [f64; 2],
}

impl Limits {
    /// Returns the limits, with the given limit for the link.
    pub fn new(link_limit_s: f64) -> Self {
        Self {
            bytes: MAX_DRAWING_BYTES,
            points: MAX_DRAWN_POINTS,
            strokes: MAX_STROKES,
            goals: MAX_TASKS,
            path_points: MAX_ROUTE_POINTS,
            link_limit_s,
            link_limit_range_s: LINK_LIMIT_S,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn strokes(count: usize, points: usize) -> Vec<u8> {
        let stroke = format!("{{\"points\":[{}]}}", vec!["[1,1]"; points].join(","));
        format!("{{\"canvas\":[9,9],\"strokes\":[{}],\"pad\":{{}}}}", vec![stroke; count].join(",")).into()
    }

    #[test]
    fn counts_are_bounded() {
        let parse = |bytes| SketchRequest::parse(SketchType::Strokes, bytes);
        assert_eq!(parse(strokes(3, 4)).unwrap().canvas, Some([9, 9]));
        let million = parse(strokes(1, 1_000_000)).unwrap_err();
        assert_eq!(million.status(), 413);
        assert!(million.to_string().contains("262144 points") && million.to_string().contains("1000000"));
        assert_eq!(parse(strokes(5000, 1)).unwrap_err().status(), 413);
        assert_eq!(parse(vec![b' '; MAX_DRAWING_BYTES + 1]).unwrap_err().status(), 413);
        assert_eq!(parse(b"{\"canvas\"".to_vec()).unwrap_err().status(), 400);
    }

    #[test]
    fn goals_come_with_and_without_names() {
        let path = PathRequest::parse(br#"{"goals":[[1,2],{"name":"hall","at":[3,4]}]}"#).unwrap();
        let names: Vec<_> = path.marks.goals.iter().map(|goal| goal.name.as_str()).collect();
        assert_eq!(names, ["", "hall"]);
    }

    #[test]
    fn a_path_that_cannot_be_is_refused_in_words() {
        let many = format!("{{\"goals\":[{}]}}", vec!["[1,1]"; 65].join(","));
        for (body, status, words) in [
            ("{}", 400, "one of route and goals"),
            (r#"{"route":[[1,2]]}"#, 400, "2 points"),
            (r#"{"route":[[1,2],[3,4]],"goals":[[1,2]]}"#, 400, "one of"),
            (r#"{"route":[[1,"a"]]}"#, 400, "the path"),
            ("{\"goals\":[{\"name\":\"\\u001b\",\"at\":[1,2]}]}", 400, "control"),
            (&many, 413, "64 goals"),
        ] {
            let refusal = PathRequest::parse(body.as_bytes()).unwrap_err();
            assert_eq!(refusal.status(), status, "{body}");
            assert!(refusal.to_string().contains(words), "{refusal}");
        }
    }

    #[test]
    fn a_page_wants_one_thing_with_the_wheel() {
        let parse = |text: &str| WheelWish::parse(text.as_bytes()).map_err(|refusal| refusal.status());
        assert_eq!((parse(""), parse(r#""take""#)), (Ok(WheelWish::Take), Ok(WheelWish::Take)));
        assert_eq!(parse(r#"{"ask":"Anna"}"#), Ok(WheelWish::Ask("Anna".into())));
        assert_eq!(parse(r#"{"give":2}"#), Ok(WheelWish::Give(2)));
        for wrong in ["{}", "[]", r#"{"give":2,"ask":""}"#, r#"{"give":-1}"#, r#"{"to":2}"#] {
            assert_eq!(parse(wrong), Err(400), "{wrong}");
        }
    }

    #[test]
    fn the_page_says_few_things() {
        assert_eq!(Said::parse(r#"{"abort":true}"#), Some(Said::Abort));
        assert_eq!(Said::parse(r#"{"seen":7}"#), Some(Said::Seen(7)));
        assert_eq!(Said::parse(r#"{"ping":1.5}"#), Some(Said::Ping(1.5)));
        let presence = r#"{"presence":{"name":"Anna","sheet":"a1","at":[1,2],"draft":[[1,2]]}}"#;
        assert!(
            matches!(Said::parse(presence), Some(Said::Presence(Presence { draft, .. })) if draft == [[1.0, 2.0]])
        );
        for (good, bad) in [("Anna", "Anna, who has a very long name"), ("Anna", "\\u001b"), ("a1", "<b>")] {
            assert_eq!(Said::parse(&presence.replace(good, bad)), None, "{bad}");
        }
        for other in ["", "{}", "[]", r#"{"abort":false}"#, r#"{"order":"execute"}"#, r#"{"seen":-1}"#] {
            assert_eq!(Said::parse(other), None, "{other}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn nothing_that_comes_in_panics(text in ".{0,80}", bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Said::parse(&text);
            let _ = PathRequest::parse(&bytes);
            let _ = PathRequest::parse(text.as_bytes());
            let _ = SketchRequest::parse(SketchType::Strokes, bytes);
        }
    }
}
