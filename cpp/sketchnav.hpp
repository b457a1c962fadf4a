// The layout of each message. Generated from the layout table (schemas/src/cpp.rs); not to be edited.
//
// A channel's service carries the attribute "message" with the type's name and the fingerprint of its layout: compare it
// with `type` before reading. A message is a slice of eight-byte words; its cells follow the structure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace sketchnav {

struct Header {
    std::uint64_t seq;
    std::uint64_t stamp_ns;
    std::uint64_t source_seq;
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 24);
static_assert(offsetof(Header, seq) == 0);
static_assert(offsetof(Header, stamp_ns) == 8);
static_assert(offsetof(Header, source_seq) == 16);

struct Drawing {
    Header header;
    static constexpr std::uint32_t KIND_SKETCH = 1;
    static constexpr std::uint32_t KIND_ROUTE = 2;
    std::uint32_t kind;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<Drawing> && sizeof(Drawing) == 32);
static_assert(offsetof(Drawing, header) == 0);
static_assert(offsetof(Drawing, kind) == 24);
static_assert(offsetof(Drawing, reserved) == 28);

struct PosePx {
    double x_px;
    double y_px;
    double orientation_z;
    double orientation_w;
};
static_assert(std::is_trivially_copyable_v<PosePx> && sizeof(PosePx) == 32);
static_assert(offsetof(PosePx, x_px) == 0);
static_assert(offsetof(PosePx, y_px) == 8);
static_assert(offsetof(PosePx, orientation_z) == 16);
static_assert(offsetof(PosePx, orientation_w) == 24);

struct SketchMap {
    Header header;
    std::uint32_t width_px;
    std::uint32_t height_px;
    double wall_direction_rad;
    double pen_width_px;
    PosePx start;
    double start_spread_px;
    double start_spread_rad;
};
static_assert(std::is_trivially_copyable_v<SketchMap> && sizeof(SketchMap) == 96);
static_assert(offsetof(SketchMap, header) == 0);
static_assert(offsetof(SketchMap, width_px) == 24);
static_assert(offsetof(SketchMap, height_px) == 28);
static_assert(offsetof(SketchMap, wall_direction_rad) == 32);
static_assert(offsetof(SketchMap, pen_width_px) == 40);
static_assert(offsetof(SketchMap, start) == 48);
static_assert(offsetof(SketchMap, start_spread_px) == 80);
static_assert(offsetof(SketchMap, start_spread_rad) == 88);

struct RouteTask {
    char name[32];
    std::uint32_t first_point;
    std::uint32_t point_count;
    double time_limit_s;
};
static_assert(std::is_trivially_copyable_v<RouteTask> && sizeof(RouteTask) == 48);
static_assert(offsetof(RouteTask, name) == 0);
static_assert(offsetof(RouteTask, first_point) == 32);
static_assert(offsetof(RouteTask, point_count) == 36);
static_assert(offsetof(RouteTask, time_limit_s) == 40);

struct Route {
    Header header;
    std::uint32_t task_count;
    std::uint32_t point_count;
    RouteTask tasks[64];
    double points_px[8192][2];
};
static_assert(std::is_trivially_copyable_v<Route> && sizeof(Route) == 134176);
static_assert(offsetof(Route, header) == 0);
static_assert(offsetof(Route, task_count) == 24);
static_assert(offsetof(Route, point_count) == 28);
static_assert(offsetof(Route, tasks) == 32);
static_assert(offsetof(Route, points_px) == 3104);

struct Rules {
    Header header;
    std::uint32_t set_count;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<Rules> && sizeof(Rules) == 32);
static_assert(offsetof(Rules, header) == 0);
static_assert(offsetof(Rules, set_count) == 24);
static_assert(offsetof(Rules, reserved) == 28);

struct LandmarkRoute {
    Header header;
    std::uint32_t object_count;
    std::uint32_t state_count;
    double length_m;
};
static_assert(std::is_trivially_copyable_v<LandmarkRoute> && sizeof(LandmarkRoute) == 40);
static_assert(offsetof(LandmarkRoute, header) == 0);
static_assert(offsetof(LandmarkRoute, object_count) == 24);
static_assert(offsetof(LandmarkRoute, state_count) == 28);
static_assert(offsetof(LandmarkRoute, length_m) == 32);

struct Directions {
    Header header;
    std::uint32_t map_count;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<Directions> && sizeof(Directions) == 32);
static_assert(offsetof(Directions, header) == 0);
static_assert(offsetof(Directions, map_count) == 24);
static_assert(offsetof(Directions, reserved) == 28);

struct ChartedJourney {
    float start_x_m;
    float start_y_m;
    std::uint32_t goal;
};
static_assert(std::is_trivially_copyable_v<ChartedJourney> && sizeof(ChartedJourney) == 12);
static_assert(offsetof(ChartedJourney, start_x_m) == 0);
static_assert(offsetof(ChartedJourney, start_y_m) == 4);
static_assert(offsetof(ChartedJourney, goal) == 8);

struct Chart {
    Header header;
    std::uint32_t journey_count;
    std::uint32_t reserved;
    double sigma_m;
    ChartedJourney journeys[64];
};
static_assert(std::is_trivially_copyable_v<Chart> && sizeof(Chart) == 808);
static_assert(offsetof(Chart, header) == 0);
static_assert(offsetof(Chart, journey_count) == 24);
static_assert(offsetof(Chart, reserved) == 28);
static_assert(offsetof(Chart, sigma_m) == 32);
static_assert(offsetof(Chart, journeys) == 40);

struct PlannedJourney {
    double distance_m;
    double probability;
    std::uint32_t weakest_entry;
    std::uint32_t failure_count;
    std::uint32_t simulated_count;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<PlannedJourney> && sizeof(PlannedJourney) == 32);
