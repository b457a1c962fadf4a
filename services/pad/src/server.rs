//! The HTTP server, which checks requests and their limits, and passes them to the bridge.

mod listen;
mod socket;

use std::convert::Infallible;
use std::net::TcpListener as StdListener;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{FromRequestParts, Query, Request, State, WebSocketUpgrade};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use rand::RngExt;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, oneshot};

use crate::board::{Call, Caller, Image, Request as Wish, image};
use crate::bridge::ok;
use crate::guard::{self, Guard, Load, Rates};
use crate::metrics;
use crate::page;
use crate::protocol::{
    LimitBody, MAX_PATH_BYTES, MAX_SMALL_BYTES, MAX_STUDY_BYTES, MissionBody, OrderBody, PathRequest,
    Refusal, SketchRequest, SketchType, Step, WheelWish, parse,
};
use crate::together::Change;
use sketchnav_schemas::message::MAX_DRAWING_BYTES;

/// Maximum number of drawings that are received at the same time, all of them from the driver.
const MAX_UPLOADS: usize = 2;
/// Maximum number of changes of the shared drawing that are received at the same time.
const MAX_CHANGES: usize = 8;
/// Maximum time for the body of a request to arrive: for a drawing, and for any other request.
const DRAWING_WITHIN: Duration = Duration::from_secs(60);
const BODY_WITHIN: Duration = Duration::from_secs(10);
/// Maximum length of a page's message on its WebSocket, in bytes.
const MAX_TEXT: usize = 1024;
const SESSION: HeaderName = HeaderName::from_static("x-sketchnav-session");
const TOKEN: HeaderName = HeaderName::from_static("x-sketchnav-token");
const SENDING: HeaderName = HeaderName::from_static("x-sketchnav-sending");
/// Maximum length of a sending's name, in bytes.
const MAX_SENDING: usize = 64;
/// What the page may load and connect to: only this server.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
     connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What every request needs.
#[derive(Clone)]
struct Desk {
    caller: Caller,
    guard: Arc<Guard>,
    rates: Arc<Mutex<Rates>>,
    uploads: Arc<Semaphore>,
    changes: Arc<Semaphore>,
    began: Instant,
}

type Reply = Result<Value, Refusal>;

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status()).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        answer(status, &json!({ "error": self.to_string() }))
    }
}

/// Serves until `end` is notified, in a separate thread.
///
/// # Errors
/// If the listener fails.
pub fn serve(listener: StdListener, guard: Guard, caller: Caller, end: Arc<Notify>) -> std::io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let desk = Desk::new(guard, caller);
    runtime.block_on(async {
        listener.set_nonblocking(true)?;
        let listener = TcpListener::from_std(listener)?;
        tokio::select! {
            failure = listen::listen(listener, router(desk)) => Err(failure),
            () = end.notified() => Ok(()),
        }
    })
}

fn router(desk: Desk) -> Router {
    // Everything that acts or reveals something requires the token; the page's own files do not.
    let api = Router::new()
        .route("/api/sketch", post(sketch))
        .route("/api/path", post(path))
        .route("/api/order", post(order))
        .route("/api/here", post(here))
        .route("/api/wheel", post(wheel))
        .route("/api/draw", post(draw))
        .route("/api/limit", post(limit))
        .route("/api/mission", post(mission))
        .route("/api/study", post(study))
        .route("/api/seat", get(seat))
        .route("/api/walls.png", get(walls))
        .route("/api/learned.png", get(learned))
        .route("/api/corrected.svg", get(corrected))
        .route("/api/drawing", get(drawing))
        .route("/api/place.svg", get(place))
        .route("/metrics", get(metrics))
        .route("/ws", get(connect))
        .route_layer(middleware::from_fn_with_state(desk.clone(), check_token));
    api.fallback(asset).layer(middleware::from_fn_with_state(desk.clone(), check_origin)).with_state(desk)
}

/// Returns the value of a header that occurs once. An ambiguous header counts as missing.
fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    only(headers, name).ok().flatten()
}

fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Result<Option<&'a str>, Refusal> {
    guard::only(name.as_str(), headers.get_all(name).iter().map(HeaderValue::as_bytes))
}

