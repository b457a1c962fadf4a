"""The layout of each message. Generated from the layout table (schemas/src/python.rs); not to be edited."""

import numpy as np

Header = np.dtype(
    [
        ("seq", "<u8"),
        ("stamp_ns", "<u8"),
        ("source_seq", "<u8"),
    ]
)

Drawing = np.dtype(
    [
        ("header", Header),
        ("kind", "<u4"),
        ("reserved", "<u4"),
    ]
)

PosePx = np.dtype(
    [
        ("x_px", "<f8"),
        ("y_px", "<f8"),
        ("orientation_z", "<f8"),
        ("orientation_w", "<f8"),
    ]
)

SketchMap = np.dtype(
    [
        ("header", Header),
        ("width_px", "<u4"),
        ("height_px", "<u4"),
        ("wall_direction_rad", "<f8"),
        ("pen_width_px", "<f8"),
        ("start", PosePx),
        ("start_spread_px", "<f8"),
        ("start_spread_rad", "<f8"),
    ]
)

RouteTask = np.dtype(
    [
        ("name", "S32"),
        ("first_point", "<u4"),
        ("point_count", "<u4"),
        ("time_limit_s", "<f8"),
    ]
)

Route = np.dtype(
    [
        ("header", Header),
        ("task_count", "<u4"),
        ("point_count", "<u4"),
        ("tasks", RouteTask, (64,)),
        ("points_px", "<f8", (8192, 2,)),
    ]
)

Rules = np.dtype(
    [
        ("header", Header),
        ("set_count", "<u4"),
        ("reserved", "<u4"),
    ]
)

LandmarkRoute = np.dtype(
    [
        ("header", Header),
        ("object_count", "<u4"),
        ("state_count", "<u4"),
        ("length_m", "<f8"),
    ]
)

Directions = np.dtype(
    [
        ("header", Header),
        ("map_count", "<u4"),
        ("reserved", "<u4"),
    ]
)

ChartedJourney = np.dtype(
    [
        ("start_x_m", "<f4"),
        ("start_y_m", "<f4"),
        ("goal", "<u4"),
    ]
)

Chart = np.dtype(
    [
        ("header", Header),
        ("journey_count", "<u4"),
        ("reserved", "<u4"),
        ("sigma_m", "<f8"),
        ("journeys", ChartedJourney, (64,)),
    ]
)

PlannedJourney = np.dtype(
    [
        ("distance_m", "<f8"),
        ("probability", "<f8"),
        ("weakest_entry", "<u4"),
        ("failure_count", "<u4"),
        ("simulated_count", "<u4"),
        ("reserved", "<u4"),
    ]
)

PlannedLandmark = np.dtype(
    [
        ("task", "<u4"),
        ("dot", "<u4"),
        ("x_m", "<f4"),
        ("y_m", "<f4"),
    ]
)

Itinerary = np.dtype(
    [
        ("header", Header),
        ("journey_count", "<u4"),
        ("landmark_count", "<u4"),
        ("journeys", PlannedJourney, (64,)),
        ("landmarks", PlannedLandmark, (512,)),
    ]
)

Understood = np.dtype(
    [
        ("header", Header),
        ("kind", "<u4"),
        ("accepted", "<u4"),
        ("sketch_seq", "<u8"),
        ("route_seq", "<u8"),
        ("sketch_width_px", "<u4"),
        ("sketch_height_px", "<u4"),
        ("scale", "<f8"),
        ("wall_direction_rad", "<f8"),
        ("words", "S256"),
    ]
)

MissionCommand = np.dtype(
    [
        ("header", Header),
        ("order", "<u4"),
        ("task", "<u4"),
        ("here_px", "<f8", (2,)),
        ("here_yaw_rad", "<f8"),
        ("has_heading", "<u4"),
        ("reserved", "<u4"),
        ("place", "S32"),
    ]
)

Contact = np.dtype(
    [
        ("header", Header),
        ("position_m", "<f8", (2,)),
        ("impulse_ns", "<f8"),
        ("body_kind", "<u4"),
        ("begins", "<u4"),
    ]
)