static_assert(offsetof(PlannedJourney, distance_m) == 0);
static_assert(offsetof(PlannedJourney, probability) == 8);
static_assert(offsetof(PlannedJourney, weakest_entry) == 16);
static_assert(offsetof(PlannedJourney, failure_count) == 20);
static_assert(offsetof(PlannedJourney, simulated_count) == 24);
static_assert(offsetof(PlannedJourney, reserved) == 28);

struct PlannedLandmark {
    std::uint32_t task;
    std::uint32_t dot;
    float x_m;
    float y_m;
};
static_assert(std::is_trivially_copyable_v<PlannedLandmark> && sizeof(PlannedLandmark) == 16);
static_assert(offsetof(PlannedLandmark, task) == 0);
static_assert(offsetof(PlannedLandmark, dot) == 4);
static_assert(offsetof(PlannedLandmark, x_m) == 8);
static_assert(offsetof(PlannedLandmark, y_m) == 12);

struct Itinerary {
    Header header;
    std::uint32_t journey_count;
    std::uint32_t landmark_count;
    PlannedJourney journeys[64];
    PlannedLandmark landmarks[512];
};
static_assert(std::is_trivially_copyable_v<Itinerary> && sizeof(Itinerary) == 10272);
static_assert(offsetof(Itinerary, header) == 0);
static_assert(offsetof(Itinerary, journey_count) == 24);
static_assert(offsetof(Itinerary, landmark_count) == 28);
static_assert(offsetof(Itinerary, journeys) == 32);
static_assert(offsetof(Itinerary, landmarks) == 2080);

struct Understood {
    Header header;
    static constexpr std::uint32_t KIND_SKETCH = 1;
    static constexpr std::uint32_t KIND_ROUTE = 2;
    std::uint32_t kind;
    std::uint32_t accepted;
    std::uint64_t sketch_seq;
    std::uint64_t route_seq;
    std::uint32_t sketch_width_px;
    std::uint32_t sketch_height_px;
    double scale;
    double wall_direction_rad;
    char words[256];
};
static_assert(std::is_trivially_copyable_v<Understood> && sizeof(Understood) == 328);
static_assert(offsetof(Understood, header) == 0);
static_assert(offsetof(Understood, kind) == 24);
static_assert(offsetof(Understood, accepted) == 28);
static_assert(offsetof(Understood, sketch_seq) == 32);
static_assert(offsetof(Understood, route_seq) == 40);
static_assert(offsetof(Understood, sketch_width_px) == 48);
static_assert(offsetof(Understood, sketch_height_px) == 52);
static_assert(offsetof(Understood, scale) == 56);
static_assert(offsetof(Understood, wall_direction_rad) == 64);
static_assert(offsetof(Understood, words) == 72);

struct MissionCommand {
    Header header;
    static constexpr std::uint32_t ORDER_START = 1;
    static constexpr std::uint32_t ORDER_ABORT = 2;
    static constexpr std::uint32_t ORDER_PAUSE = 3;
    static constexpr std::uint32_t ORDER_RESUME = 4;
    static constexpr std::uint32_t ORDER_UNATTENDED = 5;
    static constexpr std::uint32_t ORDER_GOAL = 6;
    static constexpr std::uint32_t ORDER_HERE = 7;
    std::uint32_t order;
    std::uint32_t task;
    double here_px[2];
    double here_yaw_rad;
    std::uint32_t has_heading;
    std::uint32_t reserved;
    char place[32];
};
static_assert(std::is_trivially_copyable_v<MissionCommand> && sizeof(MissionCommand) == 96);
static_assert(offsetof(MissionCommand, header) == 0);
static_assert(offsetof(MissionCommand, order) == 24);
static_assert(offsetof(MissionCommand, task) == 28);
static_assert(offsetof(MissionCommand, here_px) == 32);
static_assert(offsetof(MissionCommand, here_yaw_rad) == 48);
static_assert(offsetof(MissionCommand, has_heading) == 56);
static_assert(offsetof(MissionCommand, reserved) == 60);
static_assert(offsetof(MissionCommand, place) == 64);

struct Contact {
    Header header;
    double position_m[2];
    double impulse_ns;
    static constexpr std::uint32_t BODY_KIND_WALL = 1;
    static constexpr std::uint32_t BODY_KIND_FURNITURE = 2;
    static constexpr std::uint32_t BODY_KIND_PERSON = 3;
    std::uint32_t body_kind;
    std::uint32_t begins;
};
static_assert(std::is_trivially_copyable_v<Contact> && sizeof(Contact) == 56);
static_assert(offsetof(Contact, header) == 0);
static_assert(offsetof(Contact, position_m) == 24);
static_assert(offsetof(Contact, impulse_ns) == 40);
static_assert(offsetof(Contact, body_kind) == 48);
static_assert(offsetof(Contact, begins) == 52);

struct PoseM {
    double x_m;
    double y_m;
    double orientation_z;
    double orientation_w;
};
static_assert(std::is_trivially_copyable_v<PoseM> && sizeof(PoseM) == 32);
static_assert(offsetof(PoseM, x_m) == 0);
static_assert(offsetof(PoseM, y_m) == 8);
static_assert(offsetof(PoseM, orientation_z) == 16);
static_assert(offsetof(PoseM, orientation_w) == 24);

struct Twist {
    double vx_mps;
    double vy_mps;
    double yaw_rate_radps;
};
static_assert(std::is_trivially_copyable_v<Twist> && sizeof(Twist) == 24);
static_assert(offsetof(Twist, vx_mps) == 0);
static_assert(offsetof(Twist, vy_mps) == 8);
static_assert(offsetof(Twist, yaw_rate_radps) == 16);

