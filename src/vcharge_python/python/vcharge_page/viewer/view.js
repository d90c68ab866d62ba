// The camera that looks at the map: it turns around a target on the ground, z up.

const NEAREST_M = 1.0, FARTHEST_M = 5000.0;
const TURN_RAD_PER_PX = 0.006, KEY_TURN_RAD = 0.06, KEY_ZOOM = 1.15, KEY_MOVE = 0.06;
const STEEPEST_RAD = 1.5607;  // just below straight down, where the direction of view is still defined

export class View {
  /** `onChange` is called after each change. */
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.2, 2 * FARTHEST_M);
    this.camera.up.set(0, 0, 1);
    this.target = new THREE.Vector3();
    this.distance_m = 50;
    this.heading_rad = 0;  // of the view over the ground, from the x axis
    this.slope_rad = 0.8;  // below the horizon
    this.pointers = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
    }, {passive: false});
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.change();
  }

  /** Looks at a box. */
  lookAtBox(low, high) {
    this.target.set(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]);
    const size = Math.hypot(high[0] - low[0], high[1] - low[1]);
    this.distance_m = Math.min(Math.max(0.9 * size, 10), FARTHEST_M);
    this.change();
  }

  lookFromAbove() {
    this.slope_rad = STEEPEST_RAD;
    this.heading_rad = Math.PI / 2;
    this.change();
  }

  lookAt(point) {
    this.target.copy(point);
    this.change();
  }

  turn(heading_rad, slope_rad) {
    this.heading_rad += heading_rad;
    this.slope_rad = Math.min(Math.max(this.slope_rad + slope_rad, -0.3), STEEPEST_RAD);
    this.change();
  }

  zoom(factor) {
    this.distance_m = Math.min(Math.max(this.distance_m * factor, NEAREST_M), FARTHEST_M);
    this.change();
  }

  /** Moves the target over the ground: right and forwards as seen. */
  pan(right_m, forwards_m) {
    const c = Math.cos(this.heading_rad), s = Math.sin(this.heading_rad);
    this.target.x += c * forwards_m + s * right_m;
    this.target.y += s * forwards_m - c * right_m;
    this.change();
  }

  change() {
    const flat = this.distance_m * Math.cos(this.slope_rad);
    this.camera.position.set(this.target.x - flat * Math.cos(this.heading_rad),
                             this.target.y - flat * Math.sin(this.heading_rad),
                             this.target.z + this.distance_m * Math.sin(this.slope_rad));
    this.camera.near = Math.max(0.05, 0.01 * this.distance_m);
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(this.target);
    this.camera.updateMatrixWorld(true);
    this.onChange();
  }

  press(event) {
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      return;
    }
    const now = {x: event.clientX, y: event.clientY}, dx = now.x - before.x, dy = now.y - before.y;
    const metresPerPixel = 2 * this.distance_m * Math.tan(this.camera.fov * Math.PI / 360) / this.canvas.clientHeight;
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const size = (point) => Math.max(Math.hypot(point.x - other.x, point.y - other.y), 1);
      this.pan(-0.5 * dx * metresPerPixel, 0.5 * dy * metresPerPixel);  // each finger moves half
      this.zoom(size(before) / size(now));
    } else if (event.buttons & 2 || event.shiftKey) {
      this.pan(-dx * metresPerPixel, dy * metresPerPixel);
    } else {
      this.turn(-dx * TURN_RAD_PER_PX, dy * TURN_RAD_PER_PX);
    }
    this.pointers.set(event.pointerId, now);
  }

  /** Whether the key was one of the view's. */
  pressKey(key) {
    const step_m = KEY_MOVE * this.distance_m;
    const actions = {
      w: () => this.pan(0, step_m), s: () => this.pan(0, -step_m), a: () => this.pan(-step_m, 0), d: () => this.pan(step_m, 0),
      q: () => this.turn(KEY_TURN_RAD, 0), e: () => this.turn(-KEY_TURN_RAD, 0), "+": () => this.zoom(1 / KEY_ZOOM),
      "-": () => this.zoom(KEY_ZOOM), t: () => this.lookFromAbove()};
    if (!(key in actions)) {
      return false;
    }
    actions[key]();
    return true;
  }
}
