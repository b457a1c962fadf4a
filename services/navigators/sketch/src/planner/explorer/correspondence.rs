//! What the explorer displays to people who watch the run.

use sketchnav_mapping::alignment::Partner;
use sketchnav_mapping::outline::Place;
use sketchnav_schemas::message::PoseM;

use super::course::Likely;
use super::{Aim, Explorer};
use crate::messages::{Correspondence, CourseAim, OutlineSample, PartnerKind};

impl Explorer {
    /// Returns true if there is something new to send, which then counts as sent.
    pub fn has_news(&mut self) -> bool {
        std::mem::take(&mut self.exploration.is_news)
    }

    /// Writes the correspondence between drawing and map, except for the header and the odometry.
    pub fn write(&self, out: &mut Correspondence) {
        out.robot = PoseM::new(&self.robot());
        out.rival_margin = self.exploration.rival.map_or(-1.0, |rival| rival.margin);
        out.rival_m = self.exploration.rival.map_or([0.0; 2], |rival| rival.place);
        if let Some(course) = &self.exploration.course {
            (out.aim, out.target_m) = (code(course.aim).code(), course.target);
        }
        self.write_samples(out);
        if let Some(field) = &self.field {
            let robot = self.robot();
            let mut way = Vec::new();
            field.descend([robot.x, robot.y], &mut way);
            let count = way.len().min(out.way_m.len());
            for (k, slot) in out.way_m[..count].iter_mut().enumerate() {
                let at = way[k * (way.len() - 1) / count.saturating_sub(1).max(1)];
                *slot = [at.x as f32, at.y as f32];
            }
            out.way_count = count as u32;
        }
    }

    fn write_samples(&self, out: &mut Correspondence) {
        let (Some(paper), Some((seen, alignment))) = (&self.paper, &self.exploration.last) else { return };
        let likely = Likely::new(&self.shares, seen, alignment);
        out.goal_m = likely.place.unwrap_or_default();
        (out.seen_share, out.hidden_share, out.cost) = (likely.seen, likely.hidden, alignment.cost);
        out.gap_count = seen.gaps.len() as u32;
        let middle = |gap: u16| -> Place {
            let points = &seen.gaps[usize::from(gap)];
            points[points.len() / 2]
        };
        let samples = paper.outline.places.iter().zip(&alignment.partners).zip(&self.shares);
        for (slot, ((drawn, partner), share)) in out.samples.iter_mut().zip(samples) {
            let (kind, place) = match *partner {
                Partner::Nothing => (PartnerKind::Nothing, [0.0; 2]),
                Partner::Wall(place) => (PartnerKind::Wall, place),
                Partner::Gap(gap) => (PartnerKind::Gap, middle(gap)),
            };
            *slot = OutlineSample {
                x_px: drawn[0] as f32,
                y_px: drawn[1] as f32,
                x_m: place[0] as f32,
                y_m: place[1] as f32,
                partner: kind.code(),
                goal_share: *share as f32,
            };
        }
        out.sample_count = alignment.partners.len().min(out.samples.len()) as u32;
    }
}

fn code(aim: Aim) -> CourseAim {
    match aim {
        Aim::Goal => CourseAim::Goal,
        Aim::Gap => CourseAim::Gap,
        Aim::Rival => CourseAim::Rival,
    }
}
