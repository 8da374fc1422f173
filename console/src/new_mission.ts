/** A new mission from a template: its name, and what it is to do. */
import { askInDialog, h, icon, setText } from "./dom";
import { askEditor } from "./edited";
import { formatName } from "./format";
import type { Robot } from "./page";

interface Template {
  name: string;
  about: string;
}

/** Asks for a name and a template, and has the robot write the mission; returns its name, empty if a person left. */
export async function newMission(robot: Robot, host: HTMLElement): Promise<string> {
  let templates: Template[];
  try {
    templates = await askEditor<Template[]>(robot.link, "templates", "");
  } catch (error) {
    robot.notify((error as Error).message);
    return "";
  }
  const name = h("input", { id: "new-name", required: "", autocomplete: "off" });
  const list = h("select", { id: "new-template" }, ...templates.map((one) => h("option", { value: one.name }, formatName(one.name))));
  const about = h("p", { class: "label" });
  const says = h("p", { role: "alert" });
  const show = () => setText(about, templates.find((one) => one.name === list.value)?.about ?? "");
  list.onchange = show;
  show();
  const make = h("button", {}, icon("check"), "Make it");
  const leave = h("button", { type: "button" }, icon("cross"), "Not now");
  const rule = h("span", { class: "label" }, " lower-case letters, digits and underscores");
  const fields = [h("label", { for: "new-name" }, "Name", rule), name, h("label", { for: "new-template" }, "What it does"), list];
  const form = h("form", {}, h("h2", { id: "new-title" }, "New mission"), ...fields, about, says, h("div", { class: "row" }, make, leave));
  const dialog = h("dialog", { class: "save-dialog", "aria-labelledby": "new-title" }, form);
  leave.onclick = () => dialog.close("");
  form.onsubmit = async (event) => {
    event.preventDefault();
    make.disabled = true;
    try {
      await askEditor(robot.link, "new", name.value, { template: list.value });
      dialog.close(name.value);
    } catch (error) {
      setText(says, (error as Error).message);
    }
    make.disabled = false;
  };
  return askInDialog(host, dialog);
}
