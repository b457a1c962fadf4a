//! How the filter finds out where the robot is if nobody has marked it.
//!
//! In a learned map, a [search](super::search) over the whole map finds the robot. In a drawing, whose scales are only roughly
//! known, it would have to search for the scales as well. There, the particles are scattered over the whole drawing (global
//! localization, Dellaert, Fox, Burgard and Thrun 1999), many more of them than it takes to follow a robot. Each scan counts for
//! less in the meantime, because a drawing fits the wrong room better than the right one for metres, and particles that have been
//! given up do not come back. Once nearly all of the weight has been in one place for some metres, the robot counts as placed, unless
//! [another place](super::half_turn) looks the same.
//! Whenever the scans fit nowhere near the mode, before or after that, all particles are scattered again.

use rand::RngExt;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::geometry::{Odom, Pose, wrap_angle};
use sketchnav_schemas::message::LaserScan;

use super::confidence::Confidence;
use super::half_turn::ODDS_AGAINST_TWIN;
use super::motion::Terrain;
use super::parameters::Parameters;
use super::scales::ScaledPose;
use super::search::{self, Hypothesis};
use super::start::Start;
use super::{Estimate, Filter, State, Weigher};

/// Standard deviation of the position that the search over the whole map finds, in metres.
const FOUND_WITHIN_M: f32 = 0.1;

/// What is known about where the robot is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) enum Placing {
    /// A person has marked the robot, or the search in a learned map finds it.
    Marked,
    /// The robot may be anywhere in the drawing.
    Anywhere(Agreement),
    /// The particles have found the robot.
    Found,
}

/// How long the particles have agreed on one place.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Agreement {
    /// Distance driven since then, in metres.
    over_m: f32,
    /// Log odds of this place against the one that looks the same after half a turn. Infinite if there is none.
    ln_odds: f32,
}

impl Placing {
    /// Returns what a start says about where the robot is in a drawing of this size.
    pub fn of(start: &Start, size_px: [usize; 2], p: &Parameters) -> Self {
        if start.is_anywhere(size_px) && !p.searches {
            Self::Anywhere(Agreement::default())
        } else {
            Self::Marked
        }
    }

    /// Returns the maximum number of particles from now on, unless somebody carries the robot.
    pub fn most_particles(self, p: &Parameters) -> usize {
        if self == Self::Marked { p.particles } else { p.anywhere_particles.max(p.particles) }
    }

    /// Returns the number of particles for which memory is needed, because somebody may carry the robot at any time.
    pub fn room(p: &Parameters) -> usize {
        Self::Found.most_particles(p)
    }

    /// Returns the effective number of independent beams of a scan.
    pub fn independent_beams(self, p: &Parameters) -> f32 {
        if let Self::Anywhere(_) = self { p.anywhere_independent_beams } else { p.independent_beams }
    }
}

impl Filter {
    /// Returns true if the robot may be anywhere in the drawing.
    pub fn is_unplaced(&self) -> bool {
        matches!(self.state.placing, Placing::Anywhere(_))
    }

    /// Places a robot that may be anywhere once the particles have agreed on its place for long enough. `share` is the share of the
    /// weight near the mode, `last` the mode of the last update, moved to where the robot is now, and `moved_m` the distance since, in
    /// metres.
    pub(super) fn place_if_agreed(&mut self, share: f64, last: Option<ScaledPose>, moved_m: f32) {
        let Placing::Anywhere(before) = self.state.placing else { return };
        let agrees =
            share >= self.parameters.placed_share && self.state.confidence.tracking() != Tracking::Lost;
        let agreement = match agrees {
            true => Agreement {
                over_m: before.over_m + moved_m,
                ln_odds: self.ln_odds_against_twin(before.ln_odds, last),
            },
            false => Agreement::default(),
        };
        self.state.placing = Placing::Anywhere(agreement);
        let p = &self.parameters;
        if agreement.over_m < p.placed_after_m || agreement.ln_odds < ODDS_AGAINST_TWIN.ln() {
            return;
        }
        self.state.placing = Placing::Found;
        let State { particles, rng, proportions, mode, .. } = &mut self.state;
        self.resampler.resample_to(particles, p.particles, rng.random());
        proportions.mean_ln_scales = self.start.mean_ln_scales(mode, self.scale_guess_pxpm, p);
        self.weigher.suit(&self.grid, p, proportions);
    }

    /// Returns the start, turned by as much as the robot has turned since, for a robot that may be anywhere, but whose heading at the
    /// start is known. `yaw_rad` is its present yaw by the odometry, in radians.
    pub(super) fn start_at(&self, yaw_rad: f64) -> Start {
        if self.state.is_kidnapped {
            return Start::anywhere(self.start.pose, self.size_px);
        }
        if !self.is_unplaced() || self.start.has_any_heading() {
            return self.start;
        }
        let pose = self.start.pose;
        let yaw_rad = wrap_angle(pose.yaw_rad + yaw_rad - self.state.started_yaw_rad);
        Start { pose: Pose::new(pose.x, pose.y, yaw_rad), ..self.start }
    }

