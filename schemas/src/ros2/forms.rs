//! The forms of `sketchnav_msgs`: field for field what the files in `msg/sketchnav_msgs` say.

use ros2_interfaces_jazzy_serde::{
    geometry_msgs::msg::{Point, Point32, Pose, Twist},
    nav_msgs::msg::OccupancyGrid,
    std_msgs::msg::Header,
};
use serde::{Deserialize, Serialize};

macro_rules! forms {
    ($($(#[$meta:meta])* $name:ident { $($field:ident: $type:ty,)* })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        pub struct $name { $(pub(super) $field: $type,)* }
    )*};
}

forms! {
    /// `sketchnav_msgs/msg/Contact`.
    ContactForm {
        header: Header,
        source_seq: u64,
        position: Point,
        impulse_ns: f64,
        body_kind: u32,
        begins: u32,
    }

    /// `sketchnav_msgs/msg/SketchMap`.
    SketchMapForm {
        header: Header,
        source_seq: u64,
        grid: OccupancyGrid,
        wall_direction_rad: f64,
        pen_width_px: f64,
        start: Pose,
        start_spread_px: f64,
        start_spread_rad: f64,
    }

    /// `sketchnav_msgs/msg/Route`.
    RouteForm {
        header: Header,
        source_seq: u64,
        tasks: Vec<RouteTaskForm>,
        points_px: Vec<Point>,
    }

    /// `sketchnav_msgs/msg/RouteTask`.
    RouteTaskForm {
        name: String,
        first_point: u32,
        point_count: u32,
        time_limit_s: f64,
    }

    /// `sketchnav_msgs/msg/PoseEstimate`.
    PoseEstimateForm {
        header: Header,
        source_seq: u64,
        pose: Pose,
        scale_a_pxpm: f64,
        scale_b_pxpm: f64,
        covariance: [f64; 25],
        effective_sample_size: f64,
        fit: f64,
        odometry: Pose,
        particle_count: u32,
        tracking: u32,
    }

    /// `sketchnav_msgs/msg/Particle`.
    ParticleForm {
        x_px: f32,
        y_px: f32,
        yaw_rad: f32,
        scale_a_pxpm: f32,
        scale_b_pxpm: f32,
        weight: f32,
    }

    /// `sketchnav_msgs/msg/Particles`.
    ParticlesForm {
        header: Header,
        source_seq: u64,
        total: u32,
        particles: Vec<ParticleForm>,
    }

    /// `sketchnav_msgs/msg/Plan`.
    PlanForm {
        header: Header,
        source_seq: u64,
        task: u32,
        follows_route: u32,
        target_px: Point,
        global_px: Vec<Point32>,
        local_px: Vec<Point32>,
    }

    /// `sketchnav_msgs/msg/VelocityCommand`.
    VelocityCommandForm {
        header: Header,
        source_seq: u64,
        twist: Twist,
        last: u32,
    }

    /// `sketchnav_msgs/msg/MissionCommand`.
    MissionCommandForm {
        header: Header,
        source_seq: u64,
        order: u32,
        task: u32,
    }

    /// `sketchnav_msgs/msg/MissionStatus`.
    MissionStatusForm {
        header: Header,
        source_seq: u64,
        task: u32,
        task_count: u32,
        state: u32,
        reached_count: u32,
        task_time_s: f64,
        task_path_m: f64,
        remaining_m: f64,
        speed_mps: f64,
        name: String,
        reason: String,
    }

    /// `sketchnav_msgs/msg/Drawing`.
    DrawingForm {
        header: Header,
        source_seq: u64,
        kind: u32,
        data: Vec<u8>,
    }

    /// `sketchnav_msgs/msg/Understood`.
    UnderstoodForm {
        header: Header,
        source_seq: u64,
        kind: u32,
        accepted: u32,
        sketch_seq: u64,
        route_seq: u64,
        sketch_width_px: u32,
        sketch_height_px: u32,
        scale: f64,
        wall_direction_rad: f64,
        words: String,
    }

    /// `sketchnav_msgs/msg/Health`.
    HealthForm {
        header: Header,
        source_seq: u64,
        process: u32,
        pid: u32,
        steps: u64,
        busy_ns: u64,
        step_max_ns: u64,
        step_allocations: u64,
        lost_messages: u64,
        refused_messages: u64,
        uptime_ns: u64,
    }

    /// `sketchnav_msgs/msg/Fault`.
    FaultForm {
        header: Header,
        source_seq: u64,
        kind: u32,
        process: u32,
        pid: u32,
        signal: u32,
        exit_code: u32,
        attempt: u32,
        restarts: u32,
        missing: u32,
        duration_ns: u64,
        words: String,
    }

    /// `sketchnav_msgs/msg/Latency`.
    LatencyForm {
        header: Header,
        source_seq: u64,
        estimate_ns: u64,
        command_ns: u64,
    }

    /// `sketchnav_msgs/msg/Recorded`.
    RecordedForm {
        header: Header,
        source_seq: u64,
        message_count: u64,
    }

    /// `sketchnav_msgs/msg/SonarScan`.
    SonarScanForm {
        header: Header,
        source_seq: u64,
        angle_min_rad: f32,
        angle_increment_rad: f32,
        half_opening_rad: f32,
        ring_radius_m: f32,
        scan_time_s: f32,
        range_min_m: f32,
        range_max_m: f32,
        ranges_m: Vec<f32>,
    }
}