/// Checks that the request comes from the page itself, or from a program that is not a browser.
fn origin_of(guard: &Guard, request: &Request) -> Result<(), Refusal> {
    let headers = request.headers();
    let (host, origin) = (only(headers, &header::HOST)?, only(headers, &header::ORIGIN)?);
    // The target may name a host, too (RFC 9112, 3.2.2), which must be the same.
    match request.uri().authority() {
        Some(target) if host != Some(target.as_str()) => {
            Err(Refusal::Forbidden(format!("host: expected that of the target, {target}, found {host:?}")))
        }
        _ => guard.check_origin(host, origin),
    }
}

async fn check_origin(State(desk): State<Desk>, request: Request, next: Next) -> Response {
    let mut response = match origin_of(&desk.guard, &request) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    let is_request = response.status() != StatusCode::SWITCHING_PROTOCOLS;
    let headers = response.headers_mut();
    if is_request {
        headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The query parameters.
#[derive(Deserialize)]
struct Asked {
    token: Option<String>,
    session: Option<String>,
}

async fn check_token(
    State(desk): State<Desk>,
    Query(asked): Query<Asked>,
    request: Request,
    next: Next,
) -> Response {
    let found = text(request.headers(), &TOKEN).or(asked.token.as_deref());
    match desk.guard.check_token(found) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

/// An accepted request of a known session, for its duration.
struct Admitted {
    session: String,
    _place: OwnedSemaphorePermit,
}

impl Desk {
    fn new(guard: Guard, caller: Caller) -> Self {
        let [uploads, changes] = [MAX_UPLOADS, MAX_CHANGES].map(|most| Arc::new(Semaphore::new(most)));
        Self {
            caller,
            guard: Arc::new(guard),
            rates: Arc::default(),
            uploads,
            changes,
            began: Instant::now(),
        }
    }

    fn rates(&self) -> MutexGuard<'_, Rates> {
        self.rates.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Accepts a request if its session may make one now. The connection is then no longer a stranger's.
    fn admit(&self, visit: &Visit, load: Load) -> Result<Admitted, Refusal> {
        let (session, place) =
            self.rates().take(text(&visit.headers, &SESSION), load, self.began.elapsed())?;
        visit.leave_lobby();
        Ok(Admitted { session, _place: place })
    }

    /// Like [`Desk::admit`], but for requests that only the driver may make. Those of other sessions are not even read.
    fn admit_driver(&self, visit: &Visit, load: Load) -> Result<Admitted, Refusal> {
        let admitted = self.admit(visit, load)?;
        match self.caller.board.drives(&admitted.session) {
            true => Ok(admitted),
            false => Err(Refusal::watches()),
        }
    }

    async fn ask(&self, admitted: Admitted, wish: Wish) -> Reply {
        self.caller.ask(admitted.session.clone(), wish).await.map(ok)
    }
}

/// A request before its body.
struct Visit {
    headers: HeaderMap,
    place: Option<Arc<listen::Place>>,
}

impl<S: Sync> FromRequestParts<S> for Visit {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self { headers: parts.headers.clone(), place: parts.extensions.get().cloned() })
    }
}

impl Visit {
    /// The page's own name for this sending.
    fn sending(&self) -> Result<Option<String>, Refusal> {
        let Some(name) = self.headers.get(SENDING) else { return Ok(None) };
        let name = name.to_str().ok().filter(|name| (1..=MAX_SENDING).contains(&name.len()));
        let words = || format!("{SENDING}: expected 1 to {MAX_SENDING} ASCII characters");
        name.map(|name| Some(name.to_owned())).ok_or_else(|| Refusal::Malformed(words()))
    }

    /// The connection is no longer a stranger's.
    fn leave_lobby(&self) {
        if let Some(place) = &self.place {
            place.leave();
        }
    }
}

/// The whole body, if it is within `limit`.
async fn body(visit: &Visit, body: Body, limit: usize, within: Duration) -> Result<Bytes, Refusal> {
    let told = text(&visit.headers, &header::CONTENT_LENGTH).and_then(|length| length.parse::<usize>().ok());
    if let Some(length) = told.filter(|length| *length > limit) {
        return Err(Refusal::too_large(limit, "bytes", length));
    }
    match tokio::time::timeout(within, to_bytes(body, limit)).await {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(_)) => Err(Refusal::too_large(limit, "bytes", "more, or a request that was cut off")),
        Err(_) => Err(Refusal::Slow(format!("expected the whole request within {within:?}"))),
    }
}

