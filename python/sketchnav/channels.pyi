"""The messages of the channels that all navigators have. Generated; tests/house/python_package.rs compares."""

from .messages import Channel, Header, Message, Part, PoseM, Twist

class Drawing(Message):
    header: Header
    kind: int
    reserved: int

class Understood(Message):
    header: Header
    kind: int
    accepted: int
    sketch_seq: int
    route_seq: int
    sketch_width_px: int
    sketch_height_px: int
    scale: float
    wall_direction_rad: float
    words: str

class MissionCommand(Message):
    header: Header
    order: int
    task: int
    here_px: memoryview
    here_yaw_rad: float
    has_heading: int
    reserved: int
    place: str

class Odometry(Message):
    header: Header
    pose: PoseM
    twist: Twist

class LaserScan(Message):
    header: Header
    angle_min_rad: float
    angle_max_rad: float
    angle_increment_rad: float
    time_increment_s: float
    scan_time_s: float
    range_min_m: float
    range_max_m: float
    beam_count: int
    ranges_m: memoryview

class SonarScan(Message):
    header: Header
    angle_min_rad: float
    angle_increment_rad: float
    half_opening_rad: float
    ring_radius_m: float
    scan_time_s: float
    range_min_m: float
    range_max_m: float
    sonar_count: int
    ranges_m: memoryview

class SeenMarker(Part):
    id: int
    x_m: float
    y_m: float
    facing_rad: float

class MarkerView(Message):
    header: Header
    camera_x_m: float
    camera_y_m: float
    camera_yaw_rad: float
    half_view_rad: float
    range_min_m: float
    range_max_m: float
    frame_time_s: float
    marker_count: int
    markers: list[SeenMarker]

class SeenDot(Part):
    x_m: float
    y_m: float

class DotView(Message):
    header: Header
    side_m: float
    margin_m: float
    frame_time_s: float
    dot_count: int
    dots: list[SeenDot]

class Tick(Message):
    header: Header
    newest: memoryview

class VelocityCommand(Message):
    header: Header
    twist: Twist
    last: int
    reserved: int

class MissionStatus(Message):
    header: Header
    task: int
    task_count: int
    state: int
    reached_count: int
    task_time_s: float
    task_path_m: float
    remaining_m: float
    speed_mps: float
    name: str
    reason: str

DRAWING: Channel[Drawing]
UNDERSTOOD: Channel[Understood]
ORDERS: Channel[MissionCommand]
MISSION: Channel[MissionCommand]
ODOMETRY: Channel[Odometry]
SCAN: Channel[LaserScan]
SONAR: Channel[SonarScan]
MARKERS: Channel[MarkerView]
VIEW: Channel[DotView]
TICK: Channel[Tick]
COMMAND: Channel[VelocityCommand]
STATUS: Channel[MissionStatus]
