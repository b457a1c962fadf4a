//! Each message into its form and back. No computation: every number keeps its bits.

use bytemuck::Zeroable;
use ros2_interfaces_jazzy_serde::{
    builtin_interfaces::msg::Time,
    geometry_msgs::msg::{Pose, PoseWithCovariance, Twist as TwistForm, TwistWithCovariance},
    nav_msgs::msg::{MapMetaData, OccupancyGrid, Odometry as OdometryForm},
    sensor_msgs::msg::LaserScan as LaserScanForm,
    std_msgs::msg::Header as HeaderForm,
};

use super::{parts::*, *};
use crate::message::{
    Contact, Drawing, Fault, GroundTruth, Header, Health, LaserScan, Latency, MissionCommand, MissionStatus,
    Odometry, Particle, Particles, Plan, PoseEstimate, Recorded, Route, RouteTask, SketchMap, SonarScan,
    Text, Understood, VelocityCommand,
};

/// A message and no slice behind it.
type Read<T> = Result<(T, Vec<u8>), Ros2Error>;

fn alone<T>(message: T) -> Read<T> {
    Ok((message, Vec::new()))
}

impl Ros2 for LaserScan {
    type Form = LaserScanForm;
    const TYPE: &'static str = "sensor_msgs/msg/LaserScan";

    fn to_ros2_in(&self, cells: &[u8], spare: LaserScanForm) -> Result<LaserScanForm, Ros2Error> {
        no_cells(cells)?;
        Ok(LaserScanForm {
            header: reading_form(&self.header, "laser", spare.header)?,
            angle_min: self.angle_min_rad,
            angle_max: self.angle_max_rad,
            angle_increment: self.angle_increment_rad,
            time_increment: self.time_increment_s,
            scan_time: self.scan_time_s,
            range_min: self.range_min_m,
            range_max: self.range_max_m,
            ranges: list("ranges_m", &self.ranges_m, self.beam_count, spare.ranges, |range, _| Ok(*range))?,
            intensities: Vec::new(),
        })
    }

    fn from_ros2(form: LaserScanForm, seq: u64) -> Read<Self> {
        let mut scan = Self {
            header: header(&form.header, seq, seq)?,
            angle_min_rad: form.angle_min,
            angle_max_rad: form.angle_max,
            angle_increment_rad: form.angle_increment,
            time_increment_s: form.time_increment,
            scan_time_s: form.scan_time,
            range_min_m: form.range_min,
            range_max_m: form.range_max,
            ..Self::zeroed()
        };
        scan.beam_count = fill("ranges_m", &mut scan.ranges_m, &form.ranges, |range| Ok(*range))?;
        alone(scan)
    }
}

fn odometry_form(header: HeaderForm, child_frame_id: String, pose: Pose, twist: TwistForm) -> OdometryForm {
    OdometryForm {
        header,
        child_frame_id,
        pose: PoseWithCovariance { pose, covariance: [0.0; 36] },
        twist: TwistWithCovariance { twist, covariance: [0.0; 36] },
    }
}

macro_rules! odometry {
    ($message:ident, $frame:literal) => {
        impl Ros2 for $message {
            type Form = OdometryForm;
            const TYPE: &'static str = "nav_msgs/msg/Odometry";

            fn to_ros2_in(&self, cells: &[u8], spare: OdometryForm) -> Result<OdometryForm, Ros2Error> {
                no_cells(cells)?;
                let header = reading_form(&self.header, $frame, spare.header)?;
                let child = string("base_link", spare.child_frame_id);
                Ok(odometry_form(header, child, pose_m_form(&self.pose), twist_form(&self.twist)))
            }

            fn from_ros2(form: OdometryForm, seq: u64) -> Read<Self> {
                let header = header(&form.header, seq, seq)?;
                alone(Self { header, pose: pose_m(&form.pose.pose), twist: twist(&form.twist.twist) })
            }
        }
    };
}

odometry!(Odometry, "odom");
odometry!(GroundTruth, "world");

impl Ros2 for Contact {
    type Form = ContactForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Contact";

