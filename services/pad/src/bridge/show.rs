//! What the bridge puts on the board for the pages: who they are and what there is, the walls, the feed. It looks at
//! what the bridge knows and changes nothing of it but what is about the pictures themselves.

use std::sync::Arc;
use std::time::Duration;

use serde_json::json;
use sketchnav_schemas::bounds::ANGLE_DEG;
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::message::Here;

use super::Bridge;
use crate::board::{Call, Image, Picture, Welcome, put_image};
use crate::feed::scene::{Around, SIDE_PX, Shape};
use crate::feed::{self, Feed, OutlineView, PlanView, PoseView, QuestionView, TaskView, View};
use crate::protocol::{Hello, HereBody, Limits, Refusal, SketchType};
use crate::walls;

/// Feeds are at least so long apart.
const FEED_EVERY: Duration = Duration::from_millis(90);
/// And at most, so that pages see that nothing comes from the navigation.
const FEED_AT_LEAST: Duration = Duration::from_millis(500);
/// The canvas of Boniardi et al. 2016, IV.
const CANVAS: [u32; 2] = [2540, 1252];

impl Bridge<'_> {
    /// Has the walls of the drawing that holds painted, in a thread of its own, where they are not yet.
    pub(super) fn paint(&mut self) {
        let memory = self.machine.memory();
        let Some(sketch) = memory.sketch.as_ref().filter(|_| memory.path.is_none() || self.painting == 0)
        else {
            return;
        };
        let photo = (sketch.kind != SketchType::Strokes)
            .then(|| Image { kind: sketch.kind, bytes: sketch.bytes.clone().into() });
        put_image(&self.caller.board.photo, photo);
        self.painting += 1;
        let (number, run, bytes) = (self.painting, self.run.clone(), sketch.bytes.clone());
        let caller = self.caller.clone();
        std::thread::spawn(move || {
            if let Some(picture) = walls::of_drawing(&run, &bytes) {
                // Where the pad is ending nobody wants to see them.
                let _ = caller.call(Call::Walls(number, picture));
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
            None if !self.lookouts.is_empty() => [SIDE_PX; 2],
            None => self.inbox.size_px.unwrap_or(CANVAS),
        }
    }

    fn view(&self) -> Option<View> {
        match &self.machine.memory().sketch {
            Some(sketch) => Some(View { height_px: sketch.size_px[1].into(), scale: sketch.scale }),
            None => self.inbox.size_px.map(|[_, height]| View { height_px: height.into(), scale: 1.0 }),
        }
    }

    /// A place that a page tells, in the sketch.
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
        let view = self.view().ok_or_else(|| Refusal::NotNow("expected a drawing, found none".into()))?;
        Ok(Here { at: view.place(at), yaw_rad: heading_deg.map(f64::to_radians) })
    }

    /// Sends all pages again who they are and what there is.
    pub(super) fn welcome(&mut self) {
        self.caller.board.welcome.send_replace(Some(Arc::new(self.greeting())));
        self.is_new = true;
    }

    /// For a page that has just come; the others know all of it.
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
            drawing,
            path: memory.path.as_ref().map(|path| path.body.clone()),
            walls: self.walls,
            trail: self.trail.points(),
        };
        Welcome { hello, driver: self.sessions.driver().map(str::to_owned) }
    }

    /// Shows the pages what there is, where it is time.
    pub(super) fn feed(&mut self) {
        let now = self.began.elapsed();
        let since = now.saturating_sub(self.fed);
        if since < FEED_EVERY || !(self.is_new || since > FEED_AT_LEAST) {
            return;
        }
        (self.fed, self.is_new) = (now, false);
        let unattended = self.sessions.is_unattended(now);
        let feed = self.look(now);
        let body = serde_json::to_string(&feed).unwrap_or_default();
        let body = body.strip_prefix('{').and_then(|body| body.strip_suffix('}'));
        let picture = Picture {
            body: body.unwrap_or_default().to_owned(),
            driver: self.sessions.driver().map(str::to_owned),
            wheel: unattended || self.sessions.driver().is_none(),
            driver_may: self.machine.allowed(true, now),
            watcher_may: self.machine.allowed(false, now),
        };
        self.caller.board.picture.send_replace(Arc::new(picture));
    }

    fn look(&mut self, now: Duration) -> Feed {
        self.services.settle(self.stamp_ns);
        let (view, robot) = (self.view(), &self.run.robot);
        // Before a path has placed the robot in a new sketch, all that is known is about the one before.
        let is_placed = !self.run.pad.draws() || self.machine.memory().path.is_some();
        let estimate = self.inbox.estimate.as_deref().filter(|_| is_placed);
        let pose = view.zip(estimate).and_then(|(view, e)| PoseView::new(e, robot, &view));
        let landmarks = self.inbox.canvas.as_ref().zip(self.inbox.view.as_deref());
        let pose = pose.or_else(|| landmarks.and_then(|(canvas, view)| canvas.pose(view, robot)));
        let progress = self.inbox.progress.as_deref();
        if let Some(pose) = &pose {
            self.trail.go_to([pose.x, pose.y]);
        }
        let located = view.filter(|_| pose.is_some());
        let status = self.machine.status().filter(|_| is_placed);
        let tracking = estimate.and_then(|e| Tracking::from_code(e.tracking));
        let tracking = tracking.or(landmarks.map(|(canvas, view)| canvas.tracking(view)));
        let tracking = tracking.filter(|_| pose.is_some());
        let around = (!self.lookouts.is_empty()).then(|| Around::robot(robot));
        let silence = self.sessions.silence(now).filter(|_| self.sessions.is_unattended(now));
        let scan = located.zip(estimate).zip(self.inbox.scan.as_deref());
        Feed {
            t_ms: self.stamp_ns / 1_000_000,
            state: self.machine.state(),
            ready: self.machine.is_ready(now),
            driver: self.sessions.driver().is_some() && silence.is_none(),
            walls: self.walls,
            task: status.and_then(TaskView::new),
            speed_mps: status.map_or(0.0, |status| (status.speed_mps * 100.0).round() / 100.0),
            particles: located.zip(self.inbox.particles.take()).map(|(view, p)| feed::particles(&p, &view)),
            scan: match (scan, landmarks) {
                (Some(((view, estimate), scan)), _) => {
                    feed::scan(scan, estimate, self.inbox.wall_direction_rad, robot, &view)
                }
                (None, Some((canvas, view))) => canvas.places(view),
                (None, None) => Vec::new(),
            },
            plan: match (located.zip(self.inbox.plan.as_deref()), landmarks.zip(progress)) {
                (Some((view, plan)), _) => Some(PlanView::new(plan, &view)),
                (None, Some(((canvas, _), progress))) => canvas.plan(progress),
                (None, None) => None,
            },
            landmarks: landmarks.zip(progress).map(|((canvas, view), said)| canvas.feed(view, said, robot)),
            scene: around.as_ref().map(|around| self.scene(around)),
            outline: located
                .zip(self.inbox.correspondence.take())
                .map(|(view, found)| OutlineView::new(&found, &view)),
            question: located
                .zip(self.inbox.question.as_deref())
                .filter(|_| self.machine.asks())
                .map(|(view, question)| QuestionView::new(question, &view)),
            trail: self.trail.last(),
            warnings: feed::warnings(status, tracking, &self.ends, &self.services, silence),
            services: self.services.views(),
            pose: around.map(|around| around.pose(robot)).or(pose),
        }
    }

    fn scene(&self, around: &Around) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for lookout in &self.lookouts {
            lookout.draw(around, &self.run.robot, &mut shapes);
        }
        shapes
    }
}
