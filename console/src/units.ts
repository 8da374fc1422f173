/** Units of numbers in messages of standard types, in SI: as deep as the messages are nested; one word is for all within. */
import { isMessage, type Json, type Message } from "./rosbridge";

const VECTOR = { x: "m", y: "m", z: "m" };
const POSE = { position: VECTOR };
const TWIST = { linear: "m/s", angular: "rad/s" };
const ACCELERATION = { linear: "m/s\u00b2", angular: "rad/s\u00b2" };
const FORCE = { force: "N", torque: "N\u00b7m" };

const UNITS: Record<string, Message> = {
  "geometry_msgs/Point": VECTOR,
  "geometry_msgs/Point32": VECTOR,
  "geometry_msgs/PointStamped": { point: VECTOR },
  "geometry_msgs/Pose": POSE,
  "geometry_msgs/Pose2D": { x: "m", y: "m", theta: "rad" },
  "geometry_msgs/PoseStamped": { pose: POSE },
  "geometry_msgs/PoseWithCovariance": { pose: POSE },
  "geometry_msgs/PoseWithCovarianceStamped": { pose: { pose: POSE } },
  "geometry_msgs/Transform": { translation: "m" },
  "geometry_msgs/TransformStamped": { transform: { translation: "m" } },
  "geometry_msgs/Twist": TWIST,
  "geometry_msgs/TwistStamped": { twist: TWIST },
  "geometry_msgs/TwistWithCovariance": { twist: TWIST },
  "geometry_msgs/TwistWithCovarianceStamped": { twist: { twist: TWIST } },
  "geometry_msgs/Accel": ACCELERATION,
  "geometry_msgs/AccelStamped": { accel: ACCELERATION },
  "geometry_msgs/Wrench": FORCE,
  "geometry_msgs/WrenchStamped": { wrench: FORCE },
  "nav_msgs/Odometry": { pose: { pose: POSE }, twist: { twist: TWIST } },
  "sensor_msgs/BatteryState": { voltage: "V", temperature: "\u00b0C", current: "A", charge: "Ah", capacity: "Ah", design_capacity: "Ah", cell_voltage: "V", cell_temperature: "\u00b0C" },
  "sensor_msgs/FluidPressure": { fluid_pressure: "Pa" },
  "sensor_msgs/Illuminance": { illuminance: "lx" },
  "sensor_msgs/Imu": { angular_velocity: "rad/s", linear_acceleration: "m/s\u00b2" },
  "sensor_msgs/MagneticField": { magnetic_field: "T" },
  "sensor_msgs/NavSatFix": { altitude: "m" },
  "sensor_msgs/Range": { field_of_view: "rad", min_range: "m", max_range: "m", range: "m" },
  "sensor_msgs/Temperature": { temperature: "\u00b0C" },
};

/** Returns the units within a type, empty if they are not known. */
export function unitsIn(type: string): Message {
  return UNITS[plain(type)] ?? {};
}

/** Returns the units of a field, of those of its message; undefined if it has none. */
export function unitsAt(units: Json | undefined, name: string): Json | undefined {
  return isMessage(units ?? null) ? (units as Message)[name] : typeof units === "string" ? units : undefined;
}

/** Returns the name of a type without `msg`, `srv` or `action` in its middle. */
export function plain(type: string): string {
  return type.replace(/\/(msg|srv|action)\//, "/");
}
