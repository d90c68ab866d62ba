// Measures the distance between two points that are clicked.

import {linesOf} from "./drive.js";

const RADIUS_PX = 9;

export class Measure {
  /** `find(x, y)` gives the point (or null) at a position in normalized coordinates; `tell(text)` shows a text. */
  constructor(canvas, button, find, tell, onChange) {
    Object.assign(this, {canvas, button, find, tell, onChange});
    this.group = new THREE.Group();
    this.points = [];
    this.isOn = false;
    button.addEventListener("click", () => this.toggle());
    canvas.addEventListener("pointerdown", (event) => this.pressed = [event.clientX, event.clientY]);
    canvas.addEventListener("click", (event) => this.click(event));
  }

  toggle() {
    this.isOn = !this.isOn;
    this.button.setAttribute("aria-pressed", this.isOn);
    this.canvas.classList.toggle("measuring", this.isOn);
    this.clear();
    this.tell(this.isOn ? "Click the first point." : "");
  }

  clear() {
    this.points = [];
    for (const old of [...this.group.children]) {
      this.group.remove(old);
      old.geometry.dispose();
    }
    this.onChange();
  }

  /** Adds lines that nothing hides. */
  show(lines) {
    lines.material.depthTest = false;
    lines.renderOrder = 1;
    this.group.add(lines);
  }

  click(event) {
    const dragged = this.pressed && Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > 4;
    if (this.isOn && !dragged) {
      this.add(2 * event.clientX / this.canvas.clientWidth - 1, 1 - 2 * event.clientY / this.canvas.clientHeight);
    }
  }

  add(x, y) {
    const point = this.find(x, y, 2 * RADIUS_PX / this.canvas.clientHeight);
    if (!point) {
      this.tell("There is nothing to measure: click a point or the ground.");
      return;
    }
    if (this.points.length === 2) {
      this.clear();
    }
    this.points.push(point);
    const cross = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap((axis) => [-0.15, 0.15].map(
        (size) => point.clone().addScaledVector(new THREE.Vector3(...axis), size).toArray()));
    this.show(linesOf(cross, 0xffffff));
    if (this.points.length === 1) {
      this.tell(`From ${textOf(point)}. Click the second point.`);
    } else {
      const [from, to] = this.points;
      this.show(linesOf([from.toArray(), to.toArray()], 0xffffff));
      const flat_m = Math.hypot(to.x - from.x, to.y - from.y);
      this.tell(`${from.distanceTo(to).toFixed(2)} m (over the ground ${flat_m.toFixed(2)} m, ` +
                `height ${(to.z - from.z).toFixed(2)} m)`);
    }
    this.onChange();
  }
}

function textOf(point) {
  return `(${point.x.toFixed(2)}, ${point.y.toFixed(2)}, ${point.z.toFixed(2)})`;
}