PoseM = np.dtype(
    [
        ("x_m", "<f8"),
        ("y_m", "<f8"),
        ("orientation_z", "<f8"),
        ("orientation_w", "<f8"),
    ]
)

Twist = np.dtype(
    [
        ("vx_mps", "<f8"),
        ("vy_mps", "<f8"),
        ("yaw_rate_radps", "<f8"),
    ]
)

GroundTruth = np.dtype(
    [
        ("header", Header),
        ("pose", PoseM),
        ("twist", Twist),
    ]
)

WalkingPerson = np.dtype(
    [
        ("x_m", "<f8"),
        ("y_m", "<f8"),
        ("radius_m", "<f8"),
    ]
)

People = np.dtype(
    [
        ("header", Header),
        ("count", "<u4"),
        ("reserved", "<u4"),
        ("people", WalkingPerson, (100,)),
    ]
)

Odometry = np.dtype(
    [
        ("header", Header),
        ("pose", PoseM),
        ("twist", Twist),
    ]
)

LaserScan = np.dtype(
    [
        ("header", Header),
        ("angle_min_rad", "<f4"),
        ("angle_max_rad", "<f4"),
        ("angle_increment_rad", "<f4"),
        ("time_increment_s", "<f4"),
        ("scan_time_s", "<f4"),
        ("range_min_m", "<f4"),
        ("range_max_m", "<f4"),
        ("beam_count", "<u4"),
        ("ranges_m", "<f4", (1440,)),
    ]
)

SonarScan = np.dtype(
    [
        ("header", Header),
        ("angle_min_rad", "<f4"),
        ("angle_increment_rad", "<f4"),
        ("half_opening_rad", "<f4"),
        ("ring_radius_m", "<f4"),
        ("scan_time_s", "<f4"),
        ("range_min_m", "<f4"),
        ("range_max_m", "<f4"),
        ("sonar_count", "<u4"),
        ("ranges_m", "<f4", (32,)),
    ]
)

SeenMarker = np.dtype(
    [
        ("id", "<u4"),
        ("x_m", "<f4"),
        ("y_m", "<f4"),
        ("facing_rad", "<f4"),
    ]
)

MarkerView = np.dtype(
    [
        ("header", Header),
        ("camera_x_m", "<f4"),
        ("camera_y_m", "<f4"),
        ("camera_yaw_rad", "<f4"),
        ("half_view_rad", "<f4"),
        ("range_min_m", "<f4"),
        ("range_max_m", "<f4"),
        ("frame_time_s", "<f4"),
        ("marker_count", "<u4"),
        ("markers", SeenMarker, (32,)),
    ]
)

SeenDot = np.dtype(
    [
        ("x_m", "<f4"),
        ("y_m", "<f4"),
    ]
)

DotView = np.dtype(
    [
        ("header", Header),
        ("side_m", "<f4"),
        ("margin_m", "<f4"),
        ("frame_time_s", "<f4"),
        ("dot_count", "<u4"),
        ("dots", SeenDot, (64,)),
    ]
)

Tick = np.dtype(
    [
        ("header", Header),
        ("newest", "<u8", (16,)),
    ]
)

Particle = np.dtype(
    [
        ("x_px", "<f4"),
        ("y_px", "<f4"),
        ("yaw_rad", "<f4"),
        ("scale_a_pxpm", "<f4"),
        ("scale_b_pxpm", "<f4"),
        ("weight", "<f4"),
    ]
)

Particles = np.dtype(
    [
        ("header", Header),
        ("count", "<u4"),
        ("total", "<u4"),
        ("particles", Particle, (512,)),
    ]
)

PoseEstimate = np.dtype(
    [
        ("header", Header),
        ("pose", PosePx),
        ("scale_a_pxpm", "<f8"),
        ("scale_b_pxpm", "<f8"),
        ("covariance", "<f8", (25,)),
        ("effective_sample_size", "<f8"),
        ("fit", "<f8"),
        ("odometry", PoseM),
        ("particle_count", "<u4"),
        ("tracking", "<u4"),
    ]
)

