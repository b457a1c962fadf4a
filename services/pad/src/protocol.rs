//! What the page and the server say to each other.
//!
//! All coordinates are pixels of the canvas, column and row from the top left. Headings are counter-clockwise from "to
//! the right" as one looks at it: (cos h, −sin h) is the direction on the page. The server turns the robot's frame (y
//! up, other scale) round; the page never does.
//!
//! # HTTP
//! Every `POST` has the header `x-sketchnav-session` (from the last `hello`). Everything below has the token of the link that
//! the pad printed: as the header `x-sketchnav-token` or, behind the question mark, as `token=…`. The answer is 200
//! `{"ok":true,…}`, or `{"error":"words"}` with a status of [`Refusal::status`]. `GET` of any other path is a file of
//! the page, or 404.
//!
//! | request | body | answer beside `ok` |
//! |---|---|---|
//! | `POST /api/sketch` | strokes in JSON, as its navigator reads them (what only the page needs is under `pad`), or `content-type: image/png`, `image/jpeg`: a photo | `seq`; of the sketch `wall_direction_rad`, `width_px`, `height_px`; `doubts`: why the drawing may not lead anywhere, in words |
//! | `POST /api/path` | `{"route":[[x,y],…]}` or `{"goals":[[x,y] or {"name","at"},…]}`, either with `"start":{"at","heading_deg"}` | the same |
//! | `POST /api/order` | `{"order":"execute"}`, `abort`, `restore`, `again` | |
//! | `POST /api/here` | `{"at":[x,y]}`, perhaps with `"heading_deg":90`: where the robot is, while it asks | |
//! | `POST /api/wheel` | nothing: takes the wheel when nobody has it, or its holder cannot be heard | |
//! | `POST /api/limit` | `{"link_limit_s":3}` | |
//! | `POST /api/mission` | `{"name":"…"}`: writes a mission file and the drawing into the pad's folder, where no file is in the way that the pad has not written (409) | `files`: of the mission and of the drawing `name` and `text` (null for a photo) |
//! | `GET /api/seat` | `?session=…`: whether a page would be let in now (503: not) | |
//! | `GET /api/walls.png` | | a picture: the walls as the robot understands them, gray with alpha, as large as the sketch; 404 before there are any |
//! | `GET /api/drawing` | | a picture: the photo that is the drawing; 404 where it is none |
//!
//! Sketches, paths, places, limits and missions are taken from the session that drives alone, and no other's are read. Of
//! orders, anybody may give one, `abort`, however often. It goes before all else. It is answered when it was passed on
//! to the planner, or refused (409) where nothing is under way. A connection is one request. Its head comes within 10
//! s, its body within 10 s (a drawing's or a path's within 60 s), or it is refused (408). A session makes few at the
//! same time, and not too often (429). Connections that say nothing are few, too (503): see `doors`.
//!
//! A sketch or a path may have a header `x-sketchnav-sending`, a name that the page makes for it. A page that hears no
//! answer, because the link breaks or the server dies, sends the drawing again by the same name. It is taken over
//! once. What is still being read is waited for, what was answered is answered again.
//!
//! The first path of a sketch places the robot at its first point, looking along it, or at its `start`, which goals
//! need then. A later one leaves the robot where it is, unless it has a `start`.
//!
//! # WebSocket
//! `GET /ws?token=…&session=…`; `session` is that of the last `hello`, so that who comes back keeps the wheel.
//! Everything is text, one JSON object each; what the page says has at most 1024 bytes.
//!
//! - `{"hello":{…}}`: [`Hello`], again whenever something in it changes but the trail, which grows in the feed;
//! - `{"feed":{"n":…,…}}` is what there is to see ([`Feed`](crate::feed::Feed)). For this page it adds `drives`,
//!   `wheel` (whether it can be taken) and `allowed` (the steps that are open to it). The page answers `{"seen":n}`
//!   when it has drawn it. No more than two are on the way unseen (a page that says nothing gets one a second). So a
//!   slow page gets the newest picture, never a queue;
//! - `{"ping":t}` is answered by `{"pong":t}`, any number;
//! - `{"abort":true}`: as the order; the feed shows what becomes of it.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::MAX_ROUTE_POINTS;
use sketchnav_schemas::message::{MAX_DRAWING_BYTES, MAX_DRAWN_POINTS, MAX_TASKS};
use sketchnav_stage::drawn::{GoalMark, Marks, StartMark};

