// What pages do with roslib: those of ROS 2, and those that were written for ROS 1. Prints JSON.
import { pathToFileURL } from "node:url";
const { Action, ActionClient, Goal, Param, Ros, Service, Topic } = await import(
  pathToFileURL(`${process.argv[2]}/node_modules/roslib/dist/RosLib.js`)
);

const ros = new Ros({ url: `ws://127.0.0.1:${process.argv[3]}` });
await new Promise((resolve, reject) => {
  ros.on("connection", resolve);
  ros.on("error", reject);
});
const asked = (ask) => new Promise((resolve, reject) => ask(resolve, reject));
const told = {};
told.nodes = await asked((then, no) => ros.getNodes(then, no));
told.actions = await asked((then, no) => ros.getActionServers(then, no));
const topics = await asked((then, no) => ros.getTopicsAndRawTypes(then, no));
told.raw = topics.typedefs_full_text[topics.topics.indexOf("/odom")].split("\n").slice(1, 3); // below a comment
const details = await asked((then, no) => ros.getMessageDetails("geometry_msgs/Twist", then, no));
told.decoded = ros.decodeTypeDefs(details);
const speed = new Param({ ros, name: "/base:max_speed" });
told.speed = await asked((then, no) => speed.get(then, no));
told.set = await asked((then, no) => new Param({ ros, name: "/battery:runtime" }).set(120, then, no));
told.missing = await asked((then, no) => new Param({ ros, name: "/robot_gui/videoTopic" }).get(then, no));
told.names = await asked((then, no) => ros.getParams(then, no));

for (const compression of ["cbor", "png"]) {
  const odometry = new Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry", compression });
  const message = await asked((then) => odometry.subscribe(then));
  told[compression] = [message.child_frame_id, message.pose.covariance.length];
  odometry.unsubscribe();
}

const pose = (x) => ({ header: { frame_id: "map" }, pose: { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
const go = new Action({ ros, name: "/go_to", actionType: "nav2_msgs/action/NavigateToPose" });
let distance = Infinity;
told.result = await asked((then, no) => go.sendGoal({ pose: pose(0.2) }, then, (feedback) => (distance = feedback.distance_remaining), no));
told.fed_back = distance < Infinity;
const refused = new Action({ ros, name: "/nothing", actionType: "nav2_msgs/action/NavigateToPose" });
told.refused = await asked((then) => refused.sendGoal({}, then, () => {}, then));

const moveBase = new ActionClient({ ros, serverName: "/move_base", actionName: "move_base_msgs/MoveBaseAction" });
const goal = (x) => new Goal({ actionClient: moveBase, goalMessage: { target_pose: pose(x) } });
const first = goal(0);
const statuses = new Set();
first.on("status", ({ status }) => statuses.add(status));
await asked((then) => {
  first.on("result", then);
  first.send();
});
told.statuses = [...statuses].sort();
const second = goal(5);
await asked((then) => {
  second.on("result", then);
  second.on("feedback", () => second.cancel());
  second.send();
});
told.canceled = second.status.status;

const bell = new Service({ ros, name: "/bell", serviceType: "std_srvs/SetBool" });
bell.advertise((request, response) => {
  response.success = request.data;
  response.message = "ding";
  return true;
});
const caller = new Service({ ros, name: "/bell", serviceType: "std_srvs/SetBool" });
for (let attempt = 0; attempt < 50 && !told.bell; attempt += 1) {
  try {
    told.bell = await asked((then, no) => caller.callService({ data: true }, then, no));
  } catch {
    await asked((then) => setTimeout(then, 100));
  }
}

// An action that this page serves: the first goal is carried out, the second is canceled.
const greet = new Action({ ros, name: "/greet", actionType: "nav2_msgs/action/NavigateToPose" });
greet.advertise(
  (goal, id) => {
    greet.sendFeedback(id, { number_of_recoveries: 7 });
    if (goal.behavior_tree !== "wait") greet.setSucceeded(id, { error_code: 3 });
  },
  (id) => greet.setCanceled(id, { error_code: 4 }),
);
const visitor = new Action({ ros, name: "/greet", actionType: "nav2_msgs/action/NavigateToPose" });
const greeted = (behavior_tree) =>
  asked((then, no) => {
    const id = visitor.sendGoal({ behavior_tree }, then, (feedback) => {
      told.recoveries = feedback.number_of_recoveries;
      if (behavior_tree === "wait") visitor.cancelGoal(id);
    }, no);
  });
for (let attempt = 0; attempt < 50 && !told.greeted; attempt += 1) {
  told.greeted = await greeted("").catch(() => asked((then) => setTimeout(then, 100)));
}
told.unwanted = await greeted("wait").catch((said) => ({ said }));
console.log(JSON.stringify(told));
ros.close();