    fn to_ros2_in(&self, cells: &[u8], spare: ContactForm) -> Result<ContactForm, Ros2Error> {
        no_cells(cells)?;
        Ok(ContactForm {
            header: header_form(&self.header, "world", spare.header)?,
            source_seq: self.header.source_seq,
            position: point(self.x_m, self.y_m),
            impulse_ns: self.impulse_ns,
            body_kind: self.body_kind,
            begins: self.begins,
        })
    }

    fn from_ros2(form: ContactForm, seq: u64) -> Read<Self> {
        alone(Self {
            header: header(&form.header, seq, form.source_seq)?,
            x_m: form.position.x,
            y_m: form.position.y,
            impulse_ns: form.impulse_ns,
            body_kind: form.body_kind,
            begins: form.begins,
        })
    }
}

impl SketchMap {
    fn grid(&self, cells: &[u8], spare: OccupancyGrid) -> Result<OccupancyGrid, Ros2Error> {
        let size = u64::from(self.width_px) * u64::from(self.height_px);
        let count = cells.len() as u64;
        expect(size == count, "cells", "width_px × height_px cells behind the message", count)?;
        let info = MapMetaData {
            map_load_time: Time { sec: 0, nanosec: 0 },
            resolution: 1.0,
            width: self.width_px,
            height: self.height_px,
            origin: pose(0.0, 0.0, 0.0, 1.0),
        };
        let header = header_form(&self.header, "sketch", spare.header)?;
        let mut data = spare.data;
        data.clear();
        data.extend_from_slice(bytemuck::cast_slice(cells));
        Ok(OccupancyGrid { header, info, data })
    }
}

impl Ros2 for SketchMap {
    type Form = SketchMapForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/SketchMap";

    fn to_ros2_in(&self, cells: &[u8], spare: SketchMapForm) -> Result<SketchMapForm, Ros2Error> {
        Ok(SketchMapForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            grid: self.grid(cells, spare.grid)?,
            source_seq: self.header.source_seq,
            wall_direction_rad: self.wall_direction_rad,
            pen_width_px: self.pen_width_px,
            start: pose_px_form(&self.start),
            start_spread_px: self.start_spread_px,
            start_spread_rad: self.start_spread_rad,
        })
    }

    fn from_ros2(form: SketchMapForm, seq: u64) -> Read<Self> {
        let sketch = Self {
            header: header(&form.header, seq, form.source_seq)?,
            width_px: form.grid.info.width,
            height_px: form.grid.info.height,
            wall_direction_rad: form.wall_direction_rad,
            pen_width_px: form.pen_width_px,
            start: pose_px(&form.start),
            start_spread_px: form.start_spread_px,
            start_spread_rad: form.start_spread_rad,
        };
        Ok((sketch, bytemuck::cast_slice(&form.grid.data).to_vec()))
    }
}

fn task_form(task: &RouteTask, spare: RouteTaskForm) -> Result<RouteTaskForm, Ros2Error> {
    Ok(RouteTaskForm {
        name: text_form("tasks.name", &task.name, spare.name)?,
        first_point: task.first_point,
        point_count: task.point_count,
        time_limit_s: task.time_limit_s,
    })
}

fn task(form: &RouteTaskForm) -> Result<RouteTask, Ros2Error> {
    Ok(RouteTask {
        name: Text::new(&form.name),
        first_point: form.first_point,
        point_count: form.point_count,
        time_limit_s: form.time_limit_s,
    })
}

impl Ros2 for Route {
    type Form = RouteForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Route";

    fn to_ros2_in(&self, cells: &[u8], spare: RouteForm) -> Result<RouteForm, Ros2Error> {
        no_cells(cells)?;
        let point_form = |p: &[f64; 2], _| Ok(point(p[0], p[1]));
        Ok(RouteForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            source_seq: self.header.source_seq,
            tasks: list("tasks", &self.tasks, self.task_count, spare.tasks, task_form)?,
            points_px: list("points_px", &self.points_px, self.point_count, spare.points_px, point_form)?,
        })
    }

    fn from_ros2(form: RouteForm, seq: u64) -> Read<Self> {
        let mut route = Self::zeroed();
        route.header = header(&form.header, seq, form.source_seq)?;
        route.task_count = fill("tasks", &mut route.tasks, &form.tasks, task)?;
        let points = &form.points_px;
        route.point_count = fill("points_px", &mut route.points_px, points, |p| Ok([p.x, p.y]))?;
        alone(route)
    }
}