struct GroundTruth {
    Header header;
    PoseM pose;
    Twist twist;
};
static_assert(std::is_trivially_copyable_v<GroundTruth> && sizeof(GroundTruth) == 80);
static_assert(offsetof(GroundTruth, header) == 0);
static_assert(offsetof(GroundTruth, pose) == 24);
static_assert(offsetof(GroundTruth, twist) == 56);

struct WalkingPerson {
    double x_m;
    double y_m;
    double radius_m;
};
static_assert(std::is_trivially_copyable_v<WalkingPerson> && sizeof(WalkingPerson) == 24);
static_assert(offsetof(WalkingPerson, x_m) == 0);
static_assert(offsetof(WalkingPerson, y_m) == 8);
static_assert(offsetof(WalkingPerson, radius_m) == 16);

struct People {
    Header header;
    std::uint32_t count;
    std::uint32_t reserved;
    WalkingPerson people[100];
};
static_assert(std::is_trivially_copyable_v<People> && sizeof(People) == 2432);
static_assert(offsetof(People, header) == 0);
static_assert(offsetof(People, count) == 24);
static_assert(offsetof(People, reserved) == 28);
static_assert(offsetof(People, people) == 32);

struct Odometry {
    Header header;
    PoseM pose;
    Twist twist;
};
static_assert(std::is_trivially_copyable_v<Odometry> && sizeof(Odometry) == 80);
static_assert(offsetof(Odometry, header) == 0);
static_assert(offsetof(Odometry, pose) == 24);
static_assert(offsetof(Odometry, twist) == 56);

struct LaserScan {
    Header header;
    float angle_min_rad;
    float angle_max_rad;
    float angle_increment_rad;
    float time_increment_s;
    float scan_time_s;
    float range_min_m;
    float range_max_m;
    std::uint32_t beam_count;
    float ranges_m[1440];
};
static_assert(std::is_trivially_copyable_v<LaserScan> && sizeof(LaserScan) == 5816);
static_assert(offsetof(LaserScan, header) == 0);
static_assert(offsetof(LaserScan, angle_min_rad) == 24);
static_assert(offsetof(LaserScan, angle_max_rad) == 28);
static_assert(offsetof(LaserScan, angle_increment_rad) == 32);
static_assert(offsetof(LaserScan, time_increment_s) == 36);
static_assert(offsetof(LaserScan, scan_time_s) == 40);
static_assert(offsetof(LaserScan, range_min_m) == 44);
static_assert(offsetof(LaserScan, range_max_m) == 48);
static_assert(offsetof(LaserScan, beam_count) == 52);
static_assert(offsetof(LaserScan, ranges_m) == 56);

struct SonarScan {
    Header header;
    float angle_min_rad;
    float angle_increment_rad;
    float half_opening_rad;
    float ring_radius_m;
    float scan_time_s;
    float range_min_m;
    float range_max_m;
    std::uint32_t sonar_count;
    float ranges_m[32];
};
static_assert(std::is_trivially_copyable_v<SonarScan> && sizeof(SonarScan) == 184);
static_assert(offsetof(SonarScan, header) == 0);
static_assert(offsetof(SonarScan, angle_min_rad) == 24);
static_assert(offsetof(SonarScan, angle_increment_rad) == 28);
static_assert(offsetof(SonarScan, half_opening_rad) == 32);
static_assert(offsetof(SonarScan, ring_radius_m) == 36);
static_assert(offsetof(SonarScan, scan_time_s) == 40);
static_assert(offsetof(SonarScan, range_min_m) == 44);
static_assert(offsetof(SonarScan, range_max_m) == 48);
static_assert(offsetof(SonarScan, sonar_count) == 52);
static_assert(offsetof(SonarScan, ranges_m) == 56);

struct SeenMarker {
    std::uint32_t id;
    float x_m;
    float y_m;
    float facing_rad;
};
static_assert(std::is_trivially_copyable_v<SeenMarker> && sizeof(SeenMarker) == 16);
static_assert(offsetof(SeenMarker, id) == 0);
static_assert(offsetof(SeenMarker, x_m) == 4);
static_assert(offsetof(SeenMarker, y_m) == 8);
static_assert(offsetof(SeenMarker, facing_rad) == 12);

struct MarkerView {
    Header header;
    float camera_x_m;
    float camera_y_m;
    float camera_yaw_rad;
    float half_view_rad;
    float range_min_m;
    float range_max_m;
    float frame_time_s;
    std::uint32_t marker_count;
    SeenMarker markers[32];
};
static_assert(std::is_trivially_copyable_v<MarkerView> && sizeof(MarkerView) == 568);
static_assert(offsetof(MarkerView, header) == 0);
static_assert(offsetof(MarkerView, camera_x_m) == 24);
static_assert(offsetof(MarkerView, camera_y_m) == 28);
static_assert(offsetof(MarkerView, camera_yaw_rad) == 32);
static_assert(offsetof(MarkerView, half_view_rad) == 36);
static_assert(offsetof(MarkerView, range_min_m) == 40);
static_assert(offsetof(MarkerView, range_max_m) == 44);
static_assert(offsetof(MarkerView, frame_time_s) == 48);
static_assert(offsetof(MarkerView, marker_count) == 52);
static_assert(offsetof(MarkerView, markers) == 56);

struct SeenDot {
    float x_m;
    float y_m;
};
static_assert(std::is_trivially_copyable_v<SeenDot> && sizeof(SeenDot) == 8);
static_assert(offsetof(SeenDot, x_m) == 0);
static_assert(offsetof(SeenDot, y_m) == 4);