PairedMarker = np.dtype(
    [
        ("id", "<u4"),
        ("marker_trend", "<u4"),
        ("robot_trend", "<u4"),
        ("distance_class", "<u4"),
        ("x_m", "<f8"),
        ("y_m", "<f8"),
    ]
)

KnownMarker = np.dtype(
    [
        ("id", "<u4"),
        ("age_s", "<f4"),
        ("x_m", "<f4"),
        ("y_m", "<f4"),
        ("facing_rad", "<f4"),
        ("reserved", "<u4"),
    ]
)

Relations = np.dtype(
    [
        ("header", Header),
        ("odometry", PoseM),
        ("pairs", "<u8"),
        ("pair_age_s", "<f8"),
        ("left", PairedMarker),
        ("right", PairedMarker),
        ("marker_count", "<u4"),
        ("reserved", "<u4"),
        ("markers", KnownMarker, (64,)),
    ]
)

SeenObject = np.dtype(
    [
        ("place", "<u4"),
        ("first", "<u4"),
        ("count", "<u4"),
        ("landmark", "<u4"),
        ("proximity_m", "<f8"),
        ("width", "<f8"),
    ]
)

LandmarkView = np.dtype(
    [
        ("header", Header),
        ("odometry", PoseM),
        ("in_sketch", PoseM),
        ("stretch", "<f8"),
        ("spread_m", "<f8"),
        ("fit", "<f8"),
        ("sure_count", "<u4"),
        ("reserved", "<u4"),
        ("sectors_m", "<f8", (16,)),
        ("object_count", "<u4"),
        ("place_count", "<u4"),
        ("objects", SeenObject, (16,)),
        ("places_m", "<f4", (48, 2,)),
    ]
)

DescribedDot = np.dtype(
    [
        ("x_m", "<f4"),
        ("y_m", "<f4"),
        ("isolation", "<u4"),
        ("quadrants", "<u4"),
        ("kind", "<u4"),
    ]
)

Description = np.dtype(
    [
        ("header", Header),
        ("view_stamp_ns", "<u8"),
        ("views", "<u8"),
        ("dot_count", "<u4"),
        ("reserved", "<u4"),
        ("meant", "<u4", (8,)),
        ("dots", DescribedDot, (64,)),
    ]
)

Plan = np.dtype(
    [
        ("header", Header),
        ("task", "<u4"),
        ("global_count", "<u4"),
        ("local_count", "<u4"),
        ("follows_route", "<u4"),
        ("target_px", "<f8", (2,)),
        ("global_px", "<f4", (1024, 2,)),
        ("local_px", "<f4", (256, 2,)),
    ]
)

OutlineSample = np.dtype(
    [
        ("x_px", "<f4"),
        ("y_px", "<f4"),
        ("x_m", "<f4"),
        ("y_m", "<f4"),
        ("partner", "<u4"),
        ("goal_share", "<f4"),
    ]
)

Correspondence = np.dtype(
    [
        ("header", Header),
        ("robot", PoseM),
        ("odometry", PoseM),
        ("goal_m", "<f8", (2,)),
        ("seen_share", "<f8"),
        ("hidden_share", "<f8"),
        ("cost", "<f8"),
        ("rival_margin", "<f8"),
        ("rival_m", "<f8", (2,)),
        ("target_m", "<f8", (2,)),
        ("aim", "<u4"),
        ("gap_count", "<u4"),
        ("sample_count", "<u4"),
        ("way_count", "<u4"),
        ("samples", OutlineSample, (256,)),
        ("way_m", "<f4", (128, 2,)),
    ]
)

PossiblePlace = np.dtype(
    [
        ("x_px", "<f8"),
        ("y_px", "<f8"),
        ("margin", "<f8"),
    ]
)

Question = np.dtype(
    [
        ("header", Header),
        ("kind", "<u4"),
        ("place_count", "<u4"),
        ("places", PossiblePlace, (4,)),
    ]
)

MetRelation = np.dtype(
    [
        ("relation", "<u4"),
        ("object", "<u4"),
    ]
)