impl Ros2 for PoseEstimate {
    type Form = PoseEstimateForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/PoseEstimate";

    fn to_ros2_in(&self, cells: &[u8], spare: PoseEstimateForm) -> Result<PoseEstimateForm, Ros2Error> {
        no_cells(cells)?;
        Ok(PoseEstimateForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            source_seq: self.header.source_seq,
            pose: pose_px_form(&self.pose),
            scale_a_pxpm: self.scale_a_pxpm,
            scale_b_pxpm: self.scale_b_pxpm,
            covariance: self.covariance,
            effective_sample_size: self.effective_sample_size,
            fit: self.fit,
            odometry: pose_m_form(&self.odometry),
            particle_count: self.particle_count,
            tracking: self.tracking,
        })
    }

    fn from_ros2(form: PoseEstimateForm, seq: u64) -> Read<Self> {
        alone(Self {
            header: header(&form.header, seq, form.source_seq)?,
            pose: pose_px(&form.pose),
            scale_a_pxpm: form.scale_a_pxpm,
            scale_b_pxpm: form.scale_b_pxpm,
            covariance: form.covariance,
            effective_sample_size: form.effective_sample_size,
            fit: form.fit,
            odometry: pose_m(&form.odometry),
            particle_count: form.particle_count,
            tracking: form.tracking,
        })
    }
}

fn particle_form(p: &Particle, _: ParticleForm) -> Result<ParticleForm, Ros2Error> {
    let Particle { x_px, y_px, yaw_rad, scale_a_pxpm, scale_b_pxpm, weight } = *p;
    Ok(ParticleForm { x_px, y_px, yaw_rad, scale_a_pxpm, scale_b_pxpm, weight })
}

fn particle(form: &ParticleForm) -> Result<Particle, Ros2Error> {
    let ParticleForm { x_px, y_px, yaw_rad, scale_a_pxpm, scale_b_pxpm, weight } = *form;
    Ok(Particle { x_px, y_px, yaw_rad, scale_a_pxpm, scale_b_pxpm, weight })
}

impl Ros2 for Particles {
    type Form = ParticlesForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Particles";

    fn to_ros2_in(&self, cells: &[u8], spare: ParticlesForm) -> Result<ParticlesForm, Ros2Error> {
        no_cells(cells)?;
        Ok(ParticlesForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            source_seq: self.header.source_seq,
            total: self.total,
            particles: list("particles", &self.particles, self.count, spare.particles, particle_form)?,
        })
    }

    fn from_ros2(form: ParticlesForm, seq: u64) -> Read<Self> {
        let mut message = Self { total: form.total, ..Self::zeroed() };
        message.header = header(&form.header, seq, form.source_seq)?;
        message.count = fill("particles", &mut message.particles, &form.particles, particle)?;
        alone(message)
    }
}

impl Ros2 for Plan {
    type Form = PlanForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Plan";

    fn to_ros2_in(&self, cells: &[u8], spare: PlanForm) -> Result<PlanForm, Ros2Error> {
        no_cells(cells)?;
        let point_form = |p: &[f32; 2], _| Ok(point32(p));
        Ok(PlanForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            source_seq: self.header.source_seq,
            task: self.task,
            follows_route: self.follows_route,
            target_px: point(self.target_px[0], self.target_px[1]),
            global_px: list("global_px", &self.global_px, self.global_count, spare.global_px, point_form)?,
            local_px: list("local_px", &self.local_px, self.local_count, spare.local_px, point_form)?,
        })
    }

    fn from_ros2(form: PlanForm, seq: u64) -> Read<Self> {
        let mut plan = Self {
            header: header(&form.header, seq, form.source_seq)?,
            task: form.task,
            follows_route: form.follows_route,
            target_px: [form.target_px.x, form.target_px.y],
            ..Self::zeroed()
        };
        plan.global_count = fill("global_px", &mut plan.global_px, &form.global_px, |p| Ok([p.x, p.y]))?;
        plan.local_count = fill("local_px", &mut plan.local_px, &form.local_px, |p| Ok([p.x, p.y]))?;
        alone(plan)
    }
}