struct DotView {
    Header header;
    float side_m;
    float margin_m;
    float frame_time_s;
    std::uint32_t dot_count;
    SeenDot dots[64];
};
static_assert(std::is_trivially_copyable_v<DotView> && sizeof(DotView) == 552);
static_assert(offsetof(DotView, header) == 0);
static_assert(offsetof(DotView, side_m) == 24);
static_assert(offsetof(DotView, margin_m) == 28);
static_assert(offsetof(DotView, frame_time_s) == 32);
static_assert(offsetof(DotView, dot_count) == 36);
static_assert(offsetof(DotView, dots) == 40);

struct Tick {
    Header header;
    std::uint64_t newest[16];
};
static_assert(std::is_trivially_copyable_v<Tick> && sizeof(Tick) == 152);
static_assert(offsetof(Tick, header) == 0);
static_assert(offsetof(Tick, newest) == 24);

struct Particle {
    float x_px;
    float y_px;
    float yaw_rad;
    float scale_a_pxpm;
    float scale_b_pxpm;
    float weight;
};
static_assert(std::is_trivially_copyable_v<Particle> && sizeof(Particle) == 24);
static_assert(offsetof(Particle, x_px) == 0);
static_assert(offsetof(Particle, y_px) == 4);
static_assert(offsetof(Particle, yaw_rad) == 8);
static_assert(offsetof(Particle, scale_a_pxpm) == 12);
static_assert(offsetof(Particle, scale_b_pxpm) == 16);
static_assert(offsetof(Particle, weight) == 20);

struct Particles {
    Header header;
    std::uint32_t count;
    std::uint32_t total;
    Particle particles[512];
};
static_assert(std::is_trivially_copyable_v<Particles> && sizeof(Particles) == 12320);
static_assert(offsetof(Particles, header) == 0);
static_assert(offsetof(Particles, count) == 24);
static_assert(offsetof(Particles, total) == 28);
static_assert(offsetof(Particles, particles) == 32);

struct PoseEstimate {
    Header header;
    PosePx pose;
    double scale_a_pxpm;
    double scale_b_pxpm;
    double covariance[25];
    double effective_sample_size;
    double fit;
    PoseM odometry;
    std::uint32_t particle_count;
    static constexpr std::uint32_t TRACKING_WAITING = 0;
    static constexpr std::uint32_t TRACKING_TRACKING = 1;
    static constexpr std::uint32_t TRACKING_DOUBTFUL = 2;
    static constexpr std::uint32_t TRACKING_LOST = 3;
    std::uint32_t tracking;
};
static_assert(std::is_trivially_copyable_v<PoseEstimate> && sizeof(PoseEstimate) == 328);
static_assert(offsetof(PoseEstimate, header) == 0);
static_assert(offsetof(PoseEstimate, pose) == 24);
static_assert(offsetof(PoseEstimate, scale_a_pxpm) == 56);
static_assert(offsetof(PoseEstimate, scale_b_pxpm) == 64);
static_assert(offsetof(PoseEstimate, covariance) == 72);
static_assert(offsetof(PoseEstimate, effective_sample_size) == 272);
static_assert(offsetof(PoseEstimate, fit) == 280);
static_assert(offsetof(PoseEstimate, odometry) == 288);
static_assert(offsetof(PoseEstimate, particle_count) == 320);
static_assert(offsetof(PoseEstimate, tracking) == 324);

struct PairedMarker {
    std::uint32_t id;
    std::uint32_t marker_trend;
    std::uint32_t robot_trend;
    std::uint32_t distance_class;
    double x_m;
    double y_m;
};
static_assert(std::is_trivially_copyable_v<PairedMarker> && sizeof(PairedMarker) == 32);
static_assert(offsetof(PairedMarker, id) == 0);
static_assert(offsetof(PairedMarker, marker_trend) == 4);
static_assert(offsetof(PairedMarker, robot_trend) == 8);
static_assert(offsetof(PairedMarker, distance_class) == 12);
static_assert(offsetof(PairedMarker, x_m) == 16);
static_assert(offsetof(PairedMarker, y_m) == 24);

struct KnownMarker {
    std::uint32_t id;
    float age_s;
    float x_m;
    float y_m;
    float facing_rad;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<KnownMarker> && sizeof(KnownMarker) == 24);
static_assert(offsetof(KnownMarker, id) == 0);
static_assert(offsetof(KnownMarker, age_s) == 4);
static_assert(offsetof(KnownMarker, x_m) == 8);
static_assert(offsetof(KnownMarker, y_m) == 12);
static_assert(offsetof(KnownMarker, facing_rad) == 16);
static_assert(offsetof(KnownMarker, reserved) == 20);

struct Relations {
    Header header;
    PoseM odometry;
    std::uint64_t pairs;
    double pair_age_s;
    PairedMarker left;
    PairedMarker right;
    std::uint32_t marker_count;
    std::uint32_t reserved;
    KnownMarker markers[64];
};
static_assert(std::is_trivially_copyable_v<Relations> && sizeof(Relations) == 1680);
static_assert(offsetof(Relations, header) == 0);
static_assert(offsetof(Relations, odometry) == 24);
static_assert(offsetof(Relations, pairs) == 56);
static_assert(offsetof(Relations, pair_age_s) == 64);
static_assert(offsetof(Relations, left) == 72);
static_assert(offsetof(Relations, right) == 104);
static_assert(offsetof(Relations, marker_count) == 136);
static_assert(offsetof(Relations, reserved) == 140);
static_assert(offsetof(Relations, markers) == 144);

struct SeenObject {
    std::uint32_t place;
    std::uint32_t first;
    std::uint32_t count;
    std::uint32_t landmark;
    double proximity_m;
    double width;
};
static_assert(std::is_trivially_copyable_v<SeenObject> && sizeof(SeenObject) == 32);
static_assert(offsetof(SeenObject, place) == 0);
static_assert(offsetof(SeenObject, first) == 4);
static_assert(offsetof(SeenObject, count) == 8);
static_assert(offsetof(SeenObject, landmark) == 12);
static_assert(offsetof(SeenObject, proximity_m) == 16);
static_assert(offsetof(SeenObject, width) == 24);