LandmarkProgress = np.dtype(
    [
        ("header", Header),
        ("along_m", "<f8"),
        ("length_m", "<f8"),
        ("next", "<u4"),
        ("state_count", "<u4"),
        ("command", "<u4"),
        ("event", "<u4"),
        ("met_count", "<u4"),
        ("is_lost", "<u4"),
        ("met", MetRelation, (64,)),
    ]
)

Journey = np.dtype(
    [
        ("header", Header),
        ("activity", "<u4"),
        ("task", "<u4"),
        ("entry", "<u4"),
        ("accepted", "<u4"),
        ("recoveries", "<u4"),
        ("has_reference", "<u4"),
        ("cannot_locate", "<u4"),
        ("reserved", "<u4"),
        ("reference_x_m", "<f8"),
        ("reference_y_m", "<f8"),
    ]
)

BelievedLandmark = np.dtype(
    [
        ("landmark", "<u4"),
        ("probability", "<f4"),
    ]
)

Whereabouts = np.dtype(
    [
        ("header", Header),
        ("task", "<u4"),
        ("landmark_count", "<u4"),
        ("landmarks", BelievedLandmark, (8,)),
    ]
)

VelocityCommand = np.dtype(
    [
        ("header", Header),
        ("twist", Twist),
        ("last", "<u4"),
        ("reserved", "<u4"),
    ]
)

MissionStatus = np.dtype(
    [
        ("header", Header),
        ("task", "<u4"),
        ("task_count", "<u4"),
        ("state", "<u4"),
        ("reached_count", "<u4"),
        ("task_time_s", "<f8"),
        ("task_path_m", "<f8"),
        ("remaining_m", "<f8"),
        ("speed_mps", "<f8"),
        ("name", "S32"),
        ("reason", "S96"),
    ]
)

Latency = np.dtype(
    [
        ("header", Header),
        ("situation_ns", "<u8"),
        ("command_ns", "<u8"),
    ]
)

Health = np.dtype(
    [
        ("header", Header),
        ("process", "<u4"),
        ("pid", "<u4"),
        ("steps", "<u8"),
        ("busy_ns", "<u8"),
        ("step_max_ns", "<u8"),
        ("step_allocations", "<u8"),
        ("lost_messages", "<u8"),
        ("refused_messages", "<u8"),
        ("uptime_ns", "<u8"),
    ]
)

Fault = np.dtype(
    [
        ("header", Header),
        ("kind", "<u4"),
        ("process", "<u4"),
        ("pid", "<u4"),
        ("signal", "<u4"),
        ("exit_code", "<u4"),
        ("attempt", "<u4"),
        ("restarts", "<u4"),
        ("missing", "<u4"),
        ("duration_ns", "<u8"),
        ("words", "S160"),
    ]
)

Recorded = np.dtype(
    [
        ("header", Header),
        ("message_count", "<u8"),
    ]
)