/// Most strokes of a drawing.
pub const MAX_STROKES: usize = 4096;
/// Longest path request, bytes.
pub const MAX_PATH_BYTES: usize = 1 << 20;
/// Longest of all other requests, bytes.
pub const MAX_SMALL_BYTES: usize = 4096;
/// How long the link to the driver may be lost before the mission pauses, seconds: from, to.
pub const LINK_LIMIT_S: [f64; 2] = [1.0, 60.0];
/// The default of that.
pub const DEFAULT_LINK_LIMIT_S: f64 = 3.0;

/// Why a request is not done, in words for the page.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It is not what the protocol says.
    #[error("{0}")]
    Malformed(String),
    /// The token is missing or wrong.
    #[error("expected the token of the link that the pad printed, found {0}")]
    Token(&'static str),
    /// It comes from another page, by another name, or from no session.
    #[error("{0}")]
    Forbidden(String),
    /// Not in this state.
    #[error("{0}")]
    NotNow(String),
    /// It does not come to an end.
    #[error("{0}")]
    Slow(String),
    /// Larger than it may be.
    #[error("expected at most {limit}, found {found}")]
    TooLarge {
        /// What is allowed.
        limit: String,
        /// What it is.
        found: String,
    },
    /// The drawing cannot be used; the sketcher's words.
    #[error("{0}")]
    Drawing(String),
    /// More often than it may be.
    #[error("too many requests: wait a moment and send it again")]
    TooOften,
    /// More at the same time than there may be.
    #[error("expected at most {0} requests of a page at the same time, found one more")]
    AtOnce(usize),
    /// The navigation does not answer.
    #[error("{0}")]
    Absent(String),
    /// A file is in the way that the pad has not written.
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

    /// That a request is no JSON of the kind.
    pub fn malformed(what: &str, error: impl std::fmt::Display) -> Self {
        Self::Malformed(format!("{what}: {error}"))
    }

    /// That only who drives may ask for it.
    pub fn watches() -> Self {
        Self::Forbidden("another page drives; this one watches".into())
    }

    /// That there is nobody to ask any more.
    pub fn ending() -> Self {
        Self::Absent("the pad is ending".into())
    }

    /// That something is larger than it may be.
    pub fn too_large(limit: usize, unit: &str, found: impl std::fmt::Display) -> Self {
        Self::TooLarge { limit: format!("{limit} {unit}"), found: found.to_string() }
    }
}

/// What a drawing that was sent is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SketchType {
    /// Strokes in JSON.
    Strokes,
    /// A picture.
    Png,
    /// A picture.
    Jpeg,
}

impl SketchType {
    /// By the `content-type` of a request.
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

    /// As a `content-type`.
    pub fn content_type(self) -> &'static str {
        match self {
            Self::Strokes => "application/json",
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }

    /// As a file name's extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Strokes => "json",
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// A drawing that may be sent on: its counts are bounded; the sketcher says whether it can be used.
#[derive(Debug, Clone, PartialEq)]
pub struct SketchRequest {
    /// What it is.
    pub kind: SketchType,
    /// As it came.
    pub bytes: Vec<u8>,
    /// Its canvas, where it says one; a picture's is its own size.
    pub canvas: Option<[u32; 2]>,
}

/// As much of a strokes file as is counted.
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
    /// Checks what is bounded.
    ///
    /// # Errors
    /// [`Refusal::TooLarge`] with what and how many; [`Refusal::Malformed`].
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

/// A path or goals that may be sent on.
#[derive(Debug, Clone, PartialEq)]
pub struct PathRequest {
    /// As it came, for other pages.
    pub body: String,
    /// As the sketcher reads it.
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
    /// Checks what is bounded.
    ///
    /// # Errors
    /// [`Refusal::TooLarge`] with what and how many; [`Refusal::Malformed`].
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

/// What a person orders.
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
    /// Go on.
    Restore,
    /// Begin with the first task once more.
    Again,
    /// Say where the robot is: [`HereBody`].
    Here,
}

/// `{"order":…}`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderBody {
    /// `execute`, `abort`, `restore` or `again`.
    pub order: Step,
}