struct LandmarkView {
    Header header;
    PoseM odometry;
    PoseM in_sketch;
    double stretch;
    double spread_m;
    double fit;
    std::uint32_t sure_count;
    std::uint32_t reserved;
    double sectors_m[16];
    std::uint32_t object_count;
    std::uint32_t place_count;
    SeenObject objects[16];
    float places_m[48][2];
};
static_assert(std::is_trivially_copyable_v<LandmarkView> && sizeof(LandmarkView) == 1152);
static_assert(offsetof(LandmarkView, header) == 0);
static_assert(offsetof(LandmarkView, odometry) == 24);
static_assert(offsetof(LandmarkView, in_sketch) == 56);
static_assert(offsetof(LandmarkView, stretch) == 88);
static_assert(offsetof(LandmarkView, spread_m) == 96);
static_assert(offsetof(LandmarkView, fit) == 104);
static_assert(offsetof(LandmarkView, sure_count) == 112);
static_assert(offsetof(LandmarkView, reserved) == 116);
static_assert(offsetof(LandmarkView, sectors_m) == 120);
static_assert(offsetof(LandmarkView, object_count) == 248);
static_assert(offsetof(LandmarkView, place_count) == 252);
static_assert(offsetof(LandmarkView, objects) == 256);
static_assert(offsetof(LandmarkView, places_m) == 768);

struct DescribedDot {
    float x_m;
    float y_m;
    std::uint32_t isolation;
    std::uint32_t quadrants;
    std::uint32_t kind;
};
static_assert(std::is_trivially_copyable_v<DescribedDot> && sizeof(DescribedDot) == 20);
static_assert(offsetof(DescribedDot, x_m) == 0);
static_assert(offsetof(DescribedDot, y_m) == 4);
static_assert(offsetof(DescribedDot, isolation) == 8);
static_assert(offsetof(DescribedDot, quadrants) == 12);
static_assert(offsetof(DescribedDot, kind) == 16);

struct Description {
    Header header;
    std::uint64_t view_stamp_ns;
    std::uint64_t views;
    std::uint32_t dot_count;
    std::uint32_t reserved;
    std::uint32_t meant[8];
    DescribedDot dots[64];
};
static_assert(std::is_trivially_copyable_v<Description> && sizeof(Description) == 1360);
static_assert(offsetof(Description, header) == 0);
static_assert(offsetof(Description, view_stamp_ns) == 24);
static_assert(offsetof(Description, views) == 32);
static_assert(offsetof(Description, dot_count) == 40);
static_assert(offsetof(Description, reserved) == 44);
static_assert(offsetof(Description, meant) == 48);
static_assert(offsetof(Description, dots) == 80);

struct Plan {
    Header header;
    std::uint32_t task;
    std::uint32_t global_count;
    std::uint32_t local_count;
    std::uint32_t follows_route;
    double target_px[2];
    float global_px[1024][2];
    float local_px[256][2];
};
static_assert(std::is_trivially_copyable_v<Plan> && sizeof(Plan) == 10296);
static_assert(offsetof(Plan, header) == 0);
static_assert(offsetof(Plan, task) == 24);
static_assert(offsetof(Plan, global_count) == 28);
static_assert(offsetof(Plan, local_count) == 32);
static_assert(offsetof(Plan, follows_route) == 36);
static_assert(offsetof(Plan, target_px) == 40);
static_assert(offsetof(Plan, global_px) == 56);
static_assert(offsetof(Plan, local_px) == 8248);

struct OutlineSample {
    float x_px;
    float y_px;
    float x_m;
    float y_m;
    std::uint32_t partner;
    float goal_share;
};
static_assert(std::is_trivially_copyable_v<OutlineSample> && sizeof(OutlineSample) == 24);
static_assert(offsetof(OutlineSample, x_px) == 0);
static_assert(offsetof(OutlineSample, y_px) == 4);
static_assert(offsetof(OutlineSample, x_m) == 8);
static_assert(offsetof(OutlineSample, y_m) == 12);
static_assert(offsetof(OutlineSample, partner) == 16);
static_assert(offsetof(OutlineSample, goal_share) == 20);

struct Correspondence {
    Header header;
    PoseM robot;
    PoseM odometry;
    double goal_m[2];
    double seen_share;
    double hidden_share;
    double cost;
    double rival_margin;
    double rival_m[2];
    double target_m[2];
    static constexpr std::uint32_t AIM_NONE = 0;
    static constexpr std::uint32_t AIM_GOAL = 1;
    static constexpr std::uint32_t AIM_GAP = 2;
    static constexpr std::uint32_t AIM_RIVAL = 3;
    std::uint32_t aim;
    std::uint32_t gap_count;
    std::uint32_t sample_count;
    std::uint32_t way_count;
    OutlineSample samples[256];
    float way_m[128][2];
};
static_assert(std::is_trivially_copyable_v<Correspondence> && sizeof(Correspondence) == 7352);
static_assert(offsetof(Correspondence, header) == 0);
static_assert(offsetof(Correspondence, robot) == 24);
static_assert(offsetof(Correspondence, odometry) == 56);
static_assert(offsetof(Correspondence, goal_m) == 88);
static_assert(offsetof(Correspondence, seen_share) == 104);
static_assert(offsetof(Correspondence, hidden_share) == 112);
static_assert(offsetof(Correspondence, cost) == 120);
static_assert(offsetof(Correspondence, rival_margin) == 128);
static_assert(offsetof(Correspondence, rival_m) == 136);
static_assert(offsetof(Correspondence, target_m) == 152);
static_assert(offsetof(Correspondence, aim) == 168);
static_assert(offsetof(Correspondence, gap_count) == 172);
static_assert(offsetof(Correspondence, sample_count) == 176);
static_assert(offsetof(Correspondence, way_count) == 180);
static_assert(offsetof(Correspondence, samples) == 184);
static_assert(offsetof(Correspondence, way_m) == 6328);