    /// Scatters some particles of a robot that may be anywhere over the whole drawing again, because those near its true place may
    /// have been given up (Lenser and Veloso 2000).
    pub(super) fn scatter_some(&mut self) {
        let start = self.start_at(self.state.odometry[2]);
        let (p, State { particles, rng, proportions, .. }) = (&self.parameters, &mut self.state);
        let terrain = Terrain { grid: &self.grid, frame: &self.frame, proportions: *proportions };
        // Resampling sorts particles by their ancestors, so that taking them at equal intervals is a fair choice.
        let (all, count) = (particles.len(), (p.fresh_share * particles.len() as f32) as usize);
        let fresh = (0..count).map(|k| k * all / count);
        start.scatter(particles, fresh, proportions.mean_ln_scales, &terrain, p, rng);
    }

    /// Scatters all particles again if the robot is lost and nobody has marked it.
    pub(super) fn scatter_if_lost(&mut self, odometry: &Pose<Odom>) {
        let State { placing, confidence, .. } = &self.state;
        if *placing != Placing::Marked && confidence.tracking() == Tracking::Lost {
            self.scatter_all(odometry);
        }
    }

    fn scatter_all(&mut self, odometry: &Pose<Odom>) {
        (self.state.placing, self.state.confidence) =
            (Placing::Anywhere(Agreement::default()), Confidence::default());
        match self.state.is_kidnapped {
            // The scales that were found before are still those of the drawing.
            true => self.begin_anew_at(&self.start_at(odometry.yaw_rad), odometry),
            false => self.begin(odometry),
        }
    }

    /// Scatters the particles over the whole drawing, or starts the search over the whole map, because somebody has carried the robot.
    /// A person's report of where it is counts for more.
    pub fn begin_elsewhere(&mut self, odometry: &Pose<Odom>) {
        if !self.state.started || self.state.told.is_some() {
            return;
        }
        if let Some(found) = &mut self.state.search {
            found.begin_anew();
            return;
        }
        self.state.is_kidnapped = true;
        self.scatter_all(odometry);
    }

    /// Takes a step of the search over the whole map, if there is one. Returns true if the robot is certain of its place.
    pub(super) fn search(&mut self, odometry: &Pose<Odom>, scan: &LaserScan) -> bool {
        let mode = self.dead_reckoned(self.state.mode);
        let known = Hypothesis::new([mode.x_px, mode.y_px, mode.yaw_rad]);
        let Self { search, state, weigher, workers, .. } = self;
        let (Some(search), Some(found), Weigher::Beam(table)) = (search, &mut state.search, &*weigher) else {
            return true;
        };
        let is_tracking = found.is_certain();
        if is_tracking && state.confidence.tracking() == Tracking::Lost {
            found.doubt();
        }
        search.step(found, odometry, scan, &known, table, workers);
        if !found.is_certain() {
            self.show_hypotheses();
            return false;
        }
        let prevails = found.prevails();
        let is_found =
            |best: &Hypothesis| !is_tracking || prevails && best.is_elsewhere(&known, self.scale_guess_pxpm);
        if let Some(best) = found.hypotheses().first().copied().filter(is_found) {
            self.begin_at(&best, odometry);
        }
        true
    }

    /// Starts the filter where the search has found the robot.
    fn begin_at(&mut self, found: &Hypothesis, odometry: &Pose<Odom>) {
        let p = &self.parameters;
        let start = Start {
            pose: Pose::new(found.x_px.into(), found.y_px.into(), found.yaw_rad.into()),
            spread_px: f64::from(FOUND_WITHIN_M * self.scale_guess_pxpm),
            spread_rad: p.start_spread_rad.into(),
        };
        self.begin_anew_at(&start, odometry);
    }

    /// Makes a particle of each hypothesis of the search.
    fn show_hypotheses(&mut self) {
        let State { particles, search: Some(found), proportions, .. } = &mut self.state else { return };
        particles.make_anew(found.hypotheses().len().max(1));
        for (i, (hypothesis, share)) in found.hypotheses().iter().zip(found.shares()).enumerate() {
            (particles.x_px[i], particles.y_px[i]) = (hypothesis.x_px, hypothesis.y_px);
            (particles.yaw_rad[i], particles.weight[i]) = (hypothesis.yaw_rad, share);
            [particles.ln_a[i], particles.ln_b[i]] = proportions.mean_ln_scales;
            particles.anisotropy[i] = 0.0;
        }
    }

    /// Returns the best hypothesis of the search as an estimate that is as uncertain as the map is large.
    pub(super) fn guess(&self) -> Estimate {
        let found = self.state.search.as_ref();
        let best = found.and_then(|found| found.hypotheses().first());
        let pose = best.map_or(self.start.pose, |best| {
            Pose::new(best.x_px.into(), best.y_px.into(), wrap_angle(best.yaw_rad.into()))
        });
        let has_doubted = found.is_some_and(search::State::has_doubted);
        let [width, height] = self.size_px.map(|side| side as f64);
        let mut covariance = [0.0; 25];
        (covariance[0], covariance[6]) = (width * width + height * height, width * width + height * height);
        covariance[12] = std::f64::consts::PI.powi(2);
        let scale_pxpm = f64::from(self.scale_guess_pxpm);
        Estimate {
            pose,
            scale_a_pxpm: scale_pxpm,
            scale_b_pxpm: scale_pxpm,
            covariance,
            effective_sample_size: self.state.particles.effective_sample_size(),
            fit: best.map_or(if found.is_some() { f32::MIN } else { 0.0 }, |best| best.fit).into(),
            tracking: match has_doubted || found.is_none() && !self.is_ambiguous() {
                true => Tracking::Lost,
                // Several places fit.
                false => Tracking::Doubtful,
            },
        }
    }
}
