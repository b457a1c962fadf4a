"""The channels that all navigators have. `sketchnav channels` lists them with their writers and readers.

`SONAR.message` is the class of the messages of `SONAR`.
"""

from .messages import _Common

#: Drawings that people make.
DRAWING = _Common("drawing")
#: Orders of the person at the pad.
ORDERS = _Common("orders")
#: Orders from the supervisor.
MISSION = _Common("mission")
#: Dead reckoning.
ODOMETRY = _Common("odometry")
#: Laser scans.
SCAN = _Common("scan")
#: Readings of the ring of sonars.
SONAR = _Common("sonar")
#: The markers that the camera sees.
MARKERS = _Common("markers")
#: The dots of a plane that the camera's window shows.
VIEW = _Common("view")
#: The heartbeat.
TICK = _Common("tick")
#: Velocities for the robot to drive.
COMMAND = _Common("command")
#: The state of the mission.
STATUS = _Common("status")
#: The sketcher's reply to a drawing.
UNDERSTOOD = _Common("understood")
