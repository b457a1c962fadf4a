//! A page's WebSocket, which sends the latest pictures and receives short messages.
//!
//! Messages are received even while sending waits for a slow link, so an abort never has to wait.

use std::time::Duration;

use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::json;
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, sleep_until, timeout};

use crate::board::{Board, Call, Caller, Picture, Together, Welcome};
use crate::guard::Bucket;
use crate::protocol::{Hello, Said};

/// Feeds that may be in transit unseen.
const MAX_UNSEEN: u64 = 2;
/// Interval of feeds to a page that does not confirm them.
const UNSEEN_EVERY: Duration = Duration::from_secs(1);
/// Interval of pings to the page's browser.
const PING_EVERY: Duration = Duration::from_millis(500);
/// Minimum interval of news of the other pages.
const OTHERS_EVERY: Duration = Duration::from_millis(30);
/// Size, in bytes, above which a message is announced to the page. Otherwise, the page would restart a slow link that it considers
/// dead.
const LONG_BYTES: usize = 100_000;
/// Maximum number of a page's messages that wait for the answering task. Any more are dropped.
const MAX_WORDS: usize = 32;

/// Time without any data after which a page counts as disconnected, even if the operating system still considers it connected. Its
/// browser answers every ping. While the page is still receiving older data, it pings the pad itself.
const SILENT: Duration = Duration::from_secs(20);
/// Number of a page's messages that are handled immediately, and per second after that. The rest wait on the page's link.
const WORDS: [f64; 2] = [200.0, 60.0];
/// Interval at which the bridge is notified that data has arrived from a page.
const HEARD_EVERY: Duration = Duration::from_millis(100);

/// Serves a page until it disconnects.
pub(super) async fn serve(socket: WebSocket, (session, page): (&str, u32), caller: &Caller) {
    let (sink, stream) = socket.split();
    let (words, said) = mpsc::channel(MAX_WORDS);
    // If one ends, so does the other: a link that can no longer send may wait for a long time.
    tokio::select! {
        () = listen(stream, (session, page), caller, words) => {}
        () = talk(sink, (session, page), caller, said) => {}
    }
}

/// Sends the page the latest state, and answers it.
async fn talk(
    mut sink: SplitSink<WebSocket, Message>,
    (session, page): (&str, u32),
    caller: &Caller,
    mut said: mpsc::Receiver<Said>,
) {
    let mut talk = Talk::new(session.to_owned());
    let (mut pictures, mut welcomes) = (caller.board.picture.subscribe(), caller.board.welcome.subscribe());
    welcomes.mark_changed();
    let mut others = caller.board.together.as_ref().map(|together| Others::of(together, page));
    let mut pings = interval(PING_EVERY);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let due = talk.feed_due();
        let message = tokio::select! {
            word = said.recv() => match word {
                Some(word) => talk.answer(word).map(text),
                None => return,
            },
            changed = welcomes.changed() => match changed {
                Ok(()) => {
                    // Another page may drive now.
                    others.iter_mut().for_each(|others| others.people.mark_changed());
                    welcomes.borrow_and_update().as_deref().map(|w| text(talk.hello(w)))
                }
                Err(_) => return,
            },
            news = next(&mut others, &caller.board) => Some(text(news)),
            _ = pings.tick() => Some(Message::Ping(Vec::new().into())),
            _ = async { sleep_until(due).await; pictures.changed().await } => {
                let picture = pictures.borrow_and_update().clone();
                Some(text(talk.feed(&picture)))
            }
        };
        let Some(message) = message else { continue };
        let bytes = message.to_text().map_or(0, str::len);
        if bytes > LONG_BYTES && sink.send(text(json!({ "long": bytes }).to_string())).await.is_err() {
            return;
        }
        if sink.send(message).await.is_err() {
            return;
        }
    }
}

/// The other pages: what this one has heard of them.
struct Others<'a> {
    together: &'a Together,
    page: u32,
    drawn: watch::Receiver<()>,
    people: watch::Receiver<()>,
    /// Number of the last change that was sent.
    seq: u64,
    /// When the last message was sent.
    last: Instant,
}

impl<'a> Others<'a> {
    fn of(together: &'a Together, page: u32) -> Self {
        let (mut drawn, mut people) = (together.drawn.subscribe(), together.people.subscribe());
        drawn.mark_changed();
        people.mark_changed();
        Self { together, page, drawn, people, seq: 0, last: Instant::now() }
    }
}

/// Waits for news of the others, which come at intervals.
async fn next(others: &mut Option<Others<'_>>, board: &Board) -> String {
    let Some(others) = others else { return std::future::pending().await };
    sleep_until(others.last + OTHERS_EVERY).await;
    let news = tokio::select! {
        biased;
        _ = others.drawn.changed() => {
            let (text, seq) = others.together.room().news(others.seq);
            others.seq = seq;
            text
        }
        _ = others.people.changed() => others.together.room().people(others.page, board.driver().as_deref()),
    };
    others.last = Instant::now();
    news
}

fn text(text: String) -> Message {
    Message::Text(Utf8Bytes::from(text))
}