fn answer(status: StatusCode, value: &Value) -> Response {
    (status, [(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response()
}

fn respond(reply: Reply) -> Response {
    reply.map_or_else(IntoResponse::into_response, |value| answer(StatusCode::OK, &value))
}

async fn sketch(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Upload)?;
        let sending = visit.sending()?;
        let kind = SketchType::of(text(&visit.headers, &header::CONTENT_TYPE))?;
        let Ok(_place) = desk.uploads.try_acquire() else { return Err(Refusal::TooOften) };
        let bytes = body(&visit, content, MAX_DRAWING_BYTES, DRAWING_WITHIN).await?;
        let request = aside(move || SketchRequest::parse(kind, bytes.into())).await?;
        desk.ask(admitted, Wish::Sketch(request, sending)).await
    };
    respond(reply.await)
}

async fn path(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Upload)?;
        let sending = visit.sending()?;
        let bytes = body(&visit, content, MAX_PATH_BYTES, DRAWING_WITHIN).await?;
        let request = aside(move || PathRequest::parse(&bytes)).await?;
        desk.ask(admitted, Wish::Path(request, sending)).await
    };
    respond(reply.await)
}

/// Parses in another thread, so that an abort does not have to wait for it.
async fn aside<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|_| Err(Refusal::Malformed("the request cannot be read".into())))
}

async fn order(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit(&visit, Load::Other);
        let bytes = body(&visit, content, MAX_SMALL_BYTES, BODY_WITHIN).await?;
        let OrderBody { order } = parse("the order", &bytes)?;
        if order == Step::Abort && !matches!(admitted, Err(Refusal::Forbidden(_))) {
            // Not limited in rate.
            return desk.caller.abort().await.unwrap_or_else(|_| Err(Refusal::ending())).map(ok);
        }
        desk.ask(admitted?, Wish::Order(order)).await
    };
    respond(reply.await)
}

async fn here(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Other)?;
        let bytes = body(&visit, content, MAX_SMALL_BYTES, BODY_WITHIN).await?;
        desk.ask(admitted, Wish::Here(parse("the place", &bytes)?)).await
    };
    respond(reply.await)
}

async fn wheel(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit(&visit, Load::Other)?;
        let bytes = body(&visit, content, MAX_SMALL_BYTES, BODY_WITHIN).await?;
        desk.ask(admitted, Wish::Wheel(WheelWish::parse(&bytes)?)).await
    };
    respond(reply.await)
}

async fn draw(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let _admitted = desk.admit(&visit, Load::Change)?;
        let together = desk.caller.board.together.as_ref();
        let together =
            together.ok_or_else(|| Refusal::NotNow("expected a pad on which people draw freely".into()))?;
        let Ok(_place) = desk.changes.try_acquire() else { return Err(Refusal::TooOften) };
        let bytes = body(&visit, content, MAX_DRAWING_BYTES, DRAWING_WITHIN).await?;
        together.draw(aside(move || Change::parse(&bytes)).await?)?;
        Ok(ok(json!({})))
    };
    respond(reply.await)
}

async fn limit(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Other)?;
        let bytes = body(&visit, content, MAX_SMALL_BYTES, BODY_WITHIN).await?;
        let LimitBody { link_limit_s } = parse("the limit", &bytes)?;
        desk.ask(admitted, Wish::Limit(link_limit_s)).await
    };
    respond(reply.await)
}

async fn mission(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Upload)?;
        let bytes = body(&visit, content, MAX_SMALL_BYTES, BODY_WITHIN).await?;
        let MissionBody { name } = parse("the mission", &bytes)?;
        desk.ask(admitted, Wish::Mission(name)).await
    };
    respond(reply.await)
}