struct PossiblePlace {
    double x_px;
    double y_px;
    double margin;
};
static_assert(std::is_trivially_copyable_v<PossiblePlace> && sizeof(PossiblePlace) == 24);
static_assert(offsetof(PossiblePlace, x_px) == 0);
static_assert(offsetof(PossiblePlace, y_px) == 8);
static_assert(offsetof(PossiblePlace, margin) == 16);

struct Question {
    Header header;
    static constexpr std::uint32_t KIND_NOTHING = 0;
    static constexpr std::uint32_t KIND_WHICH = 1;
    static constexpr std::uint32_t KIND_WHERE = 2;
    std::uint32_t kind;
    std::uint32_t place_count;
    PossiblePlace places[4];
};
static_assert(std::is_trivially_copyable_v<Question> && sizeof(Question) == 128);
static_assert(offsetof(Question, header) == 0);
static_assert(offsetof(Question, kind) == 24);
static_assert(offsetof(Question, place_count) == 28);
static_assert(offsetof(Question, places) == 32);

struct MetRelation {
    std::uint32_t relation;
    std::uint32_t object;
};
static_assert(std::is_trivially_copyable_v<MetRelation> && sizeof(MetRelation) == 8);
static_assert(offsetof(MetRelation, relation) == 0);
static_assert(offsetof(MetRelation, object) == 4);

struct LandmarkProgress {
    Header header;
    double along_m;
    double length_m;
    std::uint32_t next;
    std::uint32_t state_count;
    static constexpr std::uint32_t COMMAND_FORWARD = 0;
    static constexpr std::uint32_t COMMAND_LEFT = 1;
    static constexpr std::uint32_t COMMAND_RIGHT = 2;
    static constexpr std::uint32_t COMMAND_STOP = 3;
    std::uint32_t command;
    static constexpr std::uint32_t EVENT_NOTHING = 0;
    static constexpr std::uint32_t EVENT_MATCHED = 1;
    static constexpr std::uint32_t EVENT_ARRIVED = 2;
    static constexpr std::uint32_t EVENT_LOST = 3;
    std::uint32_t event;
    std::uint32_t met_count;
    std::uint32_t is_lost;
    MetRelation met[64];
};
static_assert(std::is_trivially_copyable_v<LandmarkProgress> && sizeof(LandmarkProgress) == 576);
static_assert(offsetof(LandmarkProgress, header) == 0);
static_assert(offsetof(LandmarkProgress, along_m) == 24);
static_assert(offsetof(LandmarkProgress, length_m) == 32);
static_assert(offsetof(LandmarkProgress, next) == 40);
static_assert(offsetof(LandmarkProgress, state_count) == 44);
static_assert(offsetof(LandmarkProgress, command) == 48);
static_assert(offsetof(LandmarkProgress, event) == 52);
static_assert(offsetof(LandmarkProgress, met_count) == 56);
static_assert(offsetof(LandmarkProgress, is_lost) == 60);
static_assert(offsetof(LandmarkProgress, met) == 64);

struct Journey {
    Header header;
    static constexpr std::uint32_t ACTIVITY_SEEK = 0;
    static constexpr std::uint32_t ACTIVITY_SLIDE = 1;
    static constexpr std::uint32_t ACTIVITY_VERIFY = 2;
    static constexpr std::uint32_t ACTIVITY_ADJUST = 3;
    static constexpr std::uint32_t ACTIVITY_RECOVER = 4;
    static constexpr std::uint32_t ACTIVITY_REST = 5;
    std::uint32_t activity;
    std::uint32_t task;
    std::uint32_t entry;
    std::uint32_t accepted;
    std::uint32_t recoveries;
    std::uint32_t has_reference;
    std::uint32_t cannot_locate;
    std::uint32_t reserved;
    double reference_x_m;
    double reference_y_m;
};
static_assert(std::is_trivially_copyable_v<Journey> && sizeof(Journey) == 72);
static_assert(offsetof(Journey, header) == 0);
static_assert(offsetof(Journey, activity) == 24);
static_assert(offsetof(Journey, task) == 28);
static_assert(offsetof(Journey, entry) == 32);
static_assert(offsetof(Journey, accepted) == 36);
static_assert(offsetof(Journey, recoveries) == 40);
static_assert(offsetof(Journey, has_reference) == 44);
static_assert(offsetof(Journey, cannot_locate) == 48);
static_assert(offsetof(Journey, reserved) == 52);
static_assert(offsetof(Journey, reference_x_m) == 56);
static_assert(offsetof(Journey, reference_y_m) == 64);

struct BelievedLandmark {
    std::uint32_t landmark;
    float probability;
};
static_assert(std::is_trivially_copyable_v<BelievedLandmark> && sizeof(BelievedLandmark) == 8);
static_assert(offsetof(BelievedLandmark, landmark) == 0);
static_assert(offsetof(BelievedLandmark, probability) == 4);

struct Whereabouts {
    Header header;
    std::uint32_t task;
    std::uint32_t landmark_count;
    BelievedLandmark landmarks[8];
};
static_assert(std::is_trivially_copyable_v<Whereabouts> && sizeof(Whereabouts) == 96);
static_assert(offsetof(Whereabouts, header) == 0);
static_assert(offsetof(Whereabouts, task) == 24);
static_assert(offsetof(Whereabouts, landmark_count) == 28);
static_assert(offsetof(Whereabouts, landmarks) == 32);