impl Ros2 for VelocityCommand {
    type Form = VelocityCommandForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/VelocityCommand";

    fn to_ros2_in(&self, cells: &[u8], spare: VelocityCommandForm) -> Result<VelocityCommandForm, Ros2Error> {
        no_cells(cells)?;
        expect(self.reserved == 0, "reserved", "0", self.reserved.into())?;
        Ok(VelocityCommandForm {
            header: header_form(&self.header, "base_link", spare.header)?,
            source_seq: self.header.source_seq,
            twist: twist_form(&self.twist),
            last: self.last,
        })
    }

    fn from_ros2(form: VelocityCommandForm, seq: u64) -> Read<Self> {
        let header = header(&form.header, seq, form.source_seq)?;
        alone(Self { header, twist: twist(&form.twist), last: form.last, reserved: 0 })
    }
}

/// Messages whose fields are all numbers and pass as they are.
macro_rules! plain {
    ($message:ident, $form:ident, $type:literal, [$($field:ident),*]) => {
        impl Ros2 for $message {
            type Form = $form;
            const TYPE: &'static str = $type;

            fn to_ros2_in(&self, cells: &[u8], spare: $form) -> Result<$form, Ros2Error> {
                no_cells(cells)?;
                let header = header_form(&self.header, "", spare.header)?;
                Ok($form { header, source_seq: self.header.source_seq, $($field: self.$field,)* })
            }

            fn from_ros2(form: $form, seq: u64) -> Read<Self> {
                let header: Header = header(&form.header, seq, form.source_seq)?;
                alone(Self { header, $($field: form.$field,)* })
            }
        }
    };
}

plain!(MissionCommand, MissionCommandForm, "sketchnav_msgs/msg/MissionCommand", [order, task]);
plain!(Latency, LatencyForm, "sketchnav_msgs/msg/Latency", [estimate_ns, command_ns]);
plain!(Recorded, RecordedForm, "sketchnav_msgs/msg/Recorded", [message_count]);
plain!(
    Health,
    HealthForm,
    "sketchnav_msgs/msg/Health",
    [process, pid, steps, busy_ns, step_max_ns, step_allocations, lost_messages, refused_messages, uptime_ns]
);

impl Ros2 for MissionStatus {
    type Form = MissionStatusForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/MissionStatus";

    fn to_ros2_in(&self, cells: &[u8], spare: MissionStatusForm) -> Result<MissionStatusForm, Ros2Error> {
        no_cells(cells)?;
        Ok(MissionStatusForm {
            header: header_form(&self.header, "", spare.header)?,
            source_seq: self.header.source_seq,
            task: self.task,
            task_count: self.task_count,
            state: self.state,
            reached_count: self.reached_count,
            task_time_s: self.task_time_s,
            task_path_m: self.task_path_m,
            remaining_m: self.remaining_m,
            speed_mps: self.speed_mps,
            name: text_form("name", &self.name, spare.name)?,
            reason: text_form("reason", &self.reason, spare.reason)?,
        })
    }

    fn from_ros2(form: MissionStatusForm, seq: u64) -> Read<Self> {
        alone(Self {
            header: header(&form.header, seq, form.source_seq)?,
            task: form.task,
            task_count: form.task_count,
            state: form.state,
            reached_count: form.reached_count,
            task_time_s: form.task_time_s,
            task_path_m: form.task_path_m,
            remaining_m: form.remaining_m,
            speed_mps: form.speed_mps,
            name: Text::new(&form.name),
            reason: Text::new(&form.reason),
        })
    }
}

impl Ros2 for Drawing {
    type Form = DrawingForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Drawing";

    fn to_ros2_in(&self, cells: &[u8], spare: DrawingForm) -> Result<DrawingForm, Ros2Error> {
        expect(self.reserved == 0, "reserved", "0", self.reserved.into())?;
        let mut data = spare.data;
        data.clear();
        data.extend_from_slice(cells);
        Ok(DrawingForm {
            header: header_form(&self.header, "", spare.header)?,
            source_seq: self.header.source_seq,
            kind: self.kind,
            data,
        })
    }