async fn study(State(desk): State<Desk>, visit: Visit, content: Body) -> Response {
    let reply = async {
        let admitted = desk.admit_driver(&visit, Load::Upload)?;
        let bytes = body(&visit, content, MAX_STUDY_BYTES, BODY_WITHIN).await?;
        desk.ask(admitted, Wish::Study(parse("the study", &bytes)?)).await
    };
    respond(reply.await)
}

/// Reports whether a page would be admitted, since browsers do not report to a page why its WebSocket was refused.
async fn seat(State(desk): State<Desk>, Query(asked): Query<Asked>) -> Response {
    let (reply, answer) = oneshot::channel();
    let reply = async {
        desk.caller.call(Call::Seat { named: asked.session, reply })?;
        answer.await.unwrap_or_else(|_| Err(Refusal::ending())).map(|()| ok(json!({})))
    };
    respond(reply.await)
}

/// The figures of the system, for Prometheus.
async fn metrics(State(desk): State<Desk>) -> Response {
    let (reply, answer) = oneshot::channel();
    let asked = desk.caller.call(Call::Metrics(reply));
    let told = match asked {
        Ok(()) => answer.await.map_err(|_| Refusal::ending()),
        Err(refusal) => Err(refusal),
    };
    told.map_or_else(IntoResponse::into_response, |text| {
        ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()
    })
}

async fn walls(State(desk): State<Desk>) -> Response {
    picture(image(&desk.caller.board.walls))
}

async fn learned(State(desk): State<Desk>) -> Response {
    picture(image(&desk.caller.board.learned))
}

async fn corrected(State(desk): State<Desk>) -> Response {
    vector(image(&desk.caller.board.corrected))
}

async fn drawing(State(desk): State<Desk>) -> Response {
    picture(image(&desk.caller.board.photo))
}

async fn place(State(desk): State<Desk>) -> Response {
    vector(desk.caller.board.place.get().cloned())
}

fn vector(found: Option<Bytes>) -> Response {
    found.map_or_else(missing, |svg| ([(header::CONTENT_TYPE, "image/svg+xml")], svg).into_response())
}

fn picture(found: Option<Image>) -> Response {
    match found {
        Some(Image { kind, bytes }) => ([(header::CONTENT_TYPE, kind.content_type())], bytes).into_response(),
        None => missing(),
    }
}

fn missing() -> Response {
    answer(StatusCode::NOT_FOUND, &json!({ "error": "there is nothing here" }))
}

async fn asset(request: Request) -> Response {
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    match page::find(request.uri().path()).filter(|_| reads) {
        Some((kind, bytes)) => ([(header::CONTENT_TYPE, kind)], bytes).into_response(),
        None => missing(),
    }
}

async fn connect(
    State(desk): State<Desk>,
    Query(asked): Query<Asked>,
    visit: Visit,
    upgrade: WebSocketUpgrade,
) -> Response {
    let (reply, joined) = oneshot::channel();
    let fresh = format!("{:032x}", rand::rng().random::<u128>());
    let call = Call::Join { named: asked.session, fresh, reply };
    let session = match desk.caller.call(call) {
        Ok(()) => joined.await.unwrap_or_else(|_| Err(Refusal::ending())),
        Err(refusal) => Err(refusal),
    };
    let (session, page) = match session {
        Ok(joined) => joined,
        Err(refusal) => return refusal.into_response(),
    };
    visit.leave_lobby();
    desk.rates().enter(&session, desk.caller.board.driver().as_deref(), desk.began.elapsed());
    if let Some(together) = &desk.caller.board.together {
        together.meet(|room| room.enter(page, &session));
    }
    let seat = Seat { session, page, desk };
    upgrade.max_message_size(MAX_TEXT).max_frame_size(MAX_TEXT).on_upgrade(move |socket| async move {
        socket::serve(socket, (&seat.session, seat.page), &seat.desk.caller).await
    })
}

/// A session's connection, until it ends for any reason.
struct Seat {
    session: String,
    page: u32,
    desk: Desk,
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.desk.rates().leave(&self.session);
        if let Some(together) = &self.desk.caller.board.together {
            together.meet(|room| room.leave(self.page));
        }
        self.desk.caller.leave(std::mem::take(&mut self.session));
    }
}