struct VelocityCommand {
    Header header;
    Twist twist;
    std::uint32_t last;
    std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<VelocityCommand> && sizeof(VelocityCommand) == 56);
static_assert(offsetof(VelocityCommand, header) == 0);
static_assert(offsetof(VelocityCommand, twist) == 24);
static_assert(offsetof(VelocityCommand, last) == 48);
static_assert(offsetof(VelocityCommand, reserved) == 52);

struct MissionStatus {
    Header header;
    std::uint32_t task;
    std::uint32_t task_count;
    static constexpr std::uint32_t STATE_WAITING = 0;
    static constexpr std::uint32_t STATE_DRIVING = 1;
    static constexpr std::uint32_t STATE_PAUSED = 2;
    static constexpr std::uint32_t STATE_REACHED = 3;
    static constexpr std::uint32_t STATE_BLOCKED = 4;
    static constexpr std::uint32_t STATE_LOST = 5;
    static constexpr std::uint32_t STATE_TIMED_OUT = 6;
    static constexpr std::uint32_t STATE_ABORTED = 7;
    static constexpr std::uint32_t STATE_FINISHED = 8;
    std::uint32_t state;
    std::uint32_t reached_count;
    double task_time_s;
    double task_path_m;
    double remaining_m;
    double speed_mps;
    char name[32];
    char reason[96];
};
static_assert(std::is_trivially_copyable_v<MissionStatus> && sizeof(MissionStatus) == 200);
static_assert(offsetof(MissionStatus, header) == 0);
static_assert(offsetof(MissionStatus, task) == 24);
static_assert(offsetof(MissionStatus, task_count) == 28);
static_assert(offsetof(MissionStatus, state) == 32);
static_assert(offsetof(MissionStatus, reached_count) == 36);
static_assert(offsetof(MissionStatus, task_time_s) == 40);
static_assert(offsetof(MissionStatus, task_path_m) == 48);
static_assert(offsetof(MissionStatus, remaining_m) == 56);
static_assert(offsetof(MissionStatus, speed_mps) == 64);
static_assert(offsetof(MissionStatus, name) == 72);
static_assert(offsetof(MissionStatus, reason) == 104);

struct Latency {
    Header header;
    std::uint64_t situation_ns;
    std::uint64_t command_ns;
};
static_assert(std::is_trivially_copyable_v<Latency> && sizeof(Latency) == 40);
static_assert(offsetof(Latency, header) == 0);
static_assert(offsetof(Latency, situation_ns) == 24);
static_assert(offsetof(Latency, command_ns) == 32);

struct Health {
    Header header;
    static constexpr std::uint32_t PROCESS_WORLD = 1;
    static constexpr std::uint32_t PROCESS_SKETCHER = 2;
    static constexpr std::uint32_t PROCESS_LOCALIZER = 3;
    static constexpr std::uint32_t PROCESS_PLANNER = 4;
    static constexpr std::uint32_t PROCESS_RECORDER = 5;
    static constexpr std::uint32_t PROCESS_SUPERVISOR = 6;
    static constexpr std::uint32_t PROCESS_OBSERVER = 7;
    static constexpr std::uint32_t PROCESS_PAD = 8;
    std::uint32_t process;
    std::uint32_t pid;
    std::uint64_t steps;
    std::uint64_t busy_ns;
    std::uint64_t step_max_ns;
    std::uint64_t step_allocations;
    std::uint64_t lost_messages;
    std::uint64_t refused_messages;
    std::uint64_t uptime_ns;
};
static_assert(std::is_trivially_copyable_v<Health> && sizeof(Health) == 88);
static_assert(offsetof(Health, header) == 0);
static_assert(offsetof(Health, process) == 24);
static_assert(offsetof(Health, pid) == 28);
static_assert(offsetof(Health, steps) == 32);
static_assert(offsetof(Health, busy_ns) == 40);
static_assert(offsetof(Health, step_max_ns) == 48);
static_assert(offsetof(Health, step_allocations) == 56);
static_assert(offsetof(Health, lost_messages) == 64);
static_assert(offsetof(Health, refused_messages) == 72);
static_assert(offsetof(Health, uptime_ns) == 80);

struct Fault {
    Header header;
    static constexpr std::uint32_t KIND_INJECTED = 1;
    static constexpr std::uint32_t KIND_DIED = 2;
    static constexpr std::uint32_t KIND_RESTARTED = 3;
    static constexpr std::uint32_t KIND_RECOVERED = 4;
    static constexpr std::uint32_t KIND_UNRESPONSIVE = 5;
    static constexpr std::uint32_t KIND_RESPONSIVE = 6;
    static constexpr std::uint32_t KIND_GIVEN_UP = 7;
    static constexpr std::uint32_t KIND_STATE_REFUSED = 8;
    static constexpr std::uint32_t KIND_RECORDING_FAILED = 9;
    static constexpr std::uint32_t KIND_RECORDING_RESUMED = 10;
    static constexpr std::uint32_t KIND_SYSTEM_RESUMED = 11;
    static constexpr std::uint32_t KIND_ORDERED = 12;
    std::uint32_t kind;
    static constexpr std::uint32_t PROCESS_WORLD = 1;
    static constexpr std::uint32_t PROCESS_SKETCHER = 2;
    static constexpr std::uint32_t PROCESS_LOCALIZER = 3;
    static constexpr std::uint32_t PROCESS_PLANNER = 4;
    static constexpr std::uint32_t PROCESS_RECORDER = 5;
    static constexpr std::uint32_t PROCESS_SUPERVISOR = 6;
    static constexpr std::uint32_t PROCESS_OBSERVER = 7;
    static constexpr std::uint32_t PROCESS_PAD = 8;
    std::uint32_t process;
    std::uint32_t pid;
    std::uint32_t signal;
    std::uint32_t exit_code;
    std::uint32_t attempt;
    std::uint32_t restarts;
    std::uint32_t missing;
    std::uint64_t duration_ns;
    char words[160];
};
static_assert(std::is_trivially_copyable_v<Fault> && sizeof(Fault) == 224);
static_assert(offsetof(Fault, header) == 0);
static_assert(offsetof(Fault, kind) == 24);
static_assert(offsetof(Fault, process) == 28);
static_assert(offsetof(Fault, pid) == 32);
static_assert(offsetof(Fault, signal) == 36);
static_assert(offsetof(Fault, exit_code) == 40);
static_assert(offsetof(Fault, attempt) == 44);
static_assert(offsetof(Fault, restarts) == 48);
static_assert(offsetof(Fault, missing) == 52);
static_assert(offsetof(Fault, duration_ns) == 56);
static_assert(offsetof(Fault, words) == 64);