    fn from_ros2(form: DrawingForm, seq: u64) -> Read<Self> {
        let header = header(&form.header, seq, form.source_seq)?;
        Ok((Self { header, kind: form.kind, reserved: 0 }, form.data))
    }
}

impl Ros2 for Understood {
    type Form = UnderstoodForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Understood";

    fn to_ros2_in(&self, cells: &[u8], spare: UnderstoodForm) -> Result<UnderstoodForm, Ros2Error> {
        no_cells(cells)?;
        Ok(UnderstoodForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            source_seq: self.header.source_seq,
            kind: self.kind,
            accepted: self.accepted,
            sketch_seq: self.sketch_seq,
            route_seq: self.route_seq,
            sketch_width_px: self.sketch_width_px,
            sketch_height_px: self.sketch_height_px,
            scale: self.scale,
            wall_direction_rad: self.wall_direction_rad,
            words: text_form("words", &self.words, spare.words)?,
        })
    }

    fn from_ros2(form: UnderstoodForm, seq: u64) -> Read<Self> {
        alone(Self {
            header: header(&form.header, seq, form.source_seq)?,
            kind: form.kind,
            accepted: form.accepted,
            sketch_seq: form.sketch_seq,
            route_seq: form.route_seq,
            sketch_width_px: form.sketch_width_px,
            sketch_height_px: form.sketch_height_px,
            scale: form.scale,
            wall_direction_rad: form.wall_direction_rad,
            words: Text::new(&form.words),
        })
    }
}

impl Ros2 for Fault {
    type Form = FaultForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/Fault";

    fn to_ros2_in(&self, cells: &[u8], spare: FaultForm) -> Result<FaultForm, Ros2Error> {
        no_cells(cells)?;
        Ok(FaultForm {
            header: header_form(&self.header, "", spare.header)?,
            source_seq: self.header.source_seq,
            kind: self.kind,
            process: self.process,
            pid: self.pid,
            signal: self.signal,
            exit_code: self.exit_code,
            attempt: self.attempt,
            restarts: self.restarts,
            missing: self.missing,
            duration_ns: self.duration_ns,
            words: text_form("words", &self.words, spare.words)?,
        })
    }

    fn from_ros2(form: FaultForm, seq: u64) -> Read<Self> {
        alone(Self {
            header: header(&form.header, seq, form.source_seq)?,
            kind: form.kind,
            process: form.process,
            pid: form.pid,
            signal: form.signal,
            exit_code: form.exit_code,
            attempt: form.attempt,
            restarts: form.restarts,
            missing: form.missing,
            duration_ns: form.duration_ns,
            words: Text::new(&form.words),
        })
    }
}

impl Ros2 for SonarScan {
    type Form = SonarScanForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/SonarScan";

    fn to_ros2_in(&self, cells: &[u8], spare: SonarScanForm) -> Result<SonarScanForm, Ros2Error> {
        no_cells(cells)?;
        Ok(SonarScanForm {
            header: header_form(&self.header, "base_link", spare.header)?,
            source_seq: self.header.source_seq,
            angle_min_rad: self.angle_min_rad,
            angle_increment_rad: self.angle_increment_rad,
            half_opening_rad: self.half_opening_rad,
            ring_radius_m: self.ring_radius_m,
            scan_time_s: self.scan_time_s,
            range_min_m: self.range_min_m,
            range_max_m: self.range_max_m,
            ranges_m: list("ranges_m", &self.ranges_m, self.sonar_count, spare.ranges_m, |range, _| {
                Ok(*range)
            })?,
        })
    }

    fn from_ros2(form: SonarScanForm, seq: u64) -> Read<Self> {
        let mut scan = Self {
            header: header(&form.header, seq, form.source_seq)?,
            angle_min_rad: form.angle_min_rad,
            angle_increment_rad: form.angle_increment_rad,
            half_opening_rad: form.half_opening_rad,
            ring_radius_m: form.ring_radius_m,
            scan_time_s: form.scan_time_s,
            range_min_m: form.range_min_m,
            range_max_m: form.range_max_m,
            ..Self::zeroed()
        };
        scan.sonar_count = fill("ranges_m", &mut scan.ranges_m, &form.ranges_m, |range| Ok(*range))?;
        alone(scan)
    }
}