/// `{"at":[x,y],"heading_deg":90}`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HereBody {
    /// Where in the drawing the robot is.
    pub at: [f64; 2],
    /// Its heading, where it is known.
    pub heading_deg: Option<f64>,
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
    /// For people, and for the file's name.
    pub name: String,
}

/// Reads a small request.
///
/// # Errors
/// [`Refusal::Malformed`] with where.
pub fn parse<'a, T: Deserialize<'a>>(what: &str, bytes: &'a [u8]) -> Result<T, Refusal> {
    serde_json::from_slice(bytes).map_err(|error| Refusal::malformed(what, error))
}

/// What the page says on the WebSocket.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Said {
    /// It wants an answer with the same number.
    Ping(f64),
    /// It has drawn the feed of this number.
    Seen(u64),
    /// Stop the robot.
    Abort,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SaidBody {
    ping: Option<f64>,
    seen: Option<u64>,
    abort: Option<bool>,
}

impl Said {
    /// Reads a text; `None` where it is nothing of the protocol.
    pub fn parse(text: &str) -> Option<Self> {
        match serde_json::from_str(text).ok()? {
            SaidBody { abort: Some(true), .. } => Some(Self::Abort),
            SaidBody { seen: Some(n), .. } => Some(Self::Seen(n)),
            SaidBody { ping: Some(t), .. } => Some(Self::Ping(t)),
            SaidBody { .. } => None,
        }
    }
}

/// Who a page is and what there is already.
#[derive(Debug, Clone, Serialize)]
pub struct Hello {
    /// The page's session.
    pub session: String,
    /// Whether it drives.
    pub drives: bool,
    /// `draws`, or `watches` where the drawing and the tasks come from a mission file.
    pub mode: &'static str,
    /// Width and height of the canvas.
    pub canvas: [u32; 2],
    /// The mission's name.
    pub mission: String,
    /// The robot's radius, metres.
    pub robot_radius_m: f64,
    /// What is bounded.
    pub limits: Limits,
    /// The drawing that holds, JSON as it was sent; for a photo `{"canvas":…,"image":"/api/drawing"}`.
    #[serde(skip)]
    pub drawing: Option<String>,
    /// The path that holds, JSON as it was sent.
    #[serde(skip)]
    pub path: Option<String>,
    /// Number of the walls that `/api/walls.png` has; 0 where there are none yet.
    pub walls: u64,
    /// Where the robot has been since it was placed.
    pub trail: Vec<[f64; 2]>,
}

impl Hello {
    /// The whole text, `{"hello":{…}}`.
    pub fn text(&self) -> String {
        let facts = serde_json::to_string(self).unwrap_or_default();
        let facts = facts.strip_suffix('}').unwrap_or_default();
        let part = |json: &Option<String>| json.as_deref().unwrap_or("null").to_owned();
        let (drawing, path) = (part(&self.drawing), part(&self.path));
        format!("{{\"hello\":{facts},\"drawing\":{drawing},\"path\":{path}}}}}")
    }
}

/// What is bounded.
#[derive(Debug, Clone, Serialize)]
pub struct Limits {
    /// Of a drawing.
    pub bytes: usize,
    /// Of all strokes and obstacles.
    pub points: usize,
    /// Strokes and obstacles.
    pub strokes: usize,
    /// In order.
    pub goals: usize,
    /// Of a route.
    pub path_points: usize,
    /// How long the link may be lost before the mission pauses.
    pub link_limit_s: f64,
    /// From, to.
    pub link_limit_range_s: [f64; 2],
}

impl Limits {
    /// The limits, with what somebody has set.
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
    fn the_page_says_few_things() {
        assert_eq!(Said::parse(r#"{"abort":true}"#), Some(Said::Abort));
        assert_eq!(Said::parse(r#"{"seen":7}"#), Some(Said::Seen(7)));
        assert_eq!(Said::parse(r#"{"ping":1.5}"#), Some(Said::Ping(1.5)));
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