struct Recorded {
    Header header;
    std::uint64_t message_count;
};
static_assert(std::is_trivially_copyable_v<Recorded> && sizeof(Recorded) == 32);
static_assert(offsetof(Recorded, header) == 0);
static_assert(offsetof(Recorded, message_count) == 24);

/// A channel: its messages, and whether several processes write it.
struct Channel {
    const char* name;
    const char* type;
    std::size_t size;
    bool many_writers;
};

inline constexpr std::array<Channel, 37> CHANNELS{{
    {"drawing", "sketchnav/Drawing/1/bc2fe5ad3b99105c", sizeof(Drawing), false},
    {"sketch", "sketchnav/SketchMap/1/678448258de9be23", sizeof(SketchMap), false},
    {"route", "sketchnav/Route/1/0490aae0e488df01", sizeof(Route), false},
    {"rules", "sketchnav/Rules/1/a6fe3a694e6b7b84", sizeof(Rules), false},
    {"landmark_route", "sketchnav/LandmarkRoute/1/ccee207c01927f1c", sizeof(LandmarkRoute), false},
    {"directions", "sketchnav/Directions/1/6f64871dae83bea2", sizeof(Directions), false},
    {"chart", "sketchnav/Chart/1/c41f02b33738ccc5", sizeof(Chart), false},
    {"itinerary", "sketchnav/Itinerary/2/560049705bfb08fe", sizeof(Itinerary), false},
    {"understood", "sketchnav/Understood/1/cf0efb456e05d81e", sizeof(Understood), false},
    {"orders", "sketchnav/MissionCommand/3/1f4826f6fb405dc3", sizeof(MissionCommand), false},
    {"mission", "sketchnav/MissionCommand/3/1f4826f6fb405dc3", sizeof(MissionCommand), false},
    {"contact", "sketchnav/Contact/1/ef5da161b2eb61b4", sizeof(Contact), false},
    {"truth", "sketchnav/GroundTruth/1/20954d63b5e53b0a", sizeof(GroundTruth), false},
    {"people", "sketchnav/People/1/0a047672a30ae3ef", sizeof(People), false},
    {"odometry", "sketchnav/Odometry/1/20954d63b5e53b0a", sizeof(Odometry), false},
    {"scan", "sketchnav/LaserScan/1/57adf6a34793cece", sizeof(LaserScan), false},
    {"sonar", "sketchnav/SonarScan/1/32fc87b10150e534", sizeof(SonarScan), false},
    {"markers", "sketchnav/MarkerView/1/0f2cb4da0d2eeb91", sizeof(MarkerView), false},
    {"view", "sketchnav/DotView/1/f7346cf9e9d06a92", sizeof(DotView), false},
    {"tick", "sketchnav/Tick/1/cd5c8b58a800b493", sizeof(Tick), false},
    {"particles", "sketchnav/Particles/1/83328733bea235fe", sizeof(Particles), false},
    {"estimate", "sketchnav/PoseEstimate/1/6fe39940e3453396", sizeof(PoseEstimate), false},
    {"relations", "sketchnav/Relations/1/76abc44575759b47", sizeof(Relations), false},
    {"landmark_view", "sketchnav/LandmarkView/3/bfe8c78e69f611de", sizeof(LandmarkView), false},
    {"description", "sketchnav/Description/2/207b246074302ce7", sizeof(Description), false},
    {"plan", "sketchnav/Plan/1/948683b6daa21d2e", sizeof(Plan), false},
    {"correspondence", "sketchnav/Correspondence/1/04977d1d4f303caf", sizeof(Correspondence), false},
    {"question", "sketchnav/Question/1/d383d138d8361399", sizeof(Question), false},
    {"landmark_progress", "sketchnav/LandmarkProgress/2/001370b1fbf1a4a1", sizeof(LandmarkProgress), false},
    {"journey", "sketchnav/Journey/1/f054905aa2292e8d", sizeof(Journey), false},
    {"whereabouts", "sketchnav/Whereabouts/1/3d39eeeb79b1c3a9", sizeof(Whereabouts), false},
    {"command", "sketchnav/VelocityCommand/1/45ef9b3c7d504529", sizeof(VelocityCommand), false},
    {"status", "sketchnav/MissionStatus/1/ed44629eb242885e", sizeof(MissionStatus), false},
    {"latency", "sketchnav/Latency/2/6fd35d9cb700fb1d", sizeof(Latency), false},
    {"health", "sketchnav/Health/1/3346ae3b59831f8a", sizeof(Health), true},
    {"faults", "sketchnav/Fault/1/4495aa9889fd2429", sizeof(Fault), false},
    {"recorded", "sketchnav/Recorded/1/78855a6d7e9eadc4", sizeof(Recorded), false},
}};

}  // namespace sketchnav