# Channel: type with the fingerprint of its layout, structure, whether several processes write it, the pipeline's readers.
CHANNELS = {
    "drawing": ("sketchnav/Drawing/1/bc2fe5ad3b99105c", Drawing, False, ("sketcher", "recorder",)),
    "sketch": ("sketchnav/SketchMap/1/678448258de9be23", SketchMap, False, ("localizer", "planner", "pad", "recorder",)),
    "route": ("sketchnav/Route/1/0490aae0e488df01", Route, False, ("planner", "recorder",)),
    "rules": ("sketchnav/Rules/1/a6fe3a694e6b7b84", Rules, False, ("planner", "recorder",)),
    "landmark_route": ("sketchnav/LandmarkRoute/1/ccee207c01927f1c", LandmarkRoute, False, ("localizer", "planner", "pad", "recorder",)),
    "directions": ("sketchnav/Directions/1/6f64871dae83bea2", Directions, False, ("supervisor", "planner", "pad", "recorder",)),
    "chart": ("sketchnav/Chart/1/c41f02b33738ccc5", Chart, False, ("planner", "pad", "recorder",)),
    "itinerary": ("sketchnav/Itinerary/2/560049705bfb08fe", Itinerary, False, ("supervisor", "pad", "recorder",)),
    "understood": ("sketchnav/Understood/1/cf0efb456e05d81e", Understood, False, ("pad", "recorder",)),
    "orders": ("sketchnav/MissionCommand/3/1f4826f6fb405dc3", MissionCommand, False, ("localizer", "planner", "recorder",)),
    "mission": ("sketchnav/MissionCommand/3/1f4826f6fb405dc3", MissionCommand, False, ("localizer", "planner", "recorder",)),
    "contact": ("sketchnav/Contact/1/ef5da161b2eb61b4", Contact, False, ("recorder",)),
    "truth": ("sketchnav/GroundTruth/1/20954d63b5e53b0a", GroundTruth, False, ("recorder",)),
    "people": ("sketchnav/People/1/0a047672a30ae3ef", People, False, ("recorder",)),
    "odometry": ("sketchnav/Odometry/1/20954d63b5e53b0a", Odometry, False, ("localizer", "planner", "recorder",)),
    "scan": ("sketchnav/LaserScan/1/57adf6a34793cece", LaserScan, False, ("localizer", "planner", "pad", "recorder",)),
    "sonar": ("sketchnav/SonarScan/1/32fc87b10150e534", SonarScan, False, ("localizer", "planner", "pad", "recorder",)),
    "markers": ("sketchnav/MarkerView/1/0f2cb4da0d2eeb91", MarkerView, False, ("localizer", "planner", "pad", "recorder",)),
    "view": ("sketchnav/DotView/1/f7346cf9e9d06a92", DotView, False, ("localizer", "pad", "recorder",)),
    "tick": ("sketchnav/Tick/1/cd5c8b58a800b493", Tick, False, ("localizer", "planner", "pad", "recorder",)),
    "particles": ("sketchnav/Particles/1/83328733bea235fe", Particles, False, ("pad", "recorder",)),
    "estimate": ("sketchnav/PoseEstimate/1/6fe39940e3453396", PoseEstimate, False, ("planner", "pad", "recorder",)),
    "relations": ("sketchnav/Relations/1/76abc44575759b47", Relations, False, ("planner", "pad", "recorder",)),
    "landmark_view": ("sketchnav/LandmarkView/3/bfe8c78e69f611de", LandmarkView, False, ("planner", "pad", "recorder",)),
    "description": ("sketchnav/Description/2/207b246074302ce7", Description, False, ("planner", "pad", "recorder",)),
    "plan": ("sketchnav/Plan/1/948683b6daa21d2e", Plan, False, ("pad", "recorder",)),
    "correspondence": ("sketchnav/Correspondence/1/04977d1d4f303caf", Correspondence, False, ("pad", "recorder",)),
    "question": ("sketchnav/Question/1/d383d138d8361399", Question, False, ("pad", "recorder",)),
    "landmark_progress": ("sketchnav/LandmarkProgress/2/001370b1fbf1a4a1", LandmarkProgress, False, ("pad", "recorder",)),
    "journey": ("sketchnav/Journey/1/f054905aa2292e8d", Journey, False, ("pad", "recorder",)),
    "whereabouts": ("sketchnav/Whereabouts/1/3d39eeeb79b1c3a9", Whereabouts, False, ("pad", "recorder",)),
    "command": ("sketchnav/VelocityCommand/1/45ef9b3c7d504529", VelocityCommand, False, ("world", "recorder",)),
    "status": ("sketchnav/MissionStatus/1/ed44629eb242885e", MissionStatus, False, ("supervisor", "pad", "recorder",)),
    "latency": ("sketchnav/Latency/2/6fd35d9cb700fb1d", Latency, False, ("recorder",)),
    "health": ("sketchnav/Health/1/3346ae3b59831f8a", Health, True, ("supervisor", "pad", "recorder",)),
    "faults": ("sketchnav/Fault/1/4495aa9889fd2429", Fault, False, ("pad", "recorder",)),
    "recorded": ("sketchnav/Recorded/1/78855a6d7e9eadc4", Recorded, False, ("world", "recorder",)),
}