/// Receives the page's messages until it disconnects or becomes silent.
async fn listen(
    mut stream: SplitStream<WebSocket>,
    (session, page): (&str, u32),
    caller: &Caller,
    words: mpsc::Sender<Said>,
) {
    let began = Instant::now();
    let mut patience = Bucket::full(WORDS, Duration::ZERO);
    let mut told: Option<Instant> = None;
    while let Ok(Some(Ok(message))) = timeout(SILENT, stream.next()).await {
        if told.is_none_or(|told| told.elapsed() >= HEARD_EVERY) {
            // If the bridge is too busy, it gets the next notification.
            let _ = caller.call(Call::Heard(session.to_owned()));
            told = Some(Instant::now());
        }
        if let Message::Text(text) = message {
            match Said::parse(&text) {
                // The feed shows its result.
                Some(Said::Abort) => drop(caller.abort()),
                Some(Said::Presence(presence)) => {
                    if let Some(together) = &caller.board.together {
                        together.meet(|room| room.show(page, presence));
                    }
                }
                Some(word) => drop(words.try_send(word)),
                None => {}
            }
        }
        while !patience.take(WORDS, began.elapsed()) {
            sleep(HEARD_EVERY).await;
        }
    }
}

/// The feeds that a page has been sent and has displayed.
struct Talk {
    session: String,
    sent: u64,
    seen: u64,
    last: Instant,
}

impl Talk {
    fn new(session: String) -> Self {
        Self { session, sent: 0, seen: 0, last: Instant::now() }
    }

    /// When the page may get the next picture.
    fn feed_due(&self) -> Instant {
        if self.sent - self.seen < MAX_UNSEEN { self.last } else { self.last + UNSEEN_EVERY }
    }

    fn answer(&mut self, word: Said) -> Option<String> {
        match word {
            Said::Seen(n) => {
                self.seen = self.seen.max(n.min(self.sent));
                None
            }
            Said::Ping(t) => Some(json!({ "pong": t }).to_string()),
            Said::Abort | Said::Presence(_) => None,
        }
    }

    fn hello(&self, welcome: &Welcome) -> String {
        let drives = welcome.driver.as_deref() == Some(&self.session);
        Hello { session: self.session.clone(), drives, ..welcome.hello.clone() }.text()
    }

    fn feed(&mut self, picture: &Picture) -> String {
        self.sent += 1;
        self.last = Instant::now();
        let drives = picture.driver.as_deref() == Some(&self.session);
        let may = if drives { &picture.driver_may } else { &picture.watcher_may };
        let mut own = json!({ "n": self.sent, "drives": drives, "wheel": picture.wheel, "allowed": may });
        if picture.pleas.iter().any(|plea| plea.session == self.session) {
            own["asks"] = true.into();
        }
        if drives && !picture.pleas.is_empty() {
            let pleas = picture.pleas.iter().map(|plea| json!({ "page": plea.page, "name": plea.name }));
            own["pleas"] = pleas.collect();
        }
        let own = own.to_string();
        let own = own.strip_prefix('{').and_then(|own| own.strip_suffix('}')).unwrap_or_default();
        let comma = if picture.body.is_empty() { "" } else { "," };
        format!("{{\"feed\":{{{own}{comma}{}}}}}", picture.body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Step;
    use crate::sessions::Plea;

    #[test]
    fn only_the_driver_sees_who_asks_for_the_wheel_and_nobody_sees_a_session() {
        let plea = Plea { session: "secret".into(), page: 2, name: "Anna".into() };
        let picture = Picture { driver: Some("driver".into()), pleas: vec![plea], ..Picture::default() };
        let seen = |session: &str| {
            let text = Talk::new(session.into()).feed(&picture);
            assert!(!text.contains("secret"), "{text}");
            let feed: serde_json::Value = serde_json::from_str(&text).unwrap();
            [&feed["feed"]["pleas"], &feed["feed"]["asks"]].map(Clone::clone)
        };
        assert_eq!(seen("driver"), [json!([{ "page": 2, "name": "Anna" }]), json!(null)]);
        assert_eq!(seen("secret"), [json!(null), json!(true)]);
        assert_eq!(seen("another"), [json!(null), json!(null)]);
    }

    #[test]
    fn no_more_than_two_pictures_are_on_the_way() {
        let mut talk = Talk::new("me".into());
        let picture =
            Picture { driver: Some("me".into()), driver_may: vec![Step::Abort], ..Picture::default() };
        let first: serde_json::Value = serde_json::from_str(&talk.feed(&picture)).unwrap();
        assert_eq!(
            first,
            json!({ "feed": { "n": 1, "drives": true, "wheel": false, "allowed": ["abort"] } })
        );
        assert!(talk.feed_due() <= Instant::now());
        talk.feed(&picture);
        assert!(talk.feed_due() > Instant::now());
        assert_eq!(talk.answer(Said::Seen(99)), None);
        assert!(talk.feed_due() <= Instant::now(), "it cannot have seen more than was sent");
        assert_eq!(talk.answer(Said::Ping(7.5)), Some("{\"pong\":7.5}".into()));
    }
}