#[cfg(test)]
mod tests {
    use hyper::service::Service;
    use hyper_util::service::TowerToHyperService;

    use super::*;

    const TOKEN_TEXT: &str = "abcdefgh12345678";

    /// A pad on a loopback address whose bridge has ended.
    fn pad() -> TowerToHyperService<Router> {
        let (caller, _calls) = Caller::new(true, || ());
        let guard = Guard::new("127.0.0.1:7004".parse().unwrap(), Vec::new(), TOKEN_TEXT.parse().unwrap());
        TowerToHyperService::new(router(Desk::new(guard, caller)))
    }

    fn status(method: &str, target: &str, headers: &[(HeaderName, &[u8])]) -> u16 {
        let mut request = Request::builder().method(method).uri(target);
        for (name, value) in headers {
            request = request.header(name, HeaderValue::from_bytes(value).unwrap());
        }
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let answer = runtime.block_on(pad().call(request.body(Body::empty()).unwrap()));
        answer.unwrap().status().as_u16()
    }

    const HOST: (HeaderName, &[u8]) = (header::HOST, b"127.0.0.1:7004");

    /// On a loopback address, no token was required at first, and another user of the machine took the wheel.
    #[test]
    fn whatever_does_or_shows_anything_wants_the_token_also_on_loopback() {
        let posts = ["sketch", "path", "order", "here", "wheel", "draw", "limit", "mission", "study"];
        let posts = posts.map(|name| ("POST", format!("/api/{name}")));
        let pictures =
            ["/api/walls.png", "/api/learned.png", "/api/corrected.svg", "/api/drawing", "/api/place.svg"];
        let gets = ["/api/seat", "/metrics", "/ws"].into_iter().chain(pictures);
        let gets = gets.map(|path| ("GET", path.to_owned()));
        for (method, path) in posts.into_iter().chain(gets) {
            let path = path.as_str();
            let wrong = (TOKEN, b"abcdefgh12345679".as_slice());
            let right = (TOKEN, TOKEN_TEXT.as_bytes());
            assert_eq!(status(method, path, &[HOST]), 401, "{path}");
            assert_eq!(status(method, path, &[HOST, wrong]), 401, "{path}");
            assert_eq!(status(method, &format!("{path}?token=abcdefgh1234567"), &[HOST]), 401, "{path}");
            assert_eq!(
                status(method, path, &[HOST, right.clone(), right.clone()]),
                401,
                "{path}: two tokens"
            );
            assert_ne!(status(method, path, &[HOST, right]), 401, "{path}");
            assert_ne!(status(method, &format!("{path}?token={TOKEN_TEXT}"), &[HOST]), 401, "{path}");
        }
        // The page belongs to the program, and is the same for all.
        for path in ["/", "/app.js", "/style.css"] {
            assert_eq!(status("GET", path, &[HOST]), 200, "{path}");
        }
    }

    /// An origin that was not ASCII once counted as missing, and of two hosts the first was read.
    #[test]
    fn a_host_or_an_origin_that_can_be_read_in_two_ways_is_refused() {
        let own = (header::ORIGIN, b"http://127.0.0.1:7004".as_slice());
        assert_eq!(status("GET", "/", &[HOST, own.clone()]), 200);
        assert_eq!(status("GET", "http://127.0.0.1:7004/", &[HOST]), 200);
        let evil = (header::HOST, b"evil.example:7004".as_slice());
        let foreign = |text: &'static [u8]| (header::ORIGIN, text);
        let refused: [(&str, &[_]); 8] = [
            ("/", &[HOST, foreign("http://ä.example".as_bytes())]),
            ("/", &[HOST, foreign(b"http://\xff.example")]),
            ("/", &[HOST, own.clone(), foreign(b"http://evil.example")]),
            ("/", &[HOST, foreign(b"http://evil.example"), own]),
            ("/", &[HOST, evil.clone()]),
            ("/", &[evil.clone(), HOST]),
            ("http://evil.example:7004/", &[HOST]),
            ("http://127.0.0.1:7004/", &[evil]),
        ];
        for (target, headers) in refused {
            assert_eq!(status("GET", target, headers), 403, "{target} {headers:?}");
        }
    }
}
