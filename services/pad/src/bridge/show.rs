//! Puts on the board what pages show: the welcome, the walls and the feed. Of the bridge's state, it only
//! changes what concerns these.

use std::sync::Arc;
use std::time::Duration;

use serde_json::json;
use sketchnav_files::{DRAWING, Disk, Files};
use sketchnav_schemas::bounds::ANGLE_DEG;
use sketchnav_schemas::message::Here;
use sketchnav_stage::Navigator;
use sketchnav_stage::doubts::Doubts;
use sketchnav_stage::lookout::{Picture as Shown, Sheet};

use super::Bridge;
use crate::board::{Call, Image, Picture, Welcome, put_image};
use crate::feed::{self, Feed, PoseView, QuestionView, SIDE_PX, TaskView, View};
use crate::protocol::{Hello, HereBody, Limits, Refusal, SketchType};
use crate::study::Sitting;
use crate::walls;

/// Minimum time between two feeds.
const FEED_EVERY: Duration = Duration::from_millis(90);
/// Maximum time between two feeds, so that pages notice when nothing arrives from the navigation.
const FEED_AT_LEAST: Duration = Duration::from_millis(500);
/// The canvas of Boniardi et al. 2016, section IV.
const CANVAS: [u32; 2] = [2540, 1252];

impl Bridge<'_> {
    /// Paints the walls of the current drawing in a separate thread, unless they have been painted.
    pub(super) fn paint(&mut self) {
        let memory = self.machine.memory();
        let sketch = memory.sketch.as_ref().filter(|_| memory.path.is_none() || self.painting == 0);
        let Some((sketch, drawn)) = sketch.zip(self.drawn) else { return };
        let photo = (sketch.kind != SketchType::Strokes)
            .then(|| Image { kind: sketch.kind, bytes: sketch.bytes.clone().into() });
        put_image(&self.caller.board.photo, photo);
        self.painting += 1;
        let (number, run, bytes) = (self.painting, self.run.clone(), sketch.bytes.clone());
        let caller = self.caller.clone();
        std::thread::spawn(move || {
            if let Some(picture) = (drawn.walls)(&run, &bytes).and_then(|walls| walls::png(&walls)) {
                // If the pad is ending, they are no longer needed.
                let _ = caller.call(Call::Walls(number, picture));
            }
        });
    }

    /// Finds the rooms that the goals of a mission's file describe, in a separate thread, because that reads the drawing.
    pub(super) fn resolve(&self, navigator: &Navigator) {
        let Some(doubts) = navigator.doubts.filter(|_| !self.run.pad.draws()) else { return };
        let (run, caller) = (self.run.clone(), self.caller.clone());
        std::thread::spawn(move || {
            let read = |name: &str| Disk.read(name.as_ref(), DRAWING);
            // Whatever is wrong with the drawing was reported when the mission was started.
            if let Ok(Doubts { resolved, .. }) = doubts(&run, &read)
                && !resolved.is_empty()
            {
                // If the pad is ending, they are no longer needed.
                drop(caller.call(Call::Resolved(resolved)));
            }
        });
    }

    pub(super) fn show_walls(&mut self, picture: Vec<u8>) {
        let image = Image { kind: SketchType::Png, bytes: picture.into() };
        put_image(&self.caller.board.walls, Some(image));
        self.is_new = true;
        self.welcome();
    }

    /// Width and height of the canvas.
    fn canvas(&self) -> [u32; 2] {
        match &self.machine.memory().sketch {
            Some(sketch) => sketch.canvas,
            None => match self.watch.sheet() {
                Sheet::Robot => [SIDE_PX; 2],
                Sheet::Drawing(size_px) => size_px.unwrap_or(CANVAS),
            },
        }
    }

    fn view(&self) -> Option<View> {
        if let Some(learned) = &self.lessons.accepted {
            return Some(View::Learned(learned.lesson.frame.clone()));
        }
        match &self.machine.memory().sketch {
            Some(sketch) => Some(View::Drawing { height_px: sketch.size_px[1].into(), scale: sketch.scale }),
            None => match self.watch.sheet() {
                Sheet::Robot => Some(View::around(&self.run.robot)),
                Sheet::Drawing(size_px) => {
                    size_px.map(|[_, height]| View::Drawing { height_px: height.into(), scale: 1.0 })
                }
            },
        }
    }

    /// Converts a place that a page sends to the sketch.
    pub(super) fn place(&self, HereBody { at, heading_deg }: HereBody) -> Result<Here, Refusal> {
        let [width, height] = self.canvas();
        if !((0.0..f64::from(width)).contains(&at[0]) && (0.0..f64::from(height)).contains(&at[1])) {
            let expected = format!("expected a place in the drawing of {width} × {height} px");
            return Err(Refusal::Malformed(format!("the place: {expected}, found {at:?}")));
        }
        if let Some(found) = heading_deg.filter(|degrees| !ANGLE_DEG.holds(*degrees)) {
            let expected = ANGLE_DEG.words;
            return Err(Refusal::Malformed(format!("the heading: expected {expected}, found {found}")));
        }
        let place = self.view().and_then(|view| view.place(at));
        let at = place.ok_or_else(|| Refusal::NotNow("expected a drawing, found none".into()))?;
        Ok(Here { at, yaw_rad: heading_deg.map(f64::to_radians) })
    }

    /// Sends all pages the welcome again.
    pub(super) fn welcome(&mut self) {
        self.caller.board.welcome.send_replace(Some(Arc::new(self.greeting())));
        self.is_new = true;
    }

    /// Updates the welcome for a page that has just connected. The other pages are already up to date.
    pub(super) fn freshen_welcome(&self) {
        let greeting = Some(Arc::new(self.greeting()));
        self.caller.board.welcome.send_if_modified(|welcome| {
            *welcome = greeting;
            false
        });
    }

    fn greeting(&self) -> Welcome {
        let memory = self.machine.memory();
        let drawing = memory.sketch.as_ref().map(|sketch| match sketch.kind {
            SketchType::Strokes => String::from_utf8_lossy(&sketch.bytes).into_owned(),
            _ => json!({ "canvas": sketch.canvas, "image": "/api/drawing" }).to_string(),
        });
        let hello = Hello {
            session: String::new(),
            drives: false,
            mode: if self.run.pad.draws() { "draws" } else { "watches" },
            canvas: self.canvas(),
            mission: self.run.mission.name.clone(),
            robot_radius_m: self.run.robot.radius_m,
            limits: Limits::new(self.sessions.limit_s()),
            placing: self.drawn.map(|drawn| (drawn.placing)(&self.run.mission)),
            drawing,
            path: memory.path.as_ref().map(|path| path.body.clone()),
            walls: self.walls,
            learned: self.lessons.view(),
            trail: self.trail.points(),
            study: self.study.as_ref().map(Sitting::view),
        };
        Welcome { hello, driver: self.sessions.driver().map(str::to_owned) }
    }

    /// Puts a new feed on the board if one is due.
    pub(super) fn feed(&mut self) {
        let now = self.began.elapsed();
        let since = now.saturating_sub(self.fed);
        if since < FEED_EVERY || !(self.is_new || since > FEED_AT_LEAST) {
            return;
        }
        (self.fed, self.is_new) = (now, false);
        let unattended = self.sessions.is_unattended(now);
        let feed = self.look_at(now);
        let body = serde_json::to_string(&feed).unwrap_or_default();
        let body = body.strip_prefix('{').and_then(|body| body.strip_suffix('}'));
        let picture = Picture {
            body: body.unwrap_or_default().to_owned(),
            driver: self.sessions.driver().map(str::to_owned),
            wheel: unattended || self.sessions.driver().is_none(),
            pleas: self.sessions.open_pleas().cloned().collect(),
            driver_may: self.allowed(true, now),
            watcher_may: self.allowed(false, now),
        };
        self.caller.board.picture.send_replace(Arc::new(picture));
    }

    fn look_at(&mut self, now: Duration) -> Feed {
        self.services.settle(self.stamp_ns);
        // Until a path has placed the robot in a new sketch, all information refers to the previous one.
        let is_placed = !self.run.pad.draws() || self.machine.memory().path.is_some();
        let view = self.view().filter(|_| is_placed);
        let view = view.as_ref();
        let shown = view.map_or_else(Shown::default, |_| self.watch.draw());
        let pose = view.and_then(|view| self.pose(&shown, view));
        let question = self.watch.question().filter(|_| self.machine.asks());
        let status = self.machine.status().filter(|_| is_placed);
        let tracking = shown.robot.map(|robot| robot.tracking);
        let silence = self.sessions.silence(now).filter(|_| self.sessions.is_unattended(now));
        let on_canvas = |shapes| view.map(|view| view.shapes(shapes)).unwrap_or_default();
        Feed {
            t_ms: self.stamp_ns / 1_000_000,
            state: self.machine.state(),
            ready: self.machine.is_ready(now),
            driver: self.sessions.driver().is_some() && silence.is_none(),
            walls: self.walls,
            learned: self.lessons.view(),
            resolved: self.resolved.clone(),
            task: status.and_then(TaskView::new),
            speed_mps: status.map_or(0.0, |status| (status.speed_mps * 100.0).round() / 100.0),
            particles: view.zip(shown.particles).map(|(view, places)| view.points(places)),
            scene: on_canvas(shown.shapes),
            lasting: shown.lasting.map(on_canvas),
            words: shown.words,
            question: view.zip(question).map(|(view, places)| QuestionView::new(&places, view)),
            trail: self.trail.last(),
            warnings: feed::warnings(status, tracking, &self.ends, &self.services, silence),
            services: self.services.views(),
            pose,
        }
    }

    /// The robot's position on the canvas. In a drawing, it leaves a trail.
    fn pose(&mut self, shown: &Shown, view: &View) -> Option<PoseView> {
        match view {
            View::Robot { .. } => Some(PoseView::in_the_middle(&self.run.robot, view)),
            View::Drawing { .. } | View::Learned(_) => {
                let pose = PoseView::new(shown.robot.as_ref()?, view);
                self.trail.go_to([pose.x, pose.y]);
                Some(pose)
            }
        }
    }
}
